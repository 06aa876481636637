"""MATLAB 5 to 7 files: the level 5 format, compressed or not.

Source: [MATFILE] chapter 1. scipy.io.loadmat believes the sizes that a file declares and
allocates them; here every size is compared with the bytes that are there before anything is read, so that a small file
cannot ask for gigabytes. The tests compare the result with scipy's."""

import math
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.contents.variable import NESTED, Variable, unique
from hw.records.limits import DEFAULT_LIMITS

HEADER_BYTES = 128  # of a file, before its first array ([MATFILE])
COMPRESSED, MATRIX = 15, 14  # types of an element ([MATFILE] table 1-1)
# Type of a stored number -> numpy ([MATFILE] table 1-1).
STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
# Class of an array -> its name (table 1-3).
CLASSES = {
    1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse", 6: "double", 7: "single", 8: "int8", 9: "uint8",
    10: "int16", 11: "uint16", 12: "int32", 13: "uint32", 14: "int64", 15: "uint64", 16: "function", 17: "opaque",
}  # fmt: skip
NUMBERS = frozenset(CLASSES[n] for n in range(6, 16))
OPAQUE = 17  # a class, see above
WIDE = (4, 17)  # types of characters of two bytes
DEEPEST = 8  # structures within structures
MOST_PARTS = 200_000  # of one variable: a compressed file holds a hundred empty ones in a byte
MOST_LETTERS = 1_000_000  # of one text
LOGICAL, COMPLEX = 0x02, 0x08  # flags of an array ([MATFILE])
HEAD_BYTES = 1024  # holds flags, dimensions and name of any array with a name of MATLAB's 63 characters
UNPACKED_AT_ONCE = 1_000_000  # bytes
DEFLATE_RATIO = 1032  # no deflate stream grows by more (zlib.net, "Maximum Compression Factor")


@dataclass(frozen=True)
class MatElement:
    """Tag of a data element: its type and the position of its bytes; `after` is the start of the next one."""

    kind: int
    start: int
    size: int
    after: int


def open_mat5(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the variables of a level 5 MAT-file. Raises RecordError and the errors that `damage.refused` converts."""
    order = ">" if raw[126:128] == b"MI" else "<"
    found = [_variable(file, raw, e, order) for e in _elements(file, raw, order)]
    return unique(file, [v for v in found if v.name])  # unnamed: what MATLAB keeps behind its objects


def vet_unpacked(file: str, raw: bytes, most: int) -> None:
    """Raise RecordError if compressed variables unpack to more than `most` bytes. No data are kept."""
    left = most
    for element in _elements(file, raw, ">" if raw[126:128] == b"MI" else "<"):
        inflate, packed = zlib.decompressobj(), raw[element.start : element.start + element.size]
        while element.kind == COMPRESSED and packed and left >= 0:
            left -= len(inflate.decompress(packed, UNPACKED_AT_ONCE))
            packed = inflate.unconsumed_tail
    if left < 0:
        raise RecordError(f"{file}: its compressed variables unpack to more than {most} bytes, the most that is read")


def _elements(file: str, raw: bytes, order: str) -> Iterator[MatElement]:
    at = HEADER_BYTES
    while at < len(raw):
        element = _tag(raw, at, order)
        if element.kind not in (MATRIX, COMPRESSED) or element.size == 0:
            raise RecordError(f"{file}: byte {at} should start a variable, but its type is {element.kind}")
        if element.start + element.size > len(raw):
            missing = element.start + element.size - len(raw)
            raise RecordError(
                f"{file}: ends too early, it was not copied whole: "
                f"the last {missing} bytes of the variable at byte {at} are missing"
            )
        yield element
        # Only here is nothing padded to a multiple of 8: sizes of whole variables include their padding.
        at = element.start + element.size


def _tag(data: bytes, at: int, order: str) -> MatElement:
    kind, size = struct.unpack_from(order + "II", data, at)
    if kind >> 16:  # small element: size and type share the first word, the data are the second
        return MatElement(kind & 0xFFFF, at + 4, kind >> 16, at + 8)
    return MatElement(kind, at + 8, size, at + 8 + -(-size // 8) * 8)


def _variable(file: str, raw: bytes, element: MatElement, order: str) -> Variable:
    end = element.start + element.size
    if element.kind == COMPRESSED:
        return _compressed_variable(file, memoryview(raw)[element.start : end], order)
    head = _head(file, raw, element.start, order)
    return head.variable(file, lambda: raw, end, order)


def _compressed_variable(file: str, packed: memoryview, order: str) -> Variable:
    first = zlib.decompressobj().decompress(packed, HEAD_BYTES)
    outer = _tag(first, 0, order)
    declared = outer.start + outer.size
    if outer.kind != MATRIX or declared > DEFLATE_RATIO * len(packed) + HEAD_BYTES:
        raise RecordError(f"{file}: {len(packed)} compressed bytes cannot hold a variable of {outer.size} bytes")
    head = _head(file, first, outer.start, order)

    def unpacked() -> bytes:
        inflate = zlib.decompressobj()
        whole = inflate.decompress(packed, declared + 1)
        if len(whole) != declared or not inflate.eof:  # at the end zlib has compared its checksum
            raise RecordError(f"{file}: variable '{head.name}' is cut or damaged inside its compressed data")
        return whole

    return head.variable(file, unpacked, declared, order)


@dataclass(frozen=True)
class ArrayHeader:
    """Header of an array; data_at: the start of its data."""

    name: str
    shape: tuple[int, ...]
    kind: str
    data_at: int

    def variable(self, file: str, data: Callable[[], bytes], end: int, order: str) -> Variable:
        """Return the variable; data: its bytes up to `end`, unpacked only if they are wanted."""

        def inner() -> Any:
            most = 8 * DEFAULT_LIMITS.max_samples
            if end - self.data_at > most:
                size = f"unpacks to {end - self.data_at} bytes; at most {most} are read"
                raise RecordError(f"{file}: variable '{self.name}' {size}")
            return _content(file, data(), self, end, order, [MOST_PARTS])

        load = text = None
        if self.kind in NUMBERS:
            load = lambda: _numbers(file, data(), self, end, order)  # noqa: E731
        if self.kind == "char":
            text = lambda: _characters(data(), self.data_at, self.shape, order)  # noqa: E731
        return Variable(self.name, self.shape, self.kind, load, text=text, inner=inner, unpacked=end - self.data_at)


def _head(file: str, data: bytes, start: int, order: str) -> ArrayHeader:
    flags = _tag(data, start, order)
    word = struct.unpack_from(order + "I", data, flags.start)[0]
    number, bits = word & 0xFF, word >> 8 & 0xFF
    if number == OPAQUE:  # has its name where the others have dimensions
        return ArrayHeader(_text(data, _tag(data, flags.after, order)), (1, 1), "opaque", 0)
    dims = _tag(data, flags.after, order)
    shape = struct.unpack_from(f"{order}{dims.size // 4}i", data, dims.start)
    if len(shape) < 2 or min(shape) < 0:
        raise RecordError(f"{file}: the variable at byte {start} declares the dimensions {shape}")
    name = _tag(data, dims.after, order)
    kind = _kind(number, bits)
    long = kind == "char" and math.prod(shape) > MOST_LETTERS  # no name, no unit and no time: it is not read
    return ArrayHeader(_text(data, name), shape, "long text" if long else kind, name.after)


def _kind(number: int, bits: int) -> str:
    if bits & COMPLEX:
        return "complex"
    if bits & LOGICAL:
        return "logical"
    return CLASSES.get(number, f"class {number}")


def _text(data: bytes, element: MatElement) -> str:
    return data[element.start : element.start + element.size].decode("latin-1")


def _content(file: str, data: bytes, head: ArrayHeader, end: int, order: str, left: list[int], depth: int = 0) -> Any:
    """Return the content of an array: a dictionary for a structure, a list for several and for a cell, text, or numbers
    in their shape. None for other kinds, such as complex numbers, objects and functions. left: [parts that may still be
    read]. Raises RecordError beyond them."""
    if head.kind in NUMBERS:
        return _numbers(file, data, head, end, order).reshape(head.shape, order="F")
    if head.kind == "char":
        return _characters(data, head.data_at, head.shape, order)
    if head.kind not in NESTED or depth > DEEPEST:
        return None
    at, names, count = head.data_at, [""], math.prod(head.shape)
    if head.kind == "struct":
        width = _tag(data, at, order)
        fields = _tag(data, width.after, order)
        (wide,) = struct.unpack_from(order + "i", data, width.start)
        words = data[fields.start : fields.start + fields.size]
        names = [words[i : i + wide].split(b"\0")[0].decode("latin-1") for i in range(0, len(words), wide)]
        at = fields.after
    left[0] -= count * len(names)
    if left[0] < 0:
        raise RecordError(f"{file}: a variable has more than {MOST_PARTS} parts")
    if len(set(names)) < len(names):
        raise RecordError(f"{file}: a structure has two fields of one name")
    found: list[Any] = []
    for _ in range(count * len(names)):
        element = _tag(data, at, order)
        at = element.start + element.size
        if element.kind != MATRIX or at > end:
            raise RecordError(f"{file}: a structure is damaged at byte {element.start}")
        inner = _head(file, data, element.start, order) if element.size else None
        found.append(None if inner is None else _content(file, data, inner, at, order, left, depth + 1))
    if head.kind == "cell":
        return found
    structures = [dict(zip(names, found[i : i + len(names)], strict=True)) for i in range(0, len(found), len(names))]
    return structures[0] if len(structures) == 1 else structures


def _characters(data: bytes, at: int, shape: tuple[int, ...], order: str) -> str:
    """Return the text of an array of characters, which is stored column by column: a line for each row."""
    element = _tag(data, at, order)
    wide = "utf-16le" if order == "<" else "utf-16be"
    text = data[element.start : element.start + element.size].decode(
        wide if element.kind in WIDE else "utf-8", "replace"
    )
    rows = shape[0] if len(text) == math.prod(shape) else 1
    return "\n".join(text[i::rows].rstrip() for i in range(rows))


def _numbers(file: str, data: bytes, head: ArrayHeader, end: int, order: str) -> Array:
    element = _tag(data, head.data_at, order)
    code, count = STORED.get(element.kind), math.prod(head.shape)
    if code is None or element.size != count * np.dtype(code).itemsize or element.start + element.size > end:
        raise RecordError(
            f"{file}: variable '{head.name}' declares {count} numbers, "
            f"but its data are {element.size} bytes of type {element.kind}"
        )
    stored: NDArray[np.generic] = np.frombuffer(data, order + code, count, element.start)
    return np.require(stored, np.float64, ["C", "A"])
