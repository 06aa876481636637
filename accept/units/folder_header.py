"""What stands in `unit.toml` beside the sections of the checks: text, sections of texts, days."""

import math
from collections.abc import Collection, Mapping
from datetime import date
from typing import Any, TypeGuard, TypeVar

from accept.units.unit_entry import is_reserved
from checks.acceptance import CHECKS
from checks.declare import Measured
from specs.bench import Channels, channel_map

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


def strings(data: Mapping[str, Any], key: str, problems: list[str]) -> dict[str, str]:
    """Return a section of texts."""
    table = data.get(key, {})
    if not isinstance(table, dict):
        problems.append(f"{key} = {table!r}: expected a section [{key}]")
        return {}
    wrong = [k for k, v in table.items() if not isinstance(v, str)]
    problems.extend(f"[{key}] {k} = {table[k]!r}: expected text" for k in wrong)
    return {k: v for k, v in table.items() if k not in wrong}


def channels(data: Mapping[str, Any], problems: list[str]) -> Channels:
    """Return a section that says where the channels stand in the records: a name, or a table with name, gain and
    unit."""
    table = data.get("channels", {})
    if not isinstance(table, dict):
        problems.append(f"channels = {table!r}: expected a section [channels]")
        return {}
    try:
        return channel_map(table)
    except ValueError as e:
        problems.append(f"[channels] {e}")
        return {}


def notes(data: Mapping[str, Any], problems: list[str]) -> dict[str, list[str]]:
    """Return lines of `[notes]`, by check."""
    table = data.get("notes", {})
    if not isinstance(table, dict):
        problems.append(f"notes = {table!r}: expected a section [notes]")
        return {}
    found = {name: lines for name, lines in table.items() if name in CHECKS and _are_texts(lines)}
    wrong = {k: v for k, v in table.items() if k not in found}
    problems.extend(f"[notes] {k} = {v!r}: expected a check and a list of texts" for k, v in wrong.items())
    return found


def pictures(data: Mapping[str, Any], problems: list[str]) -> dict[str, list[str]]:
    """Return `[pictures]`: check -> names of the pictures that are printed on the certificate."""
    table = data.get("pictures", {})
    if not isinstance(table, dict):
        problems.append(f"pictures = {table!r}: expected a section [pictures]")
        return {}
    found = {k: v for k, v in table.items() if k in CHECKS and _are_texts(v) and all(map(_is_picture, v))}
    wrong = {k: v for k, v in table.items() if k not in found}
    problems.extend(f"[pictures] {k} = {v!r}: expected a check and a list of .jpg files" for k, v in wrong.items())
    return found


def _is_picture(name: str) -> bool:
    return name.lower().endswith(".jpg") and "\0" not in name and not is_reserved(name)


def _are_texts(lines: object) -> bool:
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
    """Return `[environment]`: what the air was like, each a number or a value with its U."""
    table = data.get("environment", {})
    if not isinstance(table, dict):
        problems.append(f"environment = {table!r}: expected a section [environment]")
        return {}
    given = {}
    for name, stated in _known(table, "environment", ENVIRONMENT, problems).items():
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
    table = data.get("measured", {})
    if not isinstance(table, dict):
        problems.append(f"measured = {table!r}: expected a section [measured]")
        return {}
    found = {name: day for name, day in table.items() if name in CHECKS and type(day) is date}
    wrong = {k: v for k, v in table.items() if k not in found}
    problems.extend(f"[measured] {k} = {v}: expected a section and a day, 2026-11-21" for k, v in wrong.items())
    return found
