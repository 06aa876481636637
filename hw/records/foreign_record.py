"""Tables of other tools: units in headers or below them, `;` and decimal commas."""

import io
import re
from dataclasses import replace

import numpy as np

from checks.errors import RecordError
from hw.records.source import Source
from hw.records.textfile import ROWS
from hw.records.variable import Variable, unique
from specs.units import parse_header

_DIGIT = re.compile(r"\d")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
TEXT = (".csv", ".txt", ".dat")


def variables_of(source: Source) -> dict[str, Variable]:
    """Return the variables of a file, of a table those of other tools too. Raises RecordError."""
    if not source.is_text:
        return source.variables()
    found = columns_of(source)
    names = [parse_header(name)[0] for name in found]
    if len(set(names)) < len(names):
        return found
    return unique(source.file, [replace(v, name=n) for n, v in zip(names, found.values(), strict=True)])


def columns_of(source: Source) -> dict[str, Variable]:
    """Return the columns of a table by their whole headers. Raises RecordError."""
    return _text(source)


def _text(source: Source) -> dict[str, Variable]:
    """Return a table with one header line, and maybe a line of units below it; fields apart by `;`, tab or comma; with
    `;` or tab also decimal commas."""
    if b"\0" in source.raw:
        raise RecordError(f"{source.file}: is not text")
    lines = [line for line in _decode(source.raw).splitlines() if line.strip()]
    if len(lines) < 2:
        raise RecordError(f"{source.file}: holds no rows below a header")
    apart = next((c for c in (";", "\t") if c in lines[0]), ",")
    second = [field.strip(' "[]()') for field in lines[1].split(apart)]
    units = second if not any(map(_DIGIT.search, second)) else []
    body = lines[2:] if units else lines[1:]
    rows = body if apart == "," else [_DECIMAL_COMMA.sub(".", line) for line in body]
    heads = [h.strip().strip('"') for h in lines[0].split(apart)]
    _vet_table(source.file, heads, [row.count(apart) + 1 for row in rows], apart)
    try:
        table = np.loadtxt(io.StringIO("\n".join(rows)), delimiter=apart, comments=None, ndmin=2)
    except ValueError as e:
        raise RecordError(f"{source.file}: {e}") from e
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
