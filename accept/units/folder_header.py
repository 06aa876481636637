"""What stands in `unit.toml` beside the sections of the checks: text, sections of texts, days."""

from collections.abc import Mapping
from datetime import date
from typing import Any

from checks.acceptance import CHECKS
from specs.bench import Channels, channel_map


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


def _are_texts(lines: object) -> bool:
    return isinstance(lines, list) and all(isinstance(line, str) and line for line in lines)


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
