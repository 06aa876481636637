"""Responses of tables: real and imaginary part, magnitude and phase, or complex numbers beside frequencies."""

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import RecordError
from hw.records.contents.variable import Variable, remarks_of
from hw.records.responses.file import SPECTRUM, Curve, ResponseFile, response_file
from hw.records.responses.units import ANGULAR, axis_unit, converted, hertz, is_frequency_unit
from hw.records.source import Source
from hw.records.text.file import open_columns
from specs.units import parse_header, plain_unit, split_ratio

WORDS = {
    "re": "re", "real": "re", "im": "im", "imag": "im", "db": "dB", "deg": "deg", "rad": "rad",
    "mag": "mag", "magnitude": "mag", "abs": "mag", "amplitude": "mag", "amp": "mag", "modulus": "mag",
    "phase": "phase", "angle": "phase", "arg": "phase",
    "coherence": "coherence", "coh": "coherence", "var": "var", "variance": "var",
}  # fmt: skip
_ENDS = "|".join(sorted(WORDS, key=len, reverse=True))
PART = re.compile(rf"^(?:(?P<name>.+?)[ _.\-]+)?(?P<part>{_ENDS})$", re.IGNORECASE)
SHORT = re.compile(r"^(?P<name>.+?)(?P<part>real|imag|re|im|coherence|coh|var)$", re.IGNORECASE)  # `dere`
AROUND = re.compile(rf"^(?P<part>{_ENDS})\((?P<name>[^()]+)\)$", re.IGNORECASE)
UNITS_IN_BRACKETS = re.compile(r"^(?P<name>.*?)\s*\[(?P<unit>[^\[\]]*)\]$")
DECIBEL = re.compile(r"^dB\s*(?:(?:re|ref|rel)\.?\s+)?(?:1\s*)?\(?(?P<unit>.*?)\)?$", re.IGNORECASE)
DEGREES, RADIANS = ("deg", "°", "degree", "degrees", "grad"), ("rad", "radian", "radians")
UNNAMED = "H"  # name of a response without one
Parts = dict[str, tuple[str, Variable]]  # the columns of one response by their part, with their headers
ALIKE = 1e-3  # relative: how far two statements of one value may lie apart


def read_table(source: Source, input: str, there: Mapping[str, str]) -> ResponseFile:
    """Return the responses of a table, by the names and units of its header."""
    file = source.file
    source, said = split_complex(source)
    found = open_columns(file, source.raw)
    columns = {head: _header(head, column) for head, column in found.items() if column.load is not None}
    hits = {h: AROUND.match(name) or PART.match(name) or SHORT.match(name) for h, (name, _) in columns.items()}
    axes = {h: c for h, (name, c) in columns.items() if there.get(name) == "f"} or {
        h: c
        for h, (name, c) in columns.items()
        if axis_unit(name) is not None or (is_frequency_unit(c.unit) and not hits[h])
    }
    parts: dict[str, Parts] = {}
    for head, (_, column) in columns.items():
        hit = hits[head]
        if head not in axes and hit is not None:
            own = parts.setdefault(hit["name"] or UNNAMED, {})
            part = WORDS[hit["part"].lower()]
            if part in own:
                raise RecordError(f"{file}: '{own[part][0]}' and '{head}' are both the {part} of one response")
            own[part] = (head, column)
    has = ", ".join(name for name, _ in columns.values())
    if not axes:
        raise RecordError(f"{file}: no column of frequencies (such as 'f [Hz]' or 'freq'); it has {has}")
    f, words = _frequencies(file, {h: (columns[h][0], c) for h, c in axes.items()}, bool(there))
    responses = {name: one for name, p in parts.items() if (one := _response(file, name, p)) is not None}
    spectra = [name for name in responses if SPECTRUM.search(name)]
    if spectra and len(spectra) == len(responses):
        raise RecordError(
            f"{file}: holds spectra ({', '.join(spectra)}) and no response; export the frequency response"
        )
    responses = {name: one for name, one in responses.items() if name not in spectra}
    if not responses:
        raise RecordError(
            f"{file}: no pair of columns NAME_re and NAME_im, NAME_dB and NAME_deg, or NAME_mag and NAME_phase [deg]; "
            f"it has {has}"
        )
    _pair_unnamed(file, parts, responses)
    curves, taken = [], set(axes)
    for name, (H, unit, how) in responses.items():
        own = parts[name]
        beside = {part: (own[part][1].values, own[part][1].unit) for part in ("coherence", "var") if part in own}
        curves.append(Curve(name, H, *split_ratio(unit), beside.get("coherence"), beside.get("var")))
        taken |= {head for head, _ in own.values()}
        words.append(how)
    left = [head for head in columns if head not in taken]
    words += [f"left out: {', '.join(left)}"] if left else []
    return response_file(source, f, curves, input, [*remarks_of(found), *said, *words])


def _header(head: str, column: Variable) -> tuple[str, Variable]:
    """Return the name of a column, and the column with the unit of its header: also `re(de)` and `[(m/s2)/V]`."""
    brackets = UNITS_IN_BRACKETS.match(head.strip())
    if brackets:
        return brackets["name"].strip(), replace(column, unit=brackets["unit"].strip() or column.unit)
    if AROUND.match(head.strip()):
        return head.strip(), replace(column, unit="" if column.unit in head else column.unit)
    return parse_header(head)[0], column


def _frequencies(file: str, axes: Mapping[str, tuple[str, Variable]], mapped: bool) -> tuple[Array, list[str]]:
    """Return the frequencies [Hz] and the words on them. Raises RecordError if two axes contradict each other."""
    found: list[tuple[str, Array, list[str]]] = []
    for head, (name, column) in axes.items():
        own = axis_unit(name) or ""
        if own and column.unit and not np.isclose(hertz(file, head, own), hertz(file, head, column.unit)):
            raise RecordError(f"{file}: the column '{head}' has {own} in its name and the unit {column.unit}")
        unit = column.unit or own
        if not unit and name.lower() in ANGULAR:
            raise RecordError(f"{file}: the column '{head}' has no unit; write '{name} [rad/s]' or 'f [Hz]'")
        words = converted(name, unit) if unit else [f"{name} has no unit: taken in Hz"]
        found.append((head, column.values * hertz(file, f"'{head}'", unit or "Hz"), words))
    for head, f, _ in found[1:]:
        if not np.allclose(f, found[0][1], rtol=ALIKE, atol=0.0):
            hint = "" if mapped else "; correct one of them, or name the right one with --map f=NAME"
            raise RecordError(f"{file}: the frequencies '{found[0][0]}' and '{head}' contradict each other{hint}")
    return found[0][1], found[0][2]


def _response(file: str, name: str, own: Parts) -> tuple[Complex, str, str] | None:
    """Return a response, its unit and how it was taken; None if the table has neither of its pairs. Raises RecordError
    for half a pair, two units, a phase without a unit, and pairs that contradict each other."""
    sizes, phases = [p for p in ("mag", "dB") if p in own], [p for p in ("phase", "deg", "rad") if p in own]
    cartesian = [p for p in ("re", "im") if p in own]
    if not cartesian and not sizes and not phases:
        return None
    found: list[tuple[Complex, str, str]] = []
    if len(cartesian) == 2:
        (_, re_), (_, im_) = own["re"], own["im"]
        if plain_unit(re_.unit) != plain_unit(im_.unit):
            units = f"{re_.unit or 'none'} and {im_.unit or 'none'}"
            raise RecordError(f"{file}: the columns of {name} state two units ({units}); write both in one")
        found.append((re_.values + 1j * im_.values, re_.unit, f"{name} from columns of real and imaginary parts"))
    if sizes and phases:
        found.append(_polar(file, name, own[sizes[0]], sizes[0], own[phases[0]], phases[0]))
    if not found:
        lone = ", ".join(own[p][0] for p in (*cartesian, *sizes, *phases))
        missing = "the imaginary or real part" if cartesian else "a phase [deg] or [rad]" if sizes else "a magnitude"
        raise RecordError(f"{file}: {name} has {lone} and lacks {missing}: no response without both")
    if len(found) == 2:
        scale = np.abs(found[0][0]).max()
        if not np.allclose(found[0][0], found[1][0], rtol=ALIKE, atol=ALIKE * scale):
            raise RecordError(f"{file}: {name}: its real and imaginary parts contradict its magnitude and phase")
    return found[0]


def _polar(
    file: str, name: str, size: tuple[str, Variable], size_part: str, phase: tuple[str, Variable], phase_part: str
) -> tuple[Complex, str, str]:
    stated = {"deg": "deg", "rad": "rad"}.get(phase_part, "")
    unit = phase[1].unit.strip().lower()
    angle = "deg" if unit in DEGREES else "rad" if unit in RADIANS else ""
    if (unit and not angle) or (stated and angle and stated != angle):
        raise RecordError(f"{file}: the phase '{phase[0]}' has the unit {phase[1].unit}; expected deg or rad")
    angle = angle or stated
    if not angle:
        raise RecordError(f"{file}: the phase '{phase[0]}' has no unit; write [deg] or [rad] behind its name")
    values, per = size[1].values, size[1].unit
    decibel = DECIBEL.match(per.strip())
    if size_part == "dB" or decibel:
        per = decibel["unit"] if decibel else per
        values = 10.0 ** (values / 20.0)
        how = f"{name} from dB (re 1 {per or 'in SI'}) and {angle}"
    else:
        if (values < 0.0).any():
            raise RecordError(f"{file}: the magnitude '{size[0]}' is negative; in dB? write [dB] behind its name")
        how = f"{name} from magnitude and phase in {angle}"
    turn = np.deg2rad(phase[1].values) if angle == "deg" else phase[1].values
    return np.asarray(values * np.exp(1j * turn), np.complex128), per, how


def _pair_unnamed(file: str, parts: dict[str, Parts], responses: Mapping[str, object]) -> None:
    """Give an unnamed coherence or variance to the only response. Raises RecordError if there are several."""
    if UNNAMED in responses or UNNAMED not in parts:
        return
    loose = parts.pop(UNNAMED)
    if len(responses) > 1:
        heads = ", ".join(head for head, _ in loose.values())
        raise RecordError(f"{file}: {heads}: of which response? Its name goes before, such as de_coherence")
    (only,) = responses
    for part, column in loose.items():
        if part in parts[only]:
            raise RecordError(f"{file}: '{column[0]}' and '{parts[only][part][0]}' are both the {part} of {only}")
        parts[only][part] = column


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
