"""Layout of a text table: the line with the names, the separator, and the statements above."""

import csv
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from checks.errors import RecordError
from hw.records.text.numbers import is_clock, is_like_number, is_number
from specs.units import UnitMismatch, factor, is_unit, parse_column, parse_header

NUMBERS, CLOCK, EMPTY, TEXT = "numbers", "times", "empty", "text"  # kinds of columns
_TIMES = ("t", "time", "zeit", "timestamp")
TIMES = (*_TIMES, *(f"{name}_{unit}" for name in _TIMES for unit in ("s", "ms", "us")))  # names of times, in lower case
_WINDOW = 200  # lines in which the layout is looked for
_COMMENT = re.compile(r"^\s*(?:[#%]+|//)\s*")
_UNIT_AT_END = re.compile(r"_(?P<unit>nm|um|µm|mm|us|µs|ms|mV|kV|Hz|kHz|kN|mN)$")
_TIME_AT_END = re.compile(r"^(?:t|time|zeit|timestamp)_(?P<unit>s)$", re.IGNORECASE)
_SPELLED = re.compile(
    r"(?:milli|micro|nano|kilo)?(?:volt|met(?:er|re)|newton|second|sec|hertz)s?|m/s[\^*]*2|m/s²|[mk]?A|[kM]?Pa"
    r"|K|°C|dB|g|rpm",
    re.IGNORECASE,
)
_CLOCK_FORM = re.compile(r"[hHmsdDyYMSf:.,/ T-]+")
_STATEMENT = re.compile(r"^(?P<key>[^:=;,\t]*[^\s:=;,])\s*[:=;,\t]+\s*(?P<value>.*?)[\s;,]*$")
_SCALING = re.compile(
    r"scal|skal|gain|factor|faktor|offset|sensitiv|empfindl|multipl|calib|kalib|verst|slope|steigung", re.IGNORECASE
)
_FORM = re.compile(r"invert|polarity|polarit|decimal|dezimal|thousand|tausend", re.IGNORECASE)
_UNIT = re.compile(r"\bunits?\b|einheit", re.IGNORECASE)
_SAMPLING = r"(?:sampl\w*|abtast\w*|scan|time)[ _-]*"
_RATE = re.compile(_SAMPLING + r"(?:rate|freq\w*)|(?:abtast|sampling)(?:rate|freq\w*)|fs|f_s|rate", re.IGNORECASE)
_STEP = re.compile(
    _SAMPLING + r"(?:interval\w*|period\w*|time|step|increment|zeit)|abtast(?:zeit|intervall)|ts|dt|delta[ _]?[tx]"
    r"|interval|increment",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Layout:
    """The layout of a text file. heads: the named columns, as written; units, kinds of each; columns: their places in a
    row; width: fields of the header; header, first: index of its line and of the first row; apart: between the fields,
    " " for any blanks; decimal: the mark that the file states; clock: start and step [s] that it states in place of a
    time column; commented: fields beyond `width` are comments; samples: rows that it states; remarks: in words."""

    heads: tuple[str, ...]
    units: tuple[str, ...]
    kinds: tuple[str, ...]
    columns: tuple[int, ...]
    width: int
    header: int
    first: int
    apart: str
    decimal: str = ""
    clock: tuple[float, float] | None = None
    commented: bool = False
    samples: int = 0
    remarks: tuple[str, ...] = ()


Line = tuple[int, str]


def split(line: str, apart: str) -> list[str]:
    """Return the fields of a line without blanks and quotes around them."""
    if apart == " ":
        return line.split()
    if '"' in line:
        try:
            line_of_one = csv.reader([line], delimiter=apart, skipinitialspace=True, strict=True)
            return [each.strip() for each in next(line_of_one)]
        except csv.Error:  # a quote that is not closed, a field of 100,000 characters
            pass
    return [each.strip() for each in line.split(apart)]


def find_layout(file: str, lines: Sequence[str]) -> Layout:
    """Return the layout. Raises RecordError without a header, or if a line above changes the numbers and is not
    used."""
    shown: list[Line] = []
    rows = 0
    for i, line in enumerate(lines):
        if line.strip():
            shown.append((i, line))
            rows += _COMMENT.match(line) is None
        if rows > _WINDOW or len(shown) > 10 * _WINDOW:
            break
    if not shown:
        raise RecordError(f"{file}: is blank; expected the names of the columns in the first line")
    stated = ""
    bare = shown[0][1].strip(' "').lower()
    if bare.startswith("sep="):  # as spreadsheets write it
        stated = shown[0][1].strip(' "')[4:5] or "\t"
        shown = shown[1:]
        if not shown:
            raise RecordError(f"{file}: holds no rows below its first line")
    found = _best(shown, stated) or _only_first(file, shown, stated)
    above = [line for line in shown if line[0] < found.header]
    return _with_statements(file, found, above, shown)


def _best(shown: Sequence[Line], stated: str) -> Layout | None:
    """Return the layout whose header fits best: all rows below are numbers; else all rows fit; else the next."""
    partly: list[tuple[int, Layout]] = []
    for k in range(len(shown) - 1):
        for apart in [stated] if stated else _separators(shown[k][1]):
            rank, layout = _under(shown, k, apart)
            if rank == 3:
                return layout
            if layout is not None:
                partly.append((rank, layout))
    return max(partly, key=lambda each: each[0])[1] if partly else None


def _separators(line: str) -> list[str]:
    return [c for c in (";", "\t", ",") if c in line] + ([" "] if " " in line.strip() else []) + [","]


def _names(line: str, apart: str) -> list[str]:
    """Return the names in a header, the marks of a comment left out."""
    line = unicodedata.normalize("NFC", line)
    without = _COMMENT.sub("", line)
    if apart == " ":
        return [name.strip('"') for name in re.split(r"\s+(?![\[(])", without.strip())]
    names = split(without, apart)
    return names if names and names[0] else split(line, apart)


def _under(shown: Sequence[Line], k: int, apart: str) -> tuple[int, Layout | None]:
    """Return the layout with line k as the header, and its rank: 3 if all rows are numbers, 2 if every row fits and the
    first has a number, 1 if the first row fits and is numbers, 0 without a layout."""
    names = _names(shown[k][1], apart)
    named = [i for i, name in enumerate(names) if name]
    if not named or any(is_number(names[i]) or is_clock(names[i]) for i in named):
        return 0, None
    rows = [split(line, apart) for _, line in shown[k + 1 :]]
    below = _units_below(rows, named)
    data = rows[1:] if below else rows
    if not data or not _fits(data[0], named) or not any(_is_value(data[0][i]) for i in named):
        return 0, None
    numeric = [_fits(row, named) and all(_is_value(row[i]) or not row[i] for i in named) for row in data]
    rank = 3 if all(numeric) else 2 if all(_fits(row, named) for row in data) else 1 if numeric[0] else 0
    if not rank:
        return 0, None
    units = tuple(below[i].strip(' "[]()') if below else "" for i in named)
    kinds = tuple(_kind([row[i] for row in data if len(row) > i]) for i in named)
    heads = tuple(names[i] for i in named)
    first = shown[k + 1 + bool(below)][0]
    return rank, Layout(heads, units, kinds, tuple(named), len(names), shown[k][0], first, apart)


def _units_below(rows: Sequence[Sequence[str]], named: Sequence[int]) -> Sequence[str]:
    """Return the row of units between the header and the numbers; empty without one."""
    if len(rows) < 2 or not _fits(rows[0], named) or any(_is_value(each) for each in rows[0]) or not any(rows[0]):
        return ()
    given = [each.strip("[]() ") for each in rows[0] if each]
    if 2 * sum(map(_is_unit_word, given)) < len(given):
        return ()
    return rows[0] if _fits(rows[1], named) and all(_is_value(rows[1][i]) or not rows[1][i] for i in named) else ()


def _fits(row: Sequence[str], named: Sequence[int]) -> bool:
    """Return whether a row has all named columns and no value in another one."""
    return len(row) > named[-1] and {i for i, each in enumerate(row) if each} <= set(named)


def _is_value(text: str) -> bool:
    return is_number(text) or is_clock(text)


def _kind(fields: Sequence[str]) -> str:
    """Return the kind of a column by its first rows. A column partly of text, or of numbers in another form, counts as
    numbers, so that its wrong field is named."""
    given = [each for each in fields if each]
    if not given:
        return EMPTY
    if is_clock(given[0]):
        return CLOCK
    numbers = sum(is_like_number(each) for each in given)
    return NUMBERS if 2 * numbers >= len(given) else TEXT


def _only_first(file: str, shown: Sequence[Line], stated: str) -> Layout:
    """Return the layout with the first line as header, of a table in which no row fits. Raises RecordError if that line
    has no names."""
    at, line = shown[0]
    apart = stated or _separators(line)[0]
    names = _names(line, apart)
    wrong = next((name for name in names if is_number(name) or is_clock(name)), None)
    if wrong is not None or not any(names):
        raise RecordError(
            f"{file}: no header: line {at + 1} does not name the columns: names are expected above the numbers; it "
            f"holds '{line.strip()[:60]}'"
        )
    if len(shown) == 1:
        raise RecordError(f"{file}: holds a header and no rows")
    row = split(shown[1][1], apart)
    if len(row) != len(names):
        halves = any(a.lstrip("+-").isdecimal() and b.isdecimal() for a, b in pairwise(row))
        if all(map(is_number, row)) or (len(row) > len(names) > 1 and halves):
            raise RecordError(wrong_count(file, shown[1][0] + 1, 1, len(row), len(names), apart))
        raise RecordError(
            f"{file}: line {at + 1} does not name the columns: a name for each is expected above the numbers; it holds "
            f"'{line.strip()[:60]}', line {shown[1][0] + 1} '{shown[1][1].strip()[:60]}'"
        )
    named = tuple(i for i, name in enumerate(names) if name)
    none = ("",) * len(named)
    kinds = (NUMBERS,) * len(named)
    return Layout(tuple(names[i] for i in named), none, kinds, named, len(names), at, shown[1][0], apart)


def wrong_count(file: str, line: int, row: int, found: int, wanted: int, apart: str) -> str:
    """Return in words that a row has another number of fields than the header."""
    hint = "; decimal commas need ';' between the fields" if apart == "," and found > wanted else ""
    return f"{file}: line {line}: row {row} has {found} fields, the header has {wanted}{hint}"


def _with_statements(file: str, found: Layout, above: Sequence[Line], shown: Sequence[Line]) -> Layout:
    """Return the layout with its units and the statements of the lines above the header."""
    line = found.header + 1
    twice = next((head for head, count in Counter(found.heads).items() if count > 1), None)
    if twice is not None:
        raise RecordError(f"{file}: line {line}: two columns have the name '{twice}'; give each its own")
    heads = zip(found.heads, found.units, found.kinds, strict=True)
    units = tuple(_unit(file, line, head, below, kind) for head, below, kind in heads)
    remarks = list(found.remarks)
    if len(found.columns) < found.width:
        remarks.append(f"columns without name and values are left out ({found.width - len(found.columns)})")
    for head, kind in zip(found.heads, found.kinds, strict=True):
        if kind == CLOCK:
            remarks.append(f"column '{head}' holds times of day, taken as seconds after its first row")
    found = replace(found, units=units)
    for at, text in above:
        fields = re.split(r"[;,\t ]+", text.strip(";,\t "))
        if len(fields) > 1 and all(map(is_number, fields)):
            names = ", ".join(found.heads[:4])
            raise RecordError(
                f"{file}: line {at + 1} holds numbers, above the names in line {line} ({names}): are these two tables? "
                "Write one file for each"
            )
        words = _COMMENT.sub("", text).strip(' ";,\t')
        statement = _STATEMENT.match(words)
        if statement is None:
            continue
        if _changes_numbers(statement["key"], statement["value"]):
            raise RecordError(
                f"{file}: line {at + 1} states '{words[:60]}', which is not used: write it into the numbers or, as "
                "'de [nm]', into the header, and delete the line"
            )
        step = _step(statement["key"], statement["value"])
        if step is not None:
            found = _clocked(file, found, f"line {at + 1} states '{words[:60]}'", step, shown)
    if above:
        lines = f"line {above[0][0] + 1}" if len(above) == 1 else f"lines {above[0][0] + 1} to {above[-1][0] + 1}"
        remarks.append(f"{lines} above the names left out ('{above[0][1].strip()[:40]}')")
    return replace(found, remarks=(*remarks, *found.remarks))


def _changes_numbers(key: str, value: str) -> bool:
    """Return whether a statement changes the meaning of the numbers: a factor or an offset, a form, a unit."""
    words = [each.strip("x×*%[]()") for each in re.split(r"[;,\t ]+", value) if each]
    if _SCALING.search(key) and words and is_number(words[0]):
        return True
    return bool(_FORM.search(key) or (_UNIT.search(key) and any(map(_is_unit_word, words))))


def _is_unit_word(text: str) -> bool:
    return is_unit(text) or _SPELLED.fullmatch(text) is not None


def _unit(file: str, line: int, head: str, below: str, kind: str) -> str:
    """Return a column's unit by header, the row below and the end of its name. Raises RecordError if two differ."""
    name, unit = parse_column(head)
    end = _UNIT_AT_END.search(name) or _TIME_AT_END.search(name)
    if below and unit and head.endswith(")") and not is_unit(unit):
        unit = ""  # a word in parentheses, the unit below it
    stated = [each for each in (unit, below, end["unit"] if end else "") if each]
    if kind == CLOCK:
        return "s" if all(_CLOCK_FORM.fullmatch(each) for each in stated) else stated[0]
    for other in stated[1:]:
        try:
            same = factor(stated[0], other) == 1.0
        except UnitMismatch:
            same = False
        if not same:
            bare = name[: end.start("unit") - 1] if end else name
            words = f"{file}: line {line}: column '{head}' states two units, {stated[0]} and {other}"
            raise RecordError(f"{words}: which is right? Write '{bare} [{stated[0]}]' or '{bare} [{other}]'")
    return stated[0] if stated else ""


def _step(key: str, value: str) -> float | None:
    """Return the sampling time [s] in a line, None without one."""
    number, _, unit = value.partition(" ")
    key, of_key = parse_header(key)
    unit = (unit or of_key).strip("[]() ")
    rate = _RATE.fullmatch(key) is not None
    if not (rate or _STEP.fullmatch(key)) or not is_number(number):
        return None
    if rate and unit.lower() in ("", "s/s", "sa/s", "samples/s", "1/s"):
        unit = "Hz"
    try:
        x = float(number.replace(",", ".")) * factor(unit or "s", "Hz" if rate else "s")
    except UnitMismatch:
        return None
    return (1.0 / x if rate else x) if x > 0.0 else None


def _clocked(file: str, found: Layout, words: str, step: float, shown: Sequence[Line]) -> Layout:
    """Return the layout with a stated sampling time if it has no column of times. Raises RecordError if such a column
    has another step."""
    names = [parse_column(head)[0].lower() for head in found.heads]
    at = next((i for i, name in enumerate(names) if name in TIMES), None)
    if at is None:
        return replace(found, clock=(0.0, step), remarks=(*found.remarks, f"time by the sampling time: {words}"))
    rows = [split(line, found.apart) for i, line in shown if i >= found.first][:2]
    if found.kinds[at] != NUMBERS or len(rows) < 2:
        return found
    texts = [row[found.columns[at]] for row in rows]
    if not all(map(is_number, texts)):
        return found  # said where the rows are read
    t = [float(text.replace(",", ".")) for text in texts]
    try:
        own = (t[1] - t[0]) * factor(found.units[at] or "s", "s")
    except UnitMismatch:
        return found
    if not abs(own - step) <= 0.01 * step:
        steps = f"a sampling time of {step:.6g} s, but column '{found.heads[at]}' has steps of {own:.6g} s"
        raise RecordError(
            f"{file}: {words}, {steps}: which is right? Label the column's unit, as 't [ms]', or correct the line"
        )
    return found
