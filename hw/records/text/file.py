"""Tables in text files, the one reader for records, tables, responses and gauge studies. Stated encoding, separator,
decimal mark, units and times are used, or the file is refused with line and column.

Accepted are UTF-8, UTF-16 with its mark and Windows-1252; fields separated by comma, `;`, tab or blanks; decimal commas
except with the comma as separator; lines above the names (`sep=;`, comments, the header of LabVIEW); a row of units
below them."""

import codecs
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.contents.variable import Remarked, Variable
from hw.records.text.labview import MAGIC, lvm_layout
from hw.records.text.layout import CLOCK, EMPTY, NUMBERS, TEXT, TIMES, Layout, find_layout, split, wrong_count
from hw.records.text.numbers import Row, is_date, is_number, parse, seconds, vet_marks
from specs.units import UnitMismatch, factor, parse_column

SUFFIXES = (".csv", ".txt", ".dat", ".tsv", ".lvm", ".asc")
ROWS = "rows"  # kind of a column
_AS_UTF8 = "save it as UTF-8"
_LIKE = 1000  # rows before the last that it is compared with


def open_csv(file: str, raw: bytes) -> Remarked[Variable]:
    """Return the columns of a text file by name, or by whole header if two share a name (`de [nm]` and `de [um]`).
    Raises RecordError."""
    table = read_text(file, raw)
    names = [parse_column(head)[0] for head in table.layout.heads]
    if len(set(names)) < len(names):
        names = list(table.layout.heads)
    return _variables(table, names)


def open_columns(file: str, raw: bytes) -> Remarked[Variable]:
    """Return the columns of a text file by whole header; a last line without end gives a remark. Raises RecordError."""
    table = read_text(file, raw, open_end=True)
    return _variables(table, table.layout.heads)


def _variables(table: "TextTable", names: Sequence[str]) -> Remarked[Variable]:
    layout, count = table.layout, len(table.rows)
    wanted = [i for i, kind in enumerate(layout.kinds) if kind in (NUMBERS, CLOCK)]
    values = cache(lambda: dict(zip(wanted, table.numbers(wanted), strict=True)))

    def variable(i: int) -> Variable:
        if layout.kinds[i] in (TEXT, EMPTY):
            return Variable(names[i], (count,), table.what_kind(i))
        return Variable(names[i], (count,), ROWS, lambda: values()[i], layout.units[i])

    found = [variable(i) for i in range(len(names))]
    if layout.clock is not None:
        start, step = layout.clock
        found.append(Variable("t", (count,), ROWS, lambda: start + step * np.arange(count, dtype=np.float64), "s"))
    left = [f"column '{v.name}' holds {v.kind} and is left out" for v in found if v.load is None]
    return Remarked({v.name: v for v in found}, (*layout.remarks, *left))


@dataclass(frozen=True, eq=False)
class TextTable:
    """A table as text. rows: its lines that are not blank, below the header; blank: index of the blank lines among
    them; plain: whether no field is quoted and no row ends with a separator."""

    file: str
    layout: Layout
    rows: list[str]
    blank: tuple[int, ...]
    plain: bool

    def fields(self) -> Iterator[Row]:
        """Yield the line and the fields of each row. Raises RecordError if a row does not fit the header."""
        layout = self.layout
        line, blank, last = layout.first + 1, set(self.blank), layout.columns[-1]
        unnamed = set(range(layout.width)) - set(layout.columns)
        for k, row in enumerate(self.rows):
            while line - 1 in blank:
                line += 1
            fields = split(row, layout.apart)
            beyond = [] if layout.commented else fields[layout.width :]
            if len(fields) <= last or any(beyond):
                raise RecordError(wrong_count(self.file, line, k + 1, len(fields), layout.width, layout.apart))
            wrong = next((i for i in unnamed if i < len(fields) and fields[i]), None)
            if wrong is not None:
                words = f"{self.file}: line {line} holds '{fields[wrong]}' in column {wrong + 1}"
                raise RecordError(f"{words}, which line {layout.header + 1} does not name; name it or delete it")
            yield line, fields
            line += 1

    def texts(self, column: int) -> list[str]:
        """Return the fields of a column as written, letters with their accents as one character."""
        place = self.layout.columns[column]
        return [unicodedata.normalize("NFC", fields[place]) for _, fields in self.fields()]

    def what_kind(self, column: int) -> str:
        """Return the kind of a column without numbers, in words."""
        if self.layout.kinds[column] == EMPTY:
            return "no values"
        first = split(self.rows[0], self.layout.apart)[self.layout.columns[column]][:40]
        if is_date(first):
            return f"dates ('{first}', not YYYY-MM-DD HH:MM:SS; without them give the sampling time)"
        return f"text ('{first}')"

    def numbers(self, wanted: Sequence[int]) -> list[Array]:
        """Return the values (N,) of columns. Raises RecordError with line and column for a field that is not a number,
        or if two columns of times differ."""
        layout = self.layout
        if set(map(layout.kinds.__getitem__, wanted)) & {NUMBERS}:
            self._vet_marks([i for i, kind in enumerate(layout.kinds) if kind == NUMBERS], wanted)
        if list(wanted) == list(range(layout.width)) and set(layout.kinds) == {NUMBERS} and self.plain:
            found = list(self._parsed(self.rows, layout.apart, wanted))
        else:
            found = self._by_field(wanted)
        self._vet_times(wanted, found)
        return found

    def _by_field(self, wanted: Sequence[int]) -> list[Array]:
        """Return columns of a table that also has others, quotes, or times of day. A file of half a gigabyte is read
        once for its numbers and once for each column of times: as fields it would take ten times its size."""
        layout = self.layout
        timed = [i for i in wanted if layout.kinds[i] == CLOCK]
        numeric = [i for i in wanted if i not in timed]
        places = [layout.columns[i] for i in numeric]
        empty = [i for i, kind in enumerate(layout.kinds) if kind == EMPTY and i not in wanted]
        lines = []
        for line, fields in self.fields():
            for i in empty:
                if value := fields[layout.columns[i]]:
                    words = f"{self.file}: line {line}: column '{layout.heads[i]}' holds '{value}' and is empty above"
                    raise RecordError(f"{words}; fill it or delete it")
            lines.append("\t".join([fields[place].replace("\t", " ") or "?" for place in places]))
        found = dict(zip(numeric, self._parsed(lines, "\t", numeric), strict=True)) if numeric else {}
        for i in timed:
            place = layout.columns[i]
            found[i] = seconds(self.file, layout.heads[i], ((line, fields[place]) for line, fields in self.fields()))
        return [found[i] for i in wanted]

    def _parsed(self, rows: list[str], apart: str, wanted: Sequence[int]) -> Array:
        names = [self.layout.heads[i] for i in wanted]
        places = [self.layout.columns[i] for i in wanted]

        def listed() -> Iterator[Row]:
            for line, fields in self.fields():
                yield line, [fields[i] for i in places]

        return parse(self.file, rows, apart, self.layout.decimal, names, listed)

    def _vet_marks(self, numeric: Sequence[int], wanted: Sequence[int]) -> None:
        """Raise RecordError if columns that are not wanted have another decimal mark than those that are."""
        if set(numeric) <= set(wanted):
            return  # the reader of the numbers sees all
        places = [self.layout.columns[i] for i in numeric]
        rows = ((line, [row[i] if is_number(row[i]) else "" for i in places]) for line, row in self.fields())
        vet_marks(self.file, [self.layout.heads[i] for i in numeric], rows)

    def _vet_times(self, wanted: Sequence[int], table: Sequence[Array]) -> None:
        """Raise RecordError if two columns of times run apart."""
        units, first = self.layout.units, None
        for k, i in enumerate(wanted):
            head = self.layout.heads[i]
            name = parse_column(head)[0]
            if name.lower() not in TIMES or (name == "T" and first is not None):  # beside a time a temperature
                continue
            try:
                t = (table[k] - table[k][0]) * factor(units[i] or "s", "s")
            except UnitMismatch:
                continue  # said where the time is converted
            if first is None:
                first = head, t
            elif not np.allclose(t, first[1], rtol=1e-6, atol=1e-9):
                raise RecordError(f"{self.file}: columns '{first[0]}' and '{head}' are two times that differ; keep one")


def read_text(file: str, raw: bytes, open_end: bool = False) -> TextTable:
    """Return the table of a text file. open_end: read a last line without end, with a remark. Raises RecordError."""
    text = decode(file, raw)
    lines = text.split("\n")
    whole = lines[-1] == ""
    if whole:
        lines.pop()
    layout = lvm_layout(file, lines) if lines and lines[0].startswith(MAGIC) else find_layout(file, lines)
    end = len(lines)
    empty = f' "\t{layout.apart}'  # a spreadsheet writes rows without values
    while end > layout.first and not lines[end - 1].strip(empty):
        end -= 1
    body = lines[layout.first : end]
    blank: tuple[int, ...] = ()
    rows = body
    if not all(map(str.strip, body)):
        blank = tuple(layout.first + i for i, line in enumerate(body) if not line.strip())
        rows = [line for line in body if line.strip()]
    if not rows:
        raise RecordError(f"{file}: holds a header and no rows")
    start = sum(len(line) + 1 for line in lines[: layout.first])
    marked = any(text.find(mark, start) >= 0 for mark in ('"', f"{layout.apart}\n"))
    plain = not (layout.commented or marked or text.endswith(layout.apart))
    table = TextTable(file, layout, rows, blank, plain)
    if len(rows) < layout.samples:
        raise RecordError(f"{file}: states {layout.samples} samples and has {len(rows)} rows; copy the file again")
    if not whole and end == len(lines) and len(split(rows[-1], layout.apart)) <= layout.columns[-1]:
        raise RecordError(f"{file}: its last line ({end}) is cut: '{rows[-1].strip()[:60]}'; copy the file again")
    remarks = [f"rows without values at its end are left out ({len(lines) - end})"] if end < len(lines) else []
    if not whole and end == len(lines) and _may_be_cut(table):
        words = f"its last line ({end}) has no end, so its last number '{split(rows[-1], layout.apart)[-1]}' may be cut"
        if not open_end:
            raise RecordError(f"{file}: {words}; if the file is whole, add a newline at its end")
        remarks.append(words)
    return replace(table, layout=replace(layout, remarks=(*layout.remarks, *remarks)))


def decode(file: str, raw: bytes) -> str:
    """Return the text, newlines between its lines. Raises RecordError that names an encoding that is not read."""
    if raw.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        raise RecordError(f"{file}: is UTF-32; {_AS_UTF8}")
    try:
        if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            text = raw.decode("utf-16")
        elif b"\0" in raw:
            raise RecordError(f"{file}: {_with_zeros(raw)}")
        else:
            text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as e:
        if e.encoding.startswith("utf-16"):
            raise RecordError(f"{file}: is UTF-16 and breaks off or is damaged at byte {e.start}; copy it again") from e
        text = _windows(file, raw)
    if "\0" in text:
        raise RecordError(f"{file}: is not text: character {text.index(chr(0)) + 1} is zero")
    text = text.rstrip("\x1a")  # DOS ends a file so
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def _with_zeros(raw: bytes) -> str:
    """Return in words the likely kind of bytes with zeros among them."""
    head = raw[:400]
    for step, name in ((4, "UTF-32"), (2, "UTF-16")):
        zeros = [head[i::step].count(0) * step >= 0.9 * len(head) for i in range(step)]
        if sum(zeros) == step - 1:
            return f"is {name} without its mark (BOM); {_AS_UTF8}"
    return f"is not text: byte {raw.index(0) + 1} is zero"


def _windows(file: str, raw: bytes) -> str:
    """Return the text as Windows writes it in western Europe. Raises RecordError."""
    try:
        return raw.decode("cp1252")
    except UnicodeDecodeError as e:
        raise RecordError(
            f"{file}: is neither UTF-8 nor Windows-1252 (byte {e.start + 1} is 0x{raw[e.start]:02x}); {_AS_UTF8}"
        ) from e


def _may_be_cut(table: TextTable) -> bool:
    """Return whether the last number of a line without end may be cut: "-15.5" becomes "-1", still a number. It is
    whole with the same decimals as all before it."""
    layout = table.layout
    if table.rows[-1].rstrip().endswith(('"', layout.apart)) or layout.kinds[-1] == TEXT:
        return False
    ends = [_decimals(split(row, layout.apart)[-1]) for row in table.rows[-_LIKE:]]
    return len(ends) < 3 or len(set(ends)) > 1 or ends[0] == (0, 0)


def _decimals(number: str) -> tuple[int, int]:
    """Return the digits behind the decimal mark and those of the exponent."""
    mantissa, _, exponent = number.lower().partition("e")
    return len(mantissa.replace(",", ".").partition(".")[2]), len(exponent.lstrip("+-"))
