"""Universal file format, data set 58 "function at nodal DOF", in text and binary: parsing and layout.

Source: SDRC, Universal Dataset 58 (UC-SDRL, ceas3.uc.edu/sdrluff). pyuff reads these files too, but returns a cut set
without a word and hides every cause behind "Error reading"; here the number of values is compared with the header. The
tests compare both directions with pyuff.
"""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.errors import RecordError

TIME, FRF = 1, 4  # function types of record 6
DELIMITER = re.compile(rb"^ {4}-1 *\r?$", re.MULTILINE)
HEADER_LINES = 11  # records 1 to 11 of the set, before its values
REAL_SINGLE, REAL_DOUBLE, COMPLEX_SINGLE, COMPLEX_DOUBLE = 2, 4, 5, 6  # ordinate data types of record 7
DIRECTIONS = {0: "", 1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z",
              4: "+RX", -4: "-RX", 5: "+RY", -5: "-RY", 6: "+RZ", -6: "-RZ"}  # fmt: skip
UNNAMED = ("", "NONE")
FORTRAN_TO_C = bytes.maketrans(b"Dd", b"Ee")


@dataclass(frozen=True)
class UffFunction:
    """Header of one data set 58 and its bytes. `count` values on an even abscissa (start, step) or on a stated one.

    x_unit, unit, per : labels of the abscissa, the ordinate and its denominator. layout : dtype of a value in `body`,
    fields "x" (uneven only), "y0" and "y1" (complex only); text when `is_text`."""

    kind: int
    id1: str
    response: str
    reference: str
    response_dof: str
    reference_dof: str
    count: int
    start: float
    step: float
    x_unit: str
    unit: str
    per: str
    layout: np.dtype[np.void]
    is_text: bool
    body: bytes

    @property
    def is_complex(self) -> bool:
        return "y1" in (self.layout.names or ())


def functions(file: str, raw: bytes) -> list[UffFunction]:
    """Return every data set 58 of the bytes of a file; sets of other numbers are left out. Raises RecordError."""
    found: list[UffFunction] = []
    at = 0
    while opening := DELIMITER.search(raw, at):
        number, start = _line(raw, opening.end() + 1)
        if number[:6].strip() == b"58":
            function, at = _function(file, raw, number, start)
            found.append(function)
        else:
            at = _closing(file, raw, start).end()
    return found


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


def _closing(file: str, raw: bytes, start: int) -> re.Match[bytes]:
    found = DELIMITER.search(raw, start)
    if found is None:
        raise RecordError(f"{file}: is cut: the data set before byte {start} has no end")
    return found


def _line(raw: bytes, at: int) -> tuple[bytes, int]:
    end = raw.find(b"\n", at)
    return (raw[at:], len(raw)) if end < 0 else (raw[at:end].rstrip(b"\r"), end + 1)


def _function(file: str, raw: bytes, number: bytes, at: int) -> tuple[UffFunction, int]:
    """Return the set whose record 1 begins at `at`, and where the next may begin. Fields stand in fixed columns: of
    record 6 (`ids`) the function type, names and degrees of freedom, of record 7 (`form`) the abscissa."""
    lines = []
    for _ in range(HEADER_LINES):
        line, at = _line(raw, at)
        lines.append(line.decode("latin-1").ljust(80))
    ids, form = lines[5], lines[6]
    count = int(form[10:20])
    layout, end, after = _body(file, raw, at, number, form)
    function = UffFunction(
        kind=int(ids[:5]),
        id1=lines[0].strip(),
        response=ids[31:41].strip(),
        reference=ids[56:66].strip(),
        response_dof=_dof(ids[41:51], ids[51:55]),
        reference_dof=_dof(ids[66:76], ids[76:80]),
        count=count,
        start=_float(form[30:43]),
        step=_float(form[43:56]),
        x_unit=_label(lines[7]),
        unit=_label(lines[8]),
        per=_label(lines[9]),
        layout=layout,
        is_text=not _byte_order(number),
        body=raw[at:end],
    )
    return function, after


def _label(axis: str) -> str:
    unit = axis[47:67].strip()
    return "" if unit in UNNAMED else unit


def _dof(node: str, direction: str) -> str:
    return f"{int(node)}{DIRECTIONS.get(int(direction), '?')}"


def _body(file: str, raw: bytes, at: int, number: bytes, form: str) -> tuple[np.dtype[np.void], int, int]:
    """Return the layout of the values that start at `at`, their end, and the earliest start of the next set."""
    kind, count, even = int(form[:10]), int(form[10:20]), int(form[20:30]) == 1
    if kind not in (REAL_SINGLE, REAL_DOUBLE, COMPLEX_SINGLE, COMPLEX_DOUBLE) or count < 0:
        raise RecordError(f"{file}: a data set 58 declares {count} values of type {kind}")
    order = _byte_order(number)
    if not order:
        closing = _closing(file, raw, at)
        return _layout(kind, even, "S13", "S13", "S20"), closing.start(), closing.end()
    # The abscissa is single by the standard (addendum B) and double in what pyuff writes: the end of the set tells.
    for stored in ("f4", "f8"):
        layout = _layout(kind, even, order + stored, order + "f4", order + "f8")
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


def _float(field: str) -> float:
    return float(field.replace("D", "E").replace("d", "e"))


def _table(file: str, f: UffFunction) -> NDArray[np.void]:
    body = f.body
    if f.is_text:  # values are right-justified in their fields: only padding stands behind the last of a line
        body = b"".join(line.rstrip() for line in body.splitlines()).translate(FORTRAN_TO_C)
    if len(body) != f.count * f.layout.itemsize:
        raise RecordError(
            f"{file}: function '{f.id1 or f.response}' declares {f.count} values of {f.layout.itemsize} bytes, "
            f"but {len(body)} bytes are there"
        )
    return np.frombuffer(body, f.layout, f.count)
