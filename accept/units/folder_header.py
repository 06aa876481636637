"""Entries of `unit.toml` outside the checks' sections: text, sections of texts, days."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, fields
from datetime import date
from typing import Any, TypeGuard, TypeVar, get_type_hints

from accept.base.documents.results import UnitHeader
from accept.base.spelling import serial_problem
from accept.units.unit_entry import is_reserved
from checks.acceptance import CHECKS
from checks.declare import Measured
from specs.bench import Channels, channel_map
from specs.plugins import products

TYPED = "typed"  # in [read_with], of a value that no instrument gave
ORIGIN = (
    "manufacturer", "type", "lot", "supplier", "order", "customer", "customer_contact", "condition", "received",
    "shift", "study",
)  # fmt: skip
ENVIRONMENT = {"temperature_C": (-20.0, 60.0), "humidity_percent": (0.0, 100.0)}  # a unit is measured within these

Data = Mapping[str, Any]
Problems = list[str]
Reader = Callable[[Data, str, Problems], Any]


def header_of(data: Data, problems: Problems) -> UnitHeader:
    """Return the header: each field as its rule reads it, or without one as its type says."""
    hints = get_type_hints(UnitHeader)
    readers = {f.name: _RULES.get(f.name) or _OF_TYPE[hints[f.name]] for f in fields(UnitHeader)}
    return UnitHeader(**{name: read(data, name, problems) for name, read in readers.items()})


def _text(data: Data, key: str, problems: Problems) -> str:
    """Return a text; it is required if its field has no default."""
    if key not in data:
        if UnitHeader.__dataclass_fields__[key].default is MISSING:
            problems.append(f"{key} is missing")
        return ""
    if not isinstance(data[key], str) or not data[key]:
        problems.append(f"{key} = {data[key]!r}: expected text")
        return ""
    return str(data[key])


def _serial(data: Data, key: str, problems: Problems) -> str:
    serial = _text(data, key, problems)
    if serial and (problem := serial_problem(serial)):
        problems.append(f"{key} = {serial!r}: {problem}")
    return serial


def _kind(data: Data, key: str, problems: Problems) -> str:
    kind = _text(data, key, problems)
    if kind and kind not in products():
        problems.append(f"{key} = {kind!r}: no such product (installed: {', '.join(products())})")
    return kind


def _truth(data: Data, key: str, problems: Problems) -> bool:
    found = data.get(key, False)
    if not isinstance(found, bool):
        problems.append(f"{key} = {found!r}: expected true or false")
    return found is not False  # fail closed: a unit whose `simulated` is unreadable was not measured


def _texts(data: Data, key: str, problems: Problems) -> dict[str, str]:
    table = _section(data, key, problems)
    wrong = [k for k, v in table.items() if not isinstance(v, str)]
    problems.extend(f"[{key}] {k} = {table[k]!r}: expected text" for k in wrong)
    return {k: v for k, v in table.items() if k not in wrong}


def _section(data: Data, key: str, problems: Problems) -> dict[str, Any]:
    """Return a section; an empty one if it is absent or not a table."""
    table = data.get(key, {})
    if not isinstance(table, dict):
        problems.append(f"{key} = {table!r}: expected a section [{key}]")
        return {}
    return table


def _origin(data: Data, key: str, problems: Problems) -> dict[str, str]:
    return {k: v for k, v in _known(_texts(data, key, problems), key, ORIGIN, problems).items() if v}


def _provided(data: Data, key: str, problems: Problems) -> dict[str, str]:
    found = _texts(data, key, problems)
    wrong = [name for name, who in found.items() if name not in CHECKS or not who.strip()]
    expected = "expected a section and who provided it, 'customer' or a name"
    problems.extend(f"[{key}] {name}: {expected}" for name in wrong)
    return {name: who.strip() for name, who in found.items() if name not in wrong}


def _environment(data: Data, key: str, problems: Problems) -> dict[str, Measured]:
    """Return properties of the air, each a number or a value with its U."""
    given = {}
    for name, stated in _known(_section(data, key, problems), key, ENVIRONMENT, problems).items():
        value, U = (stated.get("value"), stated.get("U")) if isinstance(stated, dict) else (stated, None)
        lo, hi = ENVIRONMENT[name]
        if not (_is_number(value) and lo <= value <= hi and (U is None or (_is_number(U) and U > 0))):
            problems.append(f"[{key}] {name} = {stated}: expected {lo:g} to {hi:g}, or {{ value = 21.5, U = 0.5 }}")
            continue
        given[name] = Measured(float(value), None if U is None else float(U))
    return given


_OF_TYPE: Mapping[Any, Reader] = {str: _text, bool: _truth, Mapping[str, str]: _texts}
_RULES: Mapping[str, Reader] = {
    "serial": _serial, "kind": _kind, "origin": _origin, "environment": _environment, "provided": _provided,
}  # fmt: skip

T = TypeVar("T")


def _known(table: Mapping[str, T], section: str, names: Collection[str], problems: Problems) -> dict[str, T]:
    problems.extend(f"[{section}] {k}: unknown key (known: {', '.join(names)})" for k in table if k not in names)
    return {k: v for k, v in table.items() if k in names}


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def channels_of(data: Data, problems: Problems) -> Channels:
    """Return `[channels]`: our name -> name in the records, or a table with name, gain and unit."""
    try:
        return channel_map(_section(data, "channels", problems))
    except ValueError as e:
        problems.append(f"[channels] {e}")
        return {}


def by_check(data: Data, key: str, problems: Problems) -> dict[str, Any]:
    """Return a section of `BY_CHECK`."""
    is_one, expected = BY_CHECK[key]
    table = _section(data, key, problems)
    found = {name: given for name, given in table.items() if name in CHECKS and is_one(given)}
    wrong = {k: v for k, v in table.items() if k not in found}
    problems.extend(f"[{key}] {k} = {v!r}: expected {expected}" for k, v in wrong.items())
    return found


def _are_texts(lines: object) -> TypeGuard[list[str]]:
    return isinstance(lines, list) and all(isinstance(line, str) and line for line in lines)


def _are_pictures(names: object) -> bool:
    return _are_texts(names) and all(
        name.lower().endswith(".jpg") and "\0" not in name and not is_reserved(name) for name in names
    )


BY_CHECK: Mapping[str, tuple[Callable[[object], bool], str]] = {  # what a check may have there, in code and in words
    "measured": (lambda day: type(day) is date, "a section and a day, 2026-11-21"),
    "notes": (_are_texts, "a check and a list of texts"),
    "measured_by": (_are_texts, "a check and a list of names"),  # of the persons
    "read_with": (_are_texts, "a check and a list of instruments"),  # or `TYPED`; absent: all typed
    "pictures": (_are_pictures, "a check and a list of .jpg files"),  # printed on the certificate
}
