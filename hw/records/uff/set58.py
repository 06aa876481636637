"""Universal file format, text and binary: data set 58 "function at nodal DOF", and data set 164, its units.

Source: SDRC, Universal Datasets 58 and 164 (UC-SDRL, ceas3.uc.edu/sdrluff). Values are divided by the factors of data
set 164, by the exponents of length and force that a specific data type has. pyuff reads these files too, but returns a
cut set without a word and hides every cause behind "Error reading"; here the number of values is compared with the
header. The tests compare both directions with pyuff."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.errors import RecordError

FOOT, INCH, POUND, KILOPOND, POUNDAL = 0.3048, 0.0254, 4.4482216152605, 9.80665, 0.138254954376
# Code: name, length and force of the system in SI.
SYSTEMS = {
    1: ("m, N", 1.0, 1.0),
    2: ("ft, lbf", FOOT, POUND),
    3: ("m, kgf", 1.0, KILOPOND),
    4: ("ft, poundal", FOOT, POUNDAL),
    5: ("mm, mN", 1e-3, 1e-3),
    6: ("cm, cN", 1e-2, 1e-2),
    7: ("in, lbf", INCH, POUND),
    8: ("mm, kgf", 1e-3, KILOPOND),
    10: ("mm, N", 1e-3, 1.0),
}
USER = 9
AGREE = 1e-3  # relative: factors are written with four digits or more


@dataclass(frozen=True)
class UnitSystem:
    """Units of a file: name, and the length [m] and force [N] that it counts in."""

    name: str
    length: float
    force: float

    @property
    def si(self) -> bool:
        return math.isclose(self.length, 1.0, rel_tol=1e-9) and math.isclose(self.force, 1.0, rel_tol=1e-9)


def unit_system(file: str, lines: Sequence[str]) -> UnitSystem:
    """Return the units that the records of a data set 164 state. Raises RecordError if it is damaged, of an unknown
    code, or if its code and its factors contradict each other."""
    try:
        code = int(lines[0][:10])
        factors = lines[1].replace("D", "E").replace("d", "e")
        length, force = (1.0 / float(factors[at : at + 25]) for at in (0, 25))
    except (IndexError, ValueError, ZeroDivisionError) as e:
        raise RecordError(f"{file}: its data set 164 (units) has no code and factors that can be read") from e
    if not (math.isfinite(length) and math.isfinite(force) and length > 0.0 and force > 0.0):
        raise RecordError(f"{file}: its data set 164 (units) has the factors {1 / length:g} and {1 / force:g}")
    if code == USER:
        return UnitSystem(f"{length:.6g} m, {force:.6g} N", length, force)
    if code not in SYSTEMS:
        raise RecordError(f"{file}: its data set 164 has the units code {code}; 1 to 10 are known")
    name, metres, newtons = SYSTEMS[code]
    if not (math.isclose(length, metres, rel_tol=AGREE) and math.isclose(force, newtons, rel_tol=AGREE)):
        raise RecordError(
            f"{file}: its data set 164 has the units code {code} ({name}) and the factors {1 / length:.6g} and "
            f"{1 / force:.6g}, which are {1 / metres:.6g} and {1 / newtons:.6g} of that code; correct one of them"
        )
    return UnitSystem(name, metres, newtons)


TIME, FRF, COHERENCE, GENERAL = 1, 4, 6, 0  # function types of record 6
DELIMITER = re.compile(rb"^ {4}-1 *\r?$", re.MULTILINE)
HEADER_LINES = 11  # records 1 to 11 of the set, before its values
REAL_SINGLE, REAL_DOUBLE, COMPLEX_SINGLE, COMPLEX_DOUBLE = 2, 4, 5, 6  # ordinate data types of record 7
DIRECTIONS = {0: "", 1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z",
              4: "+RX", -4: "-RX", 5: "+RY", -5: "-RY", 6: "+RZ", -6: "-RZ"}  # fmt: skip
VARIANCE = "variance of "  # begins ID line 1 of a function of type 0 that this program wrote
TURNING = 4  # directions from here on are rotations
UNNAMED = ("", "NONE")
FUNCTION_TYPES = {
    0: "unknown", 1: "time response", 2: "auto spectrum", 3: "cross spectrum", 4: "frequency response",
    5: "transmissibility", 6: "coherence", 7: "auto correlation", 8: "cross correlation", 9: "power spectral density",
    10: "energy spectral density", 11: "probability density", 12: "spectrum", 17: "orbit", 18: "mode indicator",
    21: "partial coherence", 24: "shock response spectrum", 26: "multiple coherence", 27: "order function",
}  # fmt: skip
FORTRAN_TO_C = bytes.maketrans(b"Dd", b"Ee")


@dataclass(frozen=True)
class Axis:
    """One of records 8 to 10. kind: specific data type; exponents: of length and force; label, unit: as written, "" for
    NONE; turns: the direction of record 6 is a rotation."""

    kind: int
    exponents: tuple[int, int]
    label: str
    unit: str
    turns: bool = False


@dataclass(frozen=True)
class UffFunction:
    """Header of one data set 58 and its bytes. `count` values on an even abscissa (start, step) or on a stated one.

    x, y, denominator : records 8 to 10; system : units by data set 164, None without one; id5 : the last line of text.
    layout : dtype of a value in `body`, fields "x" (uneven only), "y0" and "y1" (complex only); text when `is_text`."""

    kind: int
    id1: str
    id5: str
    response: str
    reference: str
    response_dof: str
    reference_dof: str
    count: int
    start: float
    step: float
    x: Axis
    y: Axis
    denominator: Axis
    layout: np.dtype[np.void]
    is_text: bool
    body: bytes
    system: UnitSystem | None = None

    @property
    def is_complex(self) -> bool:
        return "y1" in (self.layout.names or ())

    @property
    def unit(self) -> str:
        return self.y.unit

    @property
    def per(self) -> str:
        return self.denominator.unit

    @property
    def name(self) -> str:
        """Return the response entity; without one its degree of freedom."""
        return self.response if self.response not in UNNAMED else self.response_dof

    @property
    def input(self) -> str:
        """Return the reference entity; without one its degree of freedom, "" if that is not stated either."""
        if self.reference not in UNNAMED:
            return self.reference
        return "" if self.reference_dof == "0" else self.reference_dof


def functions(file: str, raw: bytes) -> list[UffFunction]:
    """Return every data set 58 of the bytes of a file, with the units of its data set 164; other sets are left out.
    Raises RecordError, also if the file has two systems of units."""
    found: list[UffFunction] = []
    systems: list[UnitSystem] = []
    at = 0
    while opening := DELIMITER.search(raw, at):
        number, start = _line(raw, opening.end() + 1)
        if number[:6].strip() == b"58":
            function, at = _function(file, raw, number, start)
            found.append(function)
            continue
        closing = _closing(file, raw, start)
        if number[:6].strip() == b"164":
            systems.append(unit_system(file, raw[start : closing.start()].decode("latin-1").splitlines()))
        at = closing.end()
    if any(each != systems[0] for each in systems):
        words = " and ".join(dict.fromkeys(each.name for each in systems))
        raise RecordError(f"{file}: has two data sets 164 with different units ({words}); split the file")
    return [replace(each, system=systems[0]) for each in found] if systems else found


def abscissa(file: str, f: UffFunction) -> Array:
    """Return (count,) time or frequency of a function, in the unit of its file."""
    return (
        f.start + f.step * np.arange(f.count, dtype=np.float64)
        if "x" not in (f.layout.names or ())
        else _table(file, f)["x"].astype(np.float64)
    )


def ordinate(file: str, f: UffFunction) -> NDArray[np.float64] | NDArray[np.complex128]:
    """Return (count,) values of a function, complex if its type is."""
    table = _table(file, f)
    real = table["y0"].astype(np.float64)
    return real + 1j * table["y1"].astype(np.float64) if f.is_complex else real


def listing(found: Sequence[UffFunction]) -> str:
    """Return the kinds of functions with the names of their responses."""
    kinds: dict[int, list[str]] = {}
    for f in found:
        kinds.setdefault(f.kind, []).append(f.name)
    return "; ".join(f"{FUNCTION_TYPES.get(k, 'function')} (type {k}) of {', '.join(n)}" for k, n in kinds.items()) or (
        "no function (data set 58)"
    )


def _closing(file: str, raw: bytes, start: int) -> re.Match[bytes]:
    found = DELIMITER.search(raw, start)
    if found is None:
        raise RecordError(f"{file}: is cut: the data set before byte {start} has no end")
    return found


def _line(raw: bytes, at: int) -> tuple[bytes, int]:
    end = raw.find(b"\n", at)
    return (raw[at:], len(raw)) if end < 0 else (raw[at:end].rstrip(b"\r"), end + 1)


def _function(file: str, raw: bytes, number: bytes, at: int) -> tuple[UffFunction, int]:
    """Return the set whose record 1 begins at `at`, and where the next may begin. Fields have fixed columns: of record
    6 (`ids`) the function type, names and degrees of freedom, of record 7 (`form`) the abscissa."""
    lines = []
    for _ in range(HEADER_LINES):
        line, at = _line(raw, at)
        lines.append(line.decode("latin-1").ljust(80))
    ids, form = lines[5], lines[6]
    count = _int(file, 7, form[10:20])
    layout, end, after = _body(file, raw, at, number, form)
    turns = [abs(_int(file, 6, field)) >= TURNING for field in (ids[51:55], ids[76:80])]
    function = UffFunction(
        kind=_int(file, 6, ids[:5]),
        id1=lines[0].strip(),
        id5=lines[4].strip(),
        response=ids[31:41].strip(),
        reference=ids[56:66].strip(),
        response_dof=_dof(file, ids[41:51], ids[51:55]),
        reference_dof=_dof(file, ids[66:76], ids[76:80]),
        count=count,
        start=_float(file, 7, form[30:43]),
        step=_float(file, 7, form[43:56]),
        x=_axis(file, 8, lines[7]),
        y=_axis(file, 9, lines[8], turns[0]),
        denominator=_axis(file, 10, lines[9], turns[1]),
        layout=layout,
        is_text=not _byte_order(number),
        body=raw[at:end],
    )
    return function, after


def _axis(file: str, record: int, line: str, turns: bool = False) -> Axis:
    label, unit = ("" if words in UNNAMED else words for words in (line[26:46].strip(), line[47:67].strip()))
    exponents = (_int(file, record, line[10:15]), _int(file, record, line[15:20]))
    return Axis(_int(file, record, line[:10]), exponents, label, unit, turns)


def _dof(file: str, node: str, direction: str) -> str:
    return f"{_int(file, 6, node)}{DIRECTIONS.get(_int(file, 6, direction), '?')}"


def _body(file: str, raw: bytes, at: int, number: bytes, form: str) -> tuple[np.dtype[np.void], int, int]:
    """Return the layout of the values that start at `at`, their end, and the earliest start of the next set."""
    kind, count, even = (_int(file, 7, form[at : at + 10]) for at in (0, 10, 20))
    if even not in (0, 1):
        raise RecordError(
            f"{file}: record 7 of a data set 58 has the spacing {even}; 0 (uneven) and 1 (even) are known"
        )
    if kind not in (REAL_SINGLE, REAL_DOUBLE, COMPLEX_SINGLE, COMPLEX_DOUBLE) or count < 0:
        raise RecordError(f"{file}: a data set 58 declares {count} values of type {kind}")
    order = _byte_order(number)
    if not order:
        closing = _closing(file, raw, at)
        if count > closing.start() - at:  # before room is made for so many times
            raise RecordError(f"{file}: a data set 58 declares {count} values in {closing.start() - at} bytes")
        return _layout(kind, even == 1, "S13", "S13", "S20"), closing.start(), closing.end()
    # The abscissa is single by the standard (addendum B) and double in files of pyuff: the end of the set shows which.
    for stored in ("f4", "f8"):
        layout = _layout(kind, even == 1, order + stored, order + "f4", order + "f8")
        end = at + count * layout.itemsize
        if re.match(rb"\r?\n?    -1", raw[end : end + 8]):
            return layout, end, end + 6
    raise RecordError(f"{file}: is cut or damaged: {count} binary values from byte {at} are not followed by '    -1'")


def _layout(kind: int, even: bool, x: str, single: str, double: str) -> np.dtype[np.void]:
    y = double if kind in (REAL_DOUBLE, COMPLEX_DOUBLE) else single
    parts = ["y0", "y1"] if kind in (COMPLEX_SINGLE, COMPLEX_DOUBLE) else ["y0"]
    return np.dtype([("x", x)] * (not even) + [(part, y) for part in parts])


def _byte_order(number: bytes) -> str:
    if number[6:7].lower() != b"b":
        return ""
    return "<" if int(number[7:13]) == 1 else ">"


def _int(file: str, record: int, field: str) -> int:
    """Return a field of a record; an empty one is 0, as FORTRAN reads it. Raises RecordError."""
    try:
        return int(field.strip() or "0")
    except ValueError as e:
        raise RecordError(f"{file}: record {record} of a data set 58 has '{field.strip()}' in place of a number") from e


def _float(file: str, record: int, field: str) -> float:
    try:
        return float(field.strip().replace("D", "E").replace("d", "e") or "0")
    except ValueError as e:
        raise RecordError(f"{file}: record {record} of a data set 58 has '{field.strip()}' in place of a number") from e


def _table(file: str, f: UffFunction) -> NDArray[np.void]:
    body, size = f.body, f.count * f.layout.itemsize
    if f.is_text:  # values are right-justified in their fields: only padding follows the last of a line
        lines = [line.rstrip() for line in body.splitlines()]
        body = b"".join(lines).translate(FORTRAN_TO_C)
        if 0 < len(body) - size < len(lines[-1]) and not body[size:].strip(b" 0.eE+-"):
            body = body[:size]  # some programs fill the last line with zeros
    if len(body) != size:
        raise RecordError(
            f"{file}: function '{f.id1 or f.response}' declares {f.count} values of {f.layout.itemsize} bytes, "
            f"but {len(body)} bytes are there"
        )
    try:
        return _numbers(body, f)
    except ValueError as e:
        raise RecordError(f"{file}: function '{f.id1 or f.response}' has text in place of a number") from e


def _numbers(body: bytes, f: UffFunction) -> NDArray[np.void]:
    table = np.frombuffer(body, f.layout, f.count)
    if not f.is_text:
        return table
    numbers = np.empty(f.count, [(name, "f8") for name in f.layout.names or ()])
    for name in f.layout.names or ():
        numbers[name] = table[name].astype(np.float64)
    return numbers
