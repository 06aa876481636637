"""MATLAB 7.3 files: HDF5 with MATLAB's attributes. Plain HDF5 with one data set per channel is read the same way."""

import io
import math

import h5py
import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.mat5 import DEFLATE_RATIO, NUMBERS
from hw.records.variable import Variable, unique

# MATLAB compresses with deflate; any other filter would load a plug-in from outside.
FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}


def open_mat73(file: str, raw: bytes) -> dict[str, Variable]:
    """Return the variables of the bytes of an HDF5 file. Raises RecordError and the errors that `damage.refused`
    converts.

    Soft and external links are left out: what they name is not in this file, so its hash would not cover it.
    """
    with h5py.File(io.BytesIO(raw), "r") as f:
        names = [n for n in f if n != "#refs#" and isinstance(f.get(n, getlink=True), h5py.HardLink)]
        return unique(file, [_variable(file, raw, f, name) for name in names])


def _variable(file: str, raw: bytes, f: h5py.File, name: str) -> Variable:
    found = f[name]
    if not isinstance(found, h5py.Dataset):
        return Variable(name, (1, 1), "sparse" if "MATLAB_sparse" in found.attrs else "struct")
    kind = _kind(found)
    if kind not in NUMBERS:
        return Variable(name, found.shape or (), kind)
    return Variable(name, found.shape, kind, lambda: _numbers(file, raw, name))


def _kind(found: h5py.Dataset) -> str:
    if "MATLAB_empty" in found.attrs or found.shape is None:
        return "empty"
    stored: np.dtype[np.generic] = found.dtype
    if stored.kind not in "iuf":
        names = stored.names or ()
        return "complex" if {"real", "imag"} <= set(names) else f"HDF5 {stored}"
    declared = found.attrs.get("MATLAB_class", b"")
    if isinstance(declared, bytes):
        declared = declared.decode("latin-1")
    if isinstance(declared, str) and declared:
        return str(declared)  # text and logicals are stored as integers: only the class tells
    return {"float64": "double", "float32": "single"}.get(stored.name, str(stored.name))


def _numbers(file: str, raw: bytes, name: str) -> Array:
    with h5py.File(io.BytesIO(raw), "r") as f:
        found = f[name]
        vet_stored(file, found, len(raw))
        return np.asarray(found[()], np.float64).ravel()


def vet_stored(file: str, found: h5py.Dataset, file_bytes: int) -> None:
    """Raise RecordError if numbers are not in the file: HDF5 reads a part that was never written as zeros, and follows
    references into other files."""
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
