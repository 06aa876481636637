"""Record files written: MATLAB 5 and CSV, the same bytes for the same data."""

import io
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hw.records.variable import OWN_RECORD

HEADER = b"MATLAB 5.0 MAT-file, written by accept"
HEADER_TEXT_BYTES = 116  # [MATFILE]: free text at the head of the file
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")  # what MATLAB loads as a variable


def mat_bytes(mapping: Mapping[str, ArrayLike], compact: bool = False) -> bytes:
    """Return MATLAB 5 file of name -> (N,) real numbers, as columns, or a number. No date: the same data give the same
    bytes.

    compact: compressed, which takes about ten times as long.

    Raises ValueError if a name is not a MATLAB variable, or if no reader here would accept the values back.
    """
    columns = {name: _real(name, values) for name, values in mapping.items()}
    out = io.BytesIO()
    from scipy.io import savemat  # loads slowly: only when wanted

    savemat(out, columns, oned_as="column", do_compression=compact)
    return HEADER.ljust(HEADER_TEXT_BYTES) + out.getvalue()[HEADER_TEXT_BYTES:]


def csv_bytes(mapping: Mapping[str, ArrayLike]) -> bytes:
    """Return CSV file of name -> (N,) real numbers of one length: a header row, then a row per sample, in the shortest
    digits that read back as the same double. Raises ValueError."""
    columns = [_real(name, values) for name, values in mapping.items()]
    lengths = {c.size for c in columns}
    if len(lengths) != 1:
        raise ValueError(f"columns have the lengths {sorted(lengths)}, expected one length")
    rows = zip(*(c.tolist() for c in columns), strict=True)
    lines = [",".join(mapping), *(",".join(map(repr, row)) for row in rows)]
    return ("\n".join(lines) + "\n").encode("ascii")


def write_mat(path: Path, mapping: Mapping[str, ArrayLike]) -> None:
    """Write `mat_bytes` into a file. Raises ValueError, and OSError if it cannot be written."""
    path.write_bytes(mat_bytes(mapping))


def write_csv(path: Path, mapping: Mapping[str, ArrayLike]) -> None:
    """Write `csv_bytes` into a file. Raises ValueError, and OSError if it cannot be written."""
    path.write_bytes(csv_bytes(mapping))


def _real(name: str, values: ArrayLike) -> np.ndarray:
    if not NAME.fullmatch(name):
        raise ValueError(
            f"{name!r} is not a channel name; expected letters, digits and '_', a letter first, at most 63"
        )
    array = np.asarray(values)
    if array.dtype.kind not in "iuf" or array.ndim > 1 or not array.size or not np.isfinite(array).all():
        raise ValueError(f"'{name}' is {array.dtype} {array.shape}, expected a vector of finite real numbers")
    return np.atleast_1d(array.astype(np.float64))


def own_record(arrays: Mapping[str, ArrayLike]) -> bytes:
    """Return the bytes of a .mat file with our names for the channels, in SI. A mark in it states that, so that the
    channel map of a laboratory is not applied to it."""
    return mat_bytes({**arrays, OWN_RECORD: np.ones(1)})
