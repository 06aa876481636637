"""Small CSV tables, such as the heights of a flatness measurement, and lists of the variables of a file."""

from pathlib import Path

import numpy as np

from checks.arrays import Array
from checks.declare import CsvTable
from checks.errors import RecordError
from hw.records.damage import refused
from hw.records.limits import DEFAULT_LIMITS
from hw.records.source import Source, load_bytes
from hw.records.textfile import open_csv
from hw.records.variable import listing
from hw.records.vet import loaded


def read_table(path: Path, table: CsvTable) -> dict[str, Array]:
    """Return column -> (N,) of a CSV file: see `table_of`. Raises RecordError, also if the file cannot be read."""
    return table_of(load_bytes(path, DEFAULT_LIMITS), table)


def table_of(source: Source, table: CsvTable) -> dict[str, Array]:
    """Return column -> (N,) of the bytes of a CSV file with the declared columns. Raises RecordError if a column or a
    row is missing, or a field is not a finite number."""
    with refused(source.file):
        found = open_csv(source.file, source.raw)
        missing = [c for c in table.columns if c not in found]
        if missing:
            raise RecordError(f"{source.file}: lacks column {', '.join(missing)}; it has {listing(found)}")
        columns = {c: loaded(source.file, c, found[c]) for c in table.columns}
    for name, values in columns.items():
        _vet(source.file, name, values, table.min_rows)
    return columns


def _vet(file: str, name: str, values: Array, min_rows: int) -> None:
    if values.size < min_rows:
        raise RecordError(f"{file}: has {values.size} rows, at least {min_rows} are needed")
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise RecordError(f"{file}: column '{name}' holds {values[wrong[0]]} in row {wrong[0] + 1}, expected a number")


def list_channels(path: Path) -> dict[str, tuple[int, ...]]:
    """Return name -> shape of everything in a record file, for messages and pickers; no data are read. Raises
    RecordError."""
    source = load_bytes(path, DEFAULT_LIMITS)
    with refused(source.file):
        return {name: v.shape for name, v in source.variables().items()}
