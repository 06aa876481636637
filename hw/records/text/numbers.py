"""Numbers and times of day as text: the decimal mark of a table, and the fault of a field that is not a number."""

import re
from collections.abc import Callable, Iterable, Sequence
from datetime import date
from itertools import islice
from typing import NoReturn

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError

_NUMBER = re.compile(r"[+-]?(?:(?:\d+[.,]?\d*|[.,]\d+)(?:e[+-]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_CLOCK = re.compile(
    r"(?:(?P<year>\d{4})([-/])(?P<month>\d\d?)\2(?P<day>\d\d?)[T ]\s*)?(?P<h>\d\d?):(?P<m>\d\d):(?P<s>\d\d)"
    r"(?:[.,](?P<part>\d{1,18}))?(?P<zone>Z|[+-]\d\d:?\d\d)?"
)
_DATE_LIKE = re.compile(r"\d{1,4}([./-])\d\d?\1\d{1,4}\b|\d\d?:\d\d")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_SPACED = re.compile(r"[+-]?\d{1,3}(?:[ '_\u00a0\u2009\u202f\u2019]\d{3})+(?:[.,]\d*)?")
_POINTED = re.compile(r"[+-]?\d{1,3}(?:[.,]\d{3})+(?:[.,]\d*)?")
_DIGITS = re.compile(r"[+\u2212\u2013-]?\d+(?:[ .,'_\u00a0\u2009\u202f\u2019]\d+)*")
WITHOUT = "write the numbers without thousands marks"
Row = tuple[int, Sequence[str]]  # line of the file, its fields
Fields = Callable[[], Iterable[Row]]
_SCANNED = 20_000  # rows in which thousands marks are looked for


def is_number(field: str) -> bool:
    """Return whether a field is a number with at most one mark, a point or a comma."""
    return _NUMBER.fullmatch(field) is not None


def is_like_number(field: str) -> bool:
    """Return whether a field is a number, maybe with thousands marks or another sign."""
    return is_number(field) or _DIGITS.fullmatch(field) is not None


def is_date(field: str) -> bool:
    """Return whether a field looks like a date or a time of day of any form."""
    return _DATE_LIKE.match(field) is not None


def is_clock(field: str) -> bool:
    """Return whether a field is a time of day, maybe below a date with the year in front."""
    return _CLOCK.fullmatch(field) is not None


def parse(file: str, rows: Sequence[str], apart: str, decimal: str, names: Sequence[str], fields: Fields) -> Array:
    """Return (columns, rows) of rows in which all fields are numbers. apart: between the fields, " " for any blanks;
    decimal: the mark that the file states, "" if it states none; fields: of the same rows, for messages.

    A comma in a field is the decimal mark if no field has a point. Raises RecordError with line and column."""
    if apart != ",":
        comma, point = (any(mark in row for row in rows) for mark in ",.")
        if (comma and point) or (decimal == "," and point) or (decimal == "." and comma):
            _raise_two_marks(file, decimal, names, fields)
        if comma:
            rows = [row.replace(",", ".") for row in rows]
    try:
        table = np.loadtxt(rows, delimiter=None if apart == " " else apart, comments=None, ndmin=2)
    except ValueError:
        raise_first_wrong(file, names, fields)
    if table.shape[1] != len(names):
        raise_first_wrong(file, names, fields)
    _refuse_groups(file, table, names, fields)
    return np.ascontiguousarray(table.T)


def _raise_two_marks(file: str, decimal: str, names: Sequence[str], fields: Fields) -> NoReturn:
    for line, row in fields():
        for name, field in zip(names, row, strict=False):
            marks = [mark for mark in ".," if mark in field]
            where = f"line {line} holds '{field}' in column '{name}'"
            if len(marks) == 2:
                raise RecordError(f"{file}: {where}: {WITHOUT}")
            if marks and decimal and marks[0] != decimal:
                raise RecordError(f"{file}: {where}, and the file states '{decimal}' as its decimal mark")
    vet_marks(file, names, fields())
    raise RecordError(f"{file}: its decimal mark is not clear: {WITHOUT}")


def vet_marks(file: str, names: Sequence[str], fields: Iterable[Row]) -> None:
    """Raise RecordError, with the lines, if some fields have a point and others a comma."""
    first: dict[str, str] = {}
    for line, row in fields:
        for name, field in zip(names, row, strict=False):
            for mark in (mark for mark in ".," if mark in field):
                first.setdefault(mark, f"line {line} holds '{field}' in column '{name}'")
        if len(first) == 2:
            raise RecordError(f"{file}: {', '.join(first.values())}: which mark is the decimal one? {WITHOUT}")


def _refuse_groups(file: str, table: Array, names: Sequence[str], fields: Fields) -> None:
    """Raise RecordError if a column can be meant in thousands: 998, 999, 1.000, 1.001 without any other decimals."""
    with np.errstate(all="ignore"):
        thousandths = table[:1000] * 1000.0
        near = np.abs(thousandths - np.round(thousandths)) < 1e-6
        whole = np.all(near & (np.abs(table[:1000]) < 1000.0), axis=0).tolist()
        suspects = [i for i in range(len(names)) if whole[i] and (table[:, i] % 1.0 != 0.0).any()]
    for i in suspects:
        plain: dict[bool, str] = {}
        for line, row in islice(fields(), _SCANNED):
            field = row[i]
            if "." not in field and "," not in field:
                if field.strip("+-0"):
                    plain.setdefault(False, f"line {line} holds '{field}'")
            elif _GROUPED.fullmatch(field):
                plain.setdefault(True, f"line {line} holds '{field}'")
            else:
                break
        else:
            if len(plain) == 2:
                raise RecordError(
                    f"{file}: column '{names[i]}': {', '.join(plain.values())}: thousands or decimals? {WITHOUT}, or "
                    "give every number its decimals"
                )


def raise_first_wrong(file: str, names: Sequence[str], fields: Fields) -> NoReturn:
    """Raise RecordError for the first field that is no number."""
    for line, row in fields():
        for name, field in zip(names, row, strict=False):
            if not is_number(field):
                raise RecordError(f"{file}: line {line}: column '{name}' holds '{field}', {_expected(field)}")
    raise RecordError(f"{file}: its columns cannot be read as numbers")


def _expected(field: str) -> str:
    """Return the expected form of a field that is not a number, and the remedy."""
    if _SPACED.fullmatch(field) or _POINTED.fullmatch(field):
        return f"expected a number: {WITHOUT}"
    if is_date(field):
        return "a date or a time of day; expected seconds or YYYY-MM-DD HH:MM:SS.fff in every row"
    if field.startswith(("\u2212", "\u2013")):
        return "expected a number: write '-' for its sign"
    return "expected a number"


def seconds(file: str, name: str, fields: Iterable[tuple[int, str]]) -> Array:
    """Return times of day, or dates, as seconds after the first. Raises RecordError for a field of another form."""
    out: list[float] = []
    first: tuple[int, bool, bool] | None = None  # ns; whether with a date, with a zone
    for line, field in fields:
        found = _CLOCK.fullmatch(field)
        now = None if found is None else _nanoseconds(found)
        if now is None or (first is not None and now[1:] != first[1:]):
            raise RecordError(
                f"{file}: line {line}: column '{name}' holds '{field}', expected a time of the form of the first row"
            )
        first = first or now
        out.append((now[0] - first[0]) * 1e-9)
    return np.array(out)


def _nanoseconds(found: re.Match[str]) -> tuple[int, bool, bool] | None:
    h, m, s = (int(found[key]) for key in "hms")
    try:
        days = date(*(int(found[key]) for key in ("year", "month", "day"))).toordinal() if found["year"] else 0
    except ValueError:
        return None
    if h > 23 or m > 59 or s > 60:
        return None
    zone = (found["zone"] or "Z").replace(":", "")
    ahead = 0 if zone == "Z" else (1 if zone[0] == "+" else -1) * (int(zone[1:3]) * 60 + int(zone[3:5]))
    total = ((days * 24 + h) * 60 + m - ahead) * 60 + s
    return total * 10**9 + int((found["part"] or "0").ljust(9, "0")[:9]), bool(found["year"]), bool(found["zone"])
