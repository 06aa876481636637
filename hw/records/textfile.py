"""CSV files: a header row with the names, maybe with units as `de [nm]`, then one row per sample. Numbers with a
decimal point, commas between."""

from functools import cache

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.variable import Variable, unique
from specs.units import parse_header

ROWS = "rows"  # kind of a column


def open_csv(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the columns of the bytes of a CSV file. Raises RecordError and the errors that `damage.refused` converts.

    Every column is read or the file is refused: a row with a field too many or too few would shift the columns.
    """
    header, *rows = _lines(file, raw)
    names = _names(file, header)
    if not rows:
        raise RecordError(f"{file}: holds a header and no rows")
    table = cache(lambda: _numbers(file, rows, names))

    def variable(index: int, name: str, unit: str) -> Variable:
        return Variable(name, (len(rows),), ROWS, lambda: table()[index], unit)

    plain = [parse_header(name) for name in names]
    if len({name for name, _ in plain}) < len(plain):  # `de [nm]` beside `de [um]`: each by its whole header
        plain = [(name, "") for name in names]
    return unique(file, [variable(i, name, unit) for i, (name, unit) in enumerate(plain)])


def _lines(file: str, raw: bytes) -> list[str]:
    """Return the header and every row; empty lines are left out."""
    text = raw.decode("utf-8-sig")
    if "\x00" in text:
        raise RecordError(f"{file}: is not text: character {text.index(chr(0))} is zero")
    if not text.endswith("\n"):
        # A number cut short is still a number: "-15.5" becomes "-1".
        raise RecordError(f"{file}: its last line has no end, so it may be cut; if it is whole, end it with a newline")
    return [line for line in text.split("\n") if line.strip()] or [""]


def _names(file: str, header: str) -> list[str]:
    names = [name.strip().strip('"') for name in header.split(",")]
    if len(names) == 1 and ";" in header:
        raise RecordError(f"{file}: fields are separated by ';', expected ',' and a decimal point")
    wrong = [name for name in names if not name or _is_number(name)]
    if wrong:
        raise RecordError(f"{file}: the first line must name the columns, but holds {wrong[0]!r}")
    return names


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _numbers(file: str, rows: list[str], names: list[str]) -> Array:
    """Return (columns, rows) of the fields, all of which must be numbers."""
    try:
        table = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except ValueError as e:
        raise RecordError(f"{file}: {_first_wrong(rows, names) or e}") from e
    if table.shape[1] != len(names):
        raise RecordError(f"{file}: {_first_wrong(rows, names)}")
    return np.ascontiguousarray(table.T)


def _first_wrong(rows: list[str], names: list[str]) -> str:
    for i, row in enumerate(rows, start=1):
        fields = row.split(",")
        if len(fields) != len(names):
            return f"row {i} below the header has {len(fields)} fields, the header has {len(names)}"
        for name, field in zip(names, fields, strict=True):
            if not _is_number(field):
                return f"row {i} below the header holds {field.strip()!r} in column '{name}', expected a number"
    return ""
