"""MATLAB 7.3 files: HDF5 with MATLAB's attributes. Plain HDF5 with one data set per channel is read the same way."""

import io
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import h5py
import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.contents.variable import Variable, unique
from hw.records.limits import DEFAULT_LIMITS
from hw.records.mat5 import DEEPEST, DEFLATE_RATIO, NUMBERS

# MATLAB compresses with deflate; any other filter would load a plug-in from outside.
FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}

REFERENCES = "references"  # kind of a data set that names others: the elements of a cell or of several structures
WORDS = ("char", "HDF5 object")
MOST_VISITED = 200_000  # nodes whose sizes are looked up, of all variables together
MOST_NODES = 5_000  # that are read of one variable: hard links may lead in a circle, a few of them to billions


def open_mat73(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the variables of an HDF5 file. Raises RecordError and the errors that `damage.refused` converts.

    Soft and external links are left out: their targets are not in this file, so its hash would not cover them."""
    with h5py.File(io.BytesIO(raw), "r") as f:
        names = [n for n in f if n != "#refs#" and isinstance(f.get(n, getlink=True), h5py.HardLink)]
        left = [MOST_VISITED]
        referred = cache(lambda: _size(file, f.get("#refs#"), left))
        return unique(file, [_variable(file, raw, f, name, referred, left) for name in names])


def _variable(file: str, raw: bytes, f: h5py.File, name: str, referred: Callable[[], int], left: list[int]) -> Variable:
    found = f[name]

    def inner() -> Any:
        with h5py.File(io.BytesIO(raw), "r") as again:
            return _content(file, len(raw), again[name], [DEFAULT_LIMITS.max_samples, MOST_NODES])

    if not isinstance(found, h5py.Dataset):
        kind = "sparse" if "MATLAB_sparse" in found.attrs else "struct"
        return Variable(name, (1, 1), kind, inner=inner, unpacked=8 * (_size(file, found, left) + referred()))
    kind = _kind(found)
    if kind in NUMBERS:
        return Variable(name, found.shape, kind, lambda: _numbers(file, raw, name), inner=inner)
    size = 8 * (_size(file, found, left) + (referred() if kind in (REFERENCES, "cell") else 0))
    return Variable(name, found.shape or (), kind, text=inner if kind == "char" else None, inner=inner, unpacked=size)


def _size(file: str, node: h5py.Group | h5py.Dataset | None, left: list[int]) -> int:
    """Return how many numbers a node holds. left: [nodes that may still be looked at]. Raises RecordError beyond."""
    if not isinstance(node, h5py.Group):
        return 0 if node is None else node.size or 0
    sizes: list[int] = []

    def count(_: str, part: h5py.Group | h5py.Dataset) -> None:
        sizes.append(getattr(part, "size", 0) or 0)
        left[0] -= 1
        if left[0] < 0:
            raise RecordError(f"{file}: has more than {MOST_VISITED} parts")

    node.visititems(count)
    return sum(sizes)


def _content(file: str, file_bytes: int, node: h5py.Group | h5py.Dataset, left: list[int], depth: int = 0) -> Any:
    """Return the content of a node in the form of `mat5`; attributes of a data set become fields of a structure, its
    numbers "Data". left: [numbers, nodes that may still be read]. Raises RecordError beyond them."""
    if depth > DEEPEST:
        return None
    left[1] -= 1
    if left[1] < 0:
        raise RecordError(f"{file}: a variable has more than {MOST_NODES} parts, or links that lead in a circle")
    if not isinstance(node, h5py.Dataset):
        inner = {n: node[n] for n in node if isinstance(node.get(n, getlink=True), h5py.HardLink)}
        found = {n: _content(file, file_bytes, part, left, depth + 1) for n, part in inner.items()}
        lists = [
            len(x)
            for n, x in found.items()
            if isinstance(x, list) and isinstance(inner[n], h5py.Dataset) and _kind(inner[n]) == REFERENCES
        ]
        if lists and len(set(lists)) == 1 and len(lists) == len(found) and "MATLAB_class" in node.attrs:
            return [{n: x[i] for n, x in found.items()} for i in range(lists[0])]  # an array of structures
        return found | _attributes(node)
    kind = _kind(node)
    if kind not in (*NUMBERS, *WORDS, REFERENCES, "cell") or node.size == 0:
        return None
    vet_stored(file, node, file_bytes)
    left[0] -= node.size
    if left[0] < 0:
        raise RecordError(f"{file}: holds more than {DEFAULT_LIMITS.max_samples} numbers")
    if kind in (REFERENCES, "cell"):
        return [_content(file, file_bytes, node.file[to], left, depth + 1) for to in np.ravel(node[()]) if to]
    if kind == "char":
        return "".join(map(chr, np.ravel(node[()]).tolist()))
    if kind == "HDF5 object":
        text = node[()]
        return text.decode("utf-8", "replace") if isinstance(text, bytes) else None
    values = np.asarray(node[()])
    values = values.T if "MATLAB_class" in node.attrs else values
    stated = _attributes(node)
    return {"Data": values, **stated} if stated else values


def _attributes(node: h5py.Group | h5py.Dataset) -> dict[str, Any]:
    """Return the attributes that may state a time or a unit: single numbers and text, but MATLAB's own."""
    found = {}
    for name, value in node.attrs.items():
        text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
        if not name.startswith(("MATLAB_", "H5PATH")) and (isinstance(text, str) or np.size(text) == 1):
            found[name] = text if isinstance(text, str) else np.asarray(text)
    return found


def _kind(found: h5py.Dataset) -> str:
    if "MATLAB_empty" in found.attrs or found.shape is None:
        return "empty"
    stored: np.dtype[np.generic] = found.dtype
    if stored.kind not in "iuf":
        names = stored.names or ()
        if h5py.check_ref_dtype(stored) is h5py.Reference:
            return "cell" if found.attrs.get("MATLAB_class") == b"cell" else REFERENCES
        return "complex" if {"real", "imag"} <= set(names) else f"HDF5 {stored}"
    declared = found.attrs.get("MATLAB_class", b"")
    if isinstance(declared, bytes):
        declared = declared.decode("latin-1")
    if isinstance(declared, str) and declared:
        return str(declared)  # text and logicals are stored as integers: only the class differs
    return {"float64": "double", "float32": "single"}.get(stored.name, str(stored.name))


def _numbers(file: str, raw: bytes, name: str) -> Array:
    with h5py.File(io.BytesIO(raw), "r") as f:
        found = f[name]
        vet_stored(file, found, len(raw))
        return np.asarray(found[()], np.float64).ravel()


def vet_stored(file: str, found: h5py.Dataset, file_bytes: int) -> None:
    """Raise RecordError if numbers are not in the file: HDF5 reads unwritten parts as zeros and follows references into
    other files."""
    plan, where = found.id.get_create_plist(), f"{file}: variable '{found.name.lstrip('/')}'"
    if found.is_virtual or plan.get_external_count():
        raise RecordError(f"{where} lies in another file; only data inside the file are read")
    filters = {plan.get_filter(i)[0] for i in range(plan.get_nfilters())}
    if filters - FILTERS:
        raise RecordError(f"{where} is packed with HDF5 filter {sorted(filters - FILTERS)}; only deflate is read")
    stored, chunk = found.id.get_storage_size(), math.prod(found.chunks or ()) * found.dtype.itemsize
    if stored > file_bytes or max(found.nbytes, chunk) > stored * (DEFLATE_RATIO if filters else 1):
        raise RecordError(f"{where} declares {max(found.nbytes, chunk)} bytes, the file holds {stored} of them")
    if found.chunks:
        expected = math.prod(-(-n // c) for n, c in zip(found.shape, found.chunks, strict=True))
        if found.id.get_num_chunks() != expected:
            raise RecordError(f"{where} has {found.id.get_num_chunks()} chunks of data, expected {expected}")
