"""Entries of `unit.toml` outside the checks' sections: text, sections of texts, days."""

import math
from collections.abc import Callable, Collection, Mapping
from datetime import date
from typing import Any, TypeGuard, TypeVar

from accept.units.unit_entry import is_reserved
from checks.acceptance import CHECKS
from checks.declare import Measured
from specs.bench import Channels, channel_map

MOST_ENTRIES = 200  # of a section: the store is asked about every part
TYPED = "typed"  # in [read_with], of a value that no instrument gave
ORIGIN = ("manufacturer", "type", "lot", "supplier", "order", "customer", "condition", "received", "shift", "study")
ENVIRONMENT = {"temperature_C": (-20.0, 60.0), "humidity_percent": (0.0, 100.0)}  # a unit is measured within these


def string(data: Mapping[str, Any], key: str, problems: list[str]) -> str:
    """Read a required text."""
    if key not in data:
        problems.append(f"{key} is missing")
        return ""
    if not isinstance(data[key], str) or not data[key]:
        problems.append(f"{key} = {data[key]!r}: expected text")
        return ""
    return str(data[key])


def simulated(data: Mapping[str, Any], problems: list[str]) -> bool:
    """Return whether the unit was simulated, by a training, `accept simulate` or simulated instruments."""
    found = data.get("simulated", False)
    if not isinstance(found, bool):
        problems.append(f"simulated = {found!r}: expected true or false")
    return found is not False  # fail closed: an unreadable section is no measurement


def strings(data: Mapping[str, Any], key: str, problems: list[str]) -> dict[str, str]:
    """Return a section of texts."""
    table = _section(data, key, problems)
    wrong = [k for k, v in table.items() if not isinstance(v, str)]
    problems.extend(f"[{key}] {k} = {table[k]!r}: expected text" for k in wrong)
    return {k: v for k, v in table.items() if k not in wrong}


def _section(data: Mapping[str, Any], key: str, problems: list[str]) -> dict[str, Any]:
    """Return a section; an empty one if it is absent or not a table."""
    table = data.get(key, {})
    if not isinstance(table, dict):
        problems.append(f"{key} = {table!r}: expected a section [{key}]")
        return {}
    if len(table) > MOST_ENTRIES:
        problems.append(f"[{key}] has {len(table)} entries, at most {MOST_ENTRIES} are read")
        return {}
    return table


def channels(data: Mapping[str, Any], problems: list[str]) -> Channels:
    """Return `[channels]`: our name -> name in the records, or a table with name, gain and unit."""
    try:
        return channel_map(_section(data, "channels", problems))
    except ValueError as e:
        problems.append(f"[channels] {e}")
        return {}


def notes(data: Mapping[str, Any], problems: list[str]) -> dict[str, list[str]]:
    """Return lines of `[notes]`, by check."""
    return _by_check(data, "notes", _are_texts, "a check and a list of texts", problems)


def measured_by(data: Mapping[str, Any], problems: list[str]) -> dict[str, list[str]]:
    """Return `[measured_by]`: check -> names of the persons who measured it."""
    return _by_check(data, "measured_by", _are_texts, "a check and a list of names", problems)


def read_with(data: Mapping[str, Any], problems: list[str]) -> dict[str, list[str]]:
    """Return `[read_with]`: check -> instruments, or `typed`, behind its values; absent: all typed."""
    return _by_check(data, "read_with", _are_texts, "a check and a list of instruments", problems)


def pictures(data: Mapping[str, Any], problems: list[str]) -> dict[str, list[str]]:
    """Return `[pictures]`: check -> names of the pictures that are printed on the certificate."""
    return _by_check(data, "pictures", _are_pictures, "a check and a list of .jpg files", problems)


def _by_check(
    data: Mapping[str, Any], key: str, is_one: Callable[[Any], bool], expected: str, problems: list[str]
) -> dict[str, Any]:
    table = _section(data, key, problems)
    found = {name: given for name, given in table.items() if name in CHECKS and is_one(given)}
    wrong = {k: v for k, v in table.items() if k not in found}
    problems.extend(f"[{key}] {k} = {v!r}: expected {expected}" for k, v in wrong.items())
    return found


def _are_pictures(names: object) -> bool:
    return _are_texts(names) and all(
        name.lower().endswith(".jpg") and "\0" not in name and not is_reserved(name) for name in names
    )


def _are_texts(lines: object) -> TypeGuard[list[str]]:
    return isinstance(lines, list) and all(isinstance(line, str) and line for line in lines)


def origin(data: Mapping[str, Any], problems: list[str]) -> dict[str, str]:
    """Return `[origin]`: where a unit comes from, as its maker and the workshop call it."""
    return {k: v for k, v in _known(strings(data, "origin", problems), "origin", ORIGIN, problems).items() if v}


def provided(data: Mapping[str, Any], problems: list[str]) -> dict[str, str]:
    """Return `[provided]`: section -> who provided its values, `customer` or the name of an external provider."""
    found = strings(data, "provided", problems)
    wrong = [name for name, who in found.items() if name not in CHECKS or not who.strip()]
    expected = "expected a section and who provided it, 'customer' or a name"
    problems.extend(f"[provided] {name}: {expected}" for name in wrong)
    return {name: who.strip() for name, who in found.items() if name not in wrong}


def environment(data: Mapping[str, Any], problems: list[str]) -> dict[str, Measured]:
    """Return `[environment]`: properties of the air, each a number or a value with its U."""
    given = {}
    for name, stated in _known(_section(data, "environment", problems), "environment", ENVIRONMENT, problems).items():
        value, U = (stated.get("value"), stated.get("U")) if isinstance(stated, dict) else (stated, None)
        lo, hi = ENVIRONMENT[name]
        if not (_is_number(value) and lo <= value <= hi and (U is None or (_is_number(U) and U > 0))):
            problems.append(
                f"[environment] {name} = {stated}: expected {lo:g} to {hi:g}, or {{ value = 21.5, U = 0.5 }}"
            )
            continue
        given[name] = Measured(float(value), None if U is None else float(U))
    return given


T = TypeVar("T")


def _known(table: Mapping[str, T], section: str, names: Collection[str], problems: list[str]) -> dict[str, T]:
    problems.extend(f"[{section}] {k}: unknown key (known: {', '.join(names)})" for k in table if k not in names)
    return {k: v for k, v in table.items() if k in names}


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def days(data: Mapping[str, Any], problems: list[str]) -> dict[str, date]:
    """Return days of `[measured]`, by section."""
    return _by_check(data, "measured", lambda day: type(day) is date, "a section and a day, 2026-11-21", problems)
