"""Entries into `unit.toml`: comments and order stay, and nothing is written that could not be read back."""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from accept.base.atomic_files import write_atomic
from accept.units import unit_folder
from accept.units.unit_folder import UNIT_FILE, UnitError
from checks.acceptance import CHECKS
from specs.bench import Channels
from specs.files import read_bounded
from specs.strict import check_toml_bounds


def begin(folder: Path, serial: str, kind: str) -> None:
    """Make the folder of a new unit. Raises UnitError when it holds another unit, or serial or kind are none."""
    path = folder / UNIT_FILE
    if path.exists():
        found = unit_folder.read(folder)
        if (found.serial, found.kind) != (serial, kind):
            raise UnitError(path, [f"is the {found.kind} {found.serial}, not the {kind} {serial}"])
        return
    _write(folder, tomlkit.dumps({"serial": serial, "kind": kind}))


def enter(folder: Path, section: str, entries: Mapping[str, Any], simulated: bool = False) -> None:
    """Put entries into a section, with today (UTC) as day of measurement. Entries for another form of the data are
    removed; their files stay. simulated: of simulated instruments; the unit then counts as simulated.

    Raises UnitError if the result would not be a unit."""
    document = _document(folder)
    table = document.setdefault(section, tomlkit.table())
    for other in _other_forms(section, set(entries)) & set(table):
        del table[other]
    for name, value in entries.items():
        table[name] = _item(value)
    if simulated:
        document["simulated"] = True
    document.setdefault("measured", tomlkit.table())[section] = datetime.now(UTC).date()
    _write(folder, tomlkit.dumps(document))


def state_channels(folder: Path, channels: Channels) -> None:
    """Write the channels' sources into [channels]. Raises UnitError if the result would not be a unit."""
    document = _document(folder)
    table = tomlkit.table()
    for name, source in channels.items():
        table[name] = _item(source.to_toml())
    document["channels"] = table
    _write(folder, tomlkit.dumps(document))


def _document(folder: Path) -> tomlkit.TOMLDocument:
    path = folder / UNIT_FILE
    try:
        raw = read_bounded(path)
        check_toml_bounds(raw)
        return tomlkit.parse(raw.decode("utf-8"))
    except (OSError, ValueError, TOMLKitError) as e:
        raise UnitError(path, [f"cannot be read: {e}"]) from e


def _other_forms(section: str, names: set[str]) -> set[str]:
    """Return the inputs that exclude these: other forms of the same check."""
    forms = [{i.name for i in form.inputs} for form in CHECKS[section].forms]
    fitting = set().union(*(form for form in forms if names <= form))
    return set(CHECKS[section].inputs) - fitting


def _item(value: Any) -> Any:
    if not isinstance(value, Mapping):
        return value
    table = tomlkit.inline_table()
    table.update(value)
    return table


def _write(folder: Path, text: str) -> None:
    data = tomlkit.parse(text).unwrap()
    unit_folder.parse(folder, text.encode("utf-8"), data)  # raises UnitError before anything is written
    write_atomic(folder / UNIT_FILE, text.encode("utf-8"), of_unit=True)
