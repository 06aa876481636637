"""A unit's folder as two machines see it: work on another one must be on the same files."""

from collections.abc import Mapping
from dataclasses import replace
from socket import gethostname

from accept.units.unit_folder import UNIT_FILE, UnitFolder


def anywhere(unit: UnitFolder) -> UnitFolder:
    """The unit by a path that means the same to every process."""
    return replace(unit, path=unit.path.resolve())


def looks_of(unit: UnitFolder) -> dict[str, int]:
    """Size of every file of a unit that is there [bytes]."""
    files = {name: unit.path / name for name in (UNIT_FILE, *unit.files)}
    return {name: path.stat().st_size for name, path in files.items() if path.is_file()}


def not_shared(unit: UnitFolder, looks: Mapping[str, int]) -> str | None:
    """Why work on a unit would be in vain here: without its files it would only seem incomplete. None where the folder
    looks as it did from the other machine."""
    if looks_of(unit) == looks:
        return None
    words = "its files are not there, or are others; share the folder under this path with every worker"
    return f"{unit.path}: as seen from {gethostname()}, {words}"
