"""Small CSV tables, such as the heights of a flatness measurement, and lists of the variables of a file."""

from pathlib import Path

import numpy as np

from checks.arrays import Array
from checks.declare import CsvTable
from checks.errors import RecordError
from hw.records.contents.variable import Remarked, listing
from hw.records.damage import refused
from hw.records.source import Source, load_bytes
from hw.records.text.file import open_csv
from hw.records.vet import loaded
from specs.units import UnitMismatch, factor, unit_of, without_unit


def read_table(path: Path, table: CsvTable) -> Remarked[Array]:
    """Return column -> (N,) of a CSV file: see `table_of`. Raises RecordError, also if the file cannot be read."""
    return table_of(load_bytes(path), table)


def table_of(source: Source, table: CsvTable) -> Remarked[Array]:
    """Return column -> (N,) of a text file, each in the unit of its name: `z_um` is read as it is, `z [nm]` is
    converted. Raises RecordError for a missing column or row and a field that is not a finite number."""
    file = source.file
    with refused(file):
        found = open_csv(file, source.raw)
        there = {c: c if c in found else without_unit(c) for c in table.columns}
        missing = [c for c, name in there.items() if name not in found or (name != c and not found[name].unit)]
        if missing:
            raise RecordError(f"{file}: lacks column {', '.join(missing)}; it has {listing(found)}")
        columns = {c: loaded(file, c, found[name]) for c, name in there.items()}
    remarks = list(found.remarks)
    for c, name in there.items():
        _vet(file, c, columns[c], table.min_rows)
        theirs, ours = found[name].unit or unit_of(c), unit_of(c)
        try:
            scale = factor(theirs, ours)
        except UnitMismatch as e:
            raise RecordError(f"{file}: column '{name}': {e}") from e
        if scale != 1.0:
            columns[c] = columns[c] * scale
            remarks.append(f"{name} is in {theirs}, converted to {ours}")
    return Remarked(columns, (f"{file}: {', '.join(remarks)}",) if remarks else ())


def _vet(file: str, name: str, values: Array, min_rows: int) -> None:
    if values.size < min_rows:
        raise RecordError(f"{file}: has {values.size} rows, at least {min_rows} are needed")
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise RecordError(f"{file}: column '{name}' holds {values[wrong[0]]} in row {wrong[0] + 1}, expected a number")


def list_channels(path: Path) -> dict[str, tuple[int, ...]]:
    """Return name -> shape of everything in a record file, without the data. Raises RecordError."""
    source = load_bytes(path)
    with refused(source.file):
        return {name: v.shape for name, v in source.variables().items()}
