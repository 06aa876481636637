"""A unit's folder as two machines see it: work on another one must be on the same files."""

from dataclasses import replace
from socket import gethostname

from accept.units.unit_folder import UNIT_FILE, UnitError, UnitFolder


def anywhere(unit: UnitFolder) -> UnitFolder:
    """Return the unit by a path that means the same to every process, with the sizes of its files as seen from here."""
    there = replace(unit, path=unit.path.resolve())
    return replace(there, sizes=_sizes(there))


def _sizes(unit: UnitFolder) -> dict[str, int]:
    files = {name: unit.path / name for name in (UNIT_FILE, *unit.files)}
    return {name: path.stat().st_size for name, path in files.items() if path.is_file()}


def vet_shared(unit: UnitFolder) -> None:
    """Raise UnitError if work on a unit would be in vain here, because its folder does not look as it did from the
    other machine: without its files it would only seem incomplete."""
    if unit.sizes is not None and unit.sizes != _sizes(unit):
        words = "its files are not there, or are others; share the folder under this path with every worker"
        raise UnitError(unit.path, [f"as seen from {gethostname()}, {words}"])
