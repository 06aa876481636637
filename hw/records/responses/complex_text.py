"""Tables with complex numbers as text: `2e-6-3e-10j`, `(2e-6+3e-10i)`, `(1e0+-2e0j)` of numpy."""

import re
from dataclasses import replace

from checks.errors import RecordError
from hw.records.source import Source

_SIZE = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
COMPLEX = re.compile(
    rf"^\(?\s*(?:(?P<re>[+-]?{_SIZE})\s*(?:\+\s*(?=[+-]))?(?=[+-]))?(?P<im>[+-]?\s*{_SIZE})\s*\*?\s*[ijIJ]\s*\)?$"
)
ANYWHERE = re.compile(rb"\d\s*\*?[ijIJ]\s*\)?\s*[\"']?\s*(?:[,;\t\r\n ]|$)")
NUMBER = re.compile(r"^[+-]?[\d.,]+(?:[eE][+-]?\d+)?$")
HEAD, LINES = 65536, 40  # bytes and lines in which a header is looked for
APART = (";", "\t", ",", None)


def split_complex(source: Source) -> tuple[Source, list[str]]:
    """Return a table with each complex column split into NAME_re and NAME_im, and a remark; other tables stay. Without
    a header the first column is the frequency. Raises RecordError."""
    if not ANYWHERE.search(source.raw):
        return source, []
    lines = [line for line in _text(source.raw).splitlines() if line.strip()]
    for apart in APART:
        rows = [_fields(line, apart) for line in lines]
        at = next((i for i, row in enumerate(rows) if len(row) > 1 and any(map(COMPLEX.match, row))), None)
        if at is not None:
            return _split(source, rows, at)
    return source, []


def has_complex(source: Source) -> bool:
    """Return whether a table holds complex numbers as text."""
    return split_complex(source)[0] is not source


def heads_of(source: Source) -> list[str]:
    """Return the fields of the first lines of a table that hold words alone, as headers do."""
    lines = [re.split(r"[;,\t]", line) for line in _text(source.raw[:HEAD]).splitlines()[:LINES]]
    rows = [[field.strip(" \"'") for field in line] for line in lines]
    return [field for row in rows if len(row) > 1 and not any(map(NUMBER.match, row)) for field in row]


def _text(raw: bytes) -> str:
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", "replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def _fields(line: str, apart: str | None) -> list[str]:
    fields = [field.strip().strip("\"'") for field in line.strip().lstrip("#").split(apart)]
    return fields if apart in (",", None) else [re.sub(r"(?<=\d),(?=\d)", ".", field) for field in fields]


def _split(source: Source, rows: list[list[str]], at: int) -> tuple[Source, list[str]]:
    width = len(rows[at])
    above = [row for row in rows[:at] if len(row) == width]
    body = rows[at:]
    for i, row in enumerate(body):
        if len(row) != width:
            raise RecordError(f"{source.file}: row {i + 1} has {len(row)} fields, the first row of numbers has {width}")
    wide = [k for k in range(width) if any(COMPLEX.match(row[k]) for row in body)]
    if wide[0] == 0 and all(float(_parts(row[0], True)[1]) == 0.0 for row in body):  # frequencies stored as complex
        body = [[_parts(row[0], True)[0], *row[1:]] for row in body]
        wide = wide[1:]
    said = []
    if not above:
        if 0 in wide:
            raise RecordError(
                f"{source.file}: has no header, and its first column is complex; expected frequencies there"
            )
        names = [f"H{k}" if width > 2 else "H" for k in range(width)]
        above = [["f", *names[1:]]]
        said = [f"no header: column 1 taken as frequencies, column {', '.join(str(k + 1) for k in wide)} as responses"]
    more = [[field for k, each in enumerate(row) for field in [each] * (1 + (k in wide))] for row in above[1:2]]
    heads = [_doubled(above[0], wide), *more]
    lines = [*heads, *([part for k, field in enumerate(row) for part in _parts(field, k in wide)] for row in body)]
    raw = "".join(";".join(line) + "\n" for line in lines).encode()
    return replace(source, raw=raw), said


def _doubled(row: list[str], wide: list[int]) -> list[str]:
    """Return a header with `de [m/V]` split into `de_re [m/V]` and `de_im [m/V]`."""
    found = []
    for k, head in enumerate(row):
        name, bracket, unit = head.partition("[") if "[" in head else head.partition("(")
        of = name.strip() or "H"
        found += [f"{of}_{part} {bracket}{unit}".strip() for part in ("re", "im")] if k in wide else [head]
    return found


def _parts(field: str, wide: bool) -> list[str]:
    if not wide:
        return [field]
    hit = COMPLEX.match(field)
    return [field, "0"] if hit is None else [hit["re"] or "0", hit["im"].replace(" ", "")]
