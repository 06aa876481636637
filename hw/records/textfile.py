"""CSV files: a header row with the names, maybe with units as `de [nm]`, then one row per sample. Numbers with a
decimal point, commas between."""

import io
import re
from functools import cache

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.variable import Variable, unique
from specs.units import parse_header

ROWS = "rows"  # kind of a column
_DIGIT = re.compile(r"\d")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")


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


def open_columns(file: str, raw: bytes) -> dict[str, Variable]:
    """Return a table with one header line, and maybe a line of units below it; fields apart by `;`, tab or comma; with
    `;` or tab also decimal commas."""
    if b"\0" in raw:
        raise RecordError(f"{file}: is not text")
    lines = [line for line in _decode(raw).splitlines() if line.strip()]
    if len(lines) < 2:
        raise RecordError(f"{file}: holds no rows below a header")
    apart = next((c for c in (";", "\t") if c in lines[0]), ",")
    second = [field.strip(' "[]()') for field in lines[1].split(apart)]
    units = second if not any(map(_DIGIT.search, second)) else []
    body = lines[2:] if units else lines[1:]
    rows = body if apart == "," else [_DECIMAL_COMMA.sub(".", line) for line in body]
    heads = [h.strip().strip('"') for h in lines[0].split(apart)]
    _vet_table(file, heads, [row.count(apart) + 1 for row in rows], apart)
    try:
        table = np.loadtxt(io.StringIO("\n".join(rows)), delimiter=apart, comments=None, ndmin=2)
    except ValueError as e:
        raise RecordError(f"{file}: {e}") from e
    stated = units if len(units) == len(heads) else [""] * len(heads)
    of = {head: parse_header(head)[1] or unit for head, unit in zip(heads, stated, strict=True)}
    columns = {head: np.ascontiguousarray(table[:, i]) for i, head in enumerate(heads)}
    return {head: Variable(head, x.shape, ROWS, x.copy, of[head]) for head, x in columns.items()}


def _vet_table(file: str, heads: list[str], fields: list[int], apart: str) -> None:
    """Raise RecordError if rows differ in length. fields: their number in each row."""
    if not fields:
        raise RecordError(f"{file}: holds no numbers below its header")
    if twice := next((h for h in heads if heads.count(h) > 1), None):
        raise RecordError(f"{file}: two columns have the name '{twice}'")
    for row, count in enumerate(fields):
        if count == len(heads):
            continue
        hint = "; decimal commas need ';' between the fields" if apart == "," else ""
        raise RecordError(f"{file}: row {row + 1} has {count} fields, the header has {len(heads)}{hint}")


def _decode(raw: bytes) -> str:
    """Return the text of UTF-8 bytes, else as Windows writes text in western Europe."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")
