"""Files written: records as MATLAB 5 and CSV, the same bytes for the same data; state spaces as MATLAB structs whose
fields are those of `ss`."""

import io
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from checks.arrays import Array
from hw.records.contents.variable import OWN_RECORD

HEADER = b"MATLAB 5.0 MAT-file, written by accept"
HEADER_TEXT_BYTES = 116  # [MATFILE]: free text at the head of the file
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")  # a name that MATLAB loads as a variable


def mat_bytes(mapping: Mapping[str, ArrayLike], compact: bool = False) -> bytes:
    """Return a MATLAB 5 file of name -> columns (N,) or numbers. No date: the same data give the same bytes.

    compact: compressed, which takes about ten times as long.

    Raises ValueError if a name is not a MATLAB variable, or if no reader here would accept the values back."""
    columns = {name: _real(name, values) for name, values in mapping.items()}
    out = io.BytesIO()
    from scipy.io import savemat  # loads slowly: only when wanted

    savemat(out, columns, oned_as="column", do_compression=compact)
    return HEADER.ljust(HEADER_TEXT_BYTES) + out.getvalue()[HEADER_TEXT_BYTES:]


def csv_bytes(mapping: Mapping[str, ArrayLike]) -> bytes:
    """Return a CSV file of name -> (N,) real numbers: a header row, then a row per sample, in the shortest digits that
    read back as the same double. Raises ValueError."""
    columns = [_real(name, values) for name, values in mapping.items()]
    lengths = {c.size for c in columns}
    if len(lengths) != 1:
        raise ValueError(f"columns have the lengths {sorted(lengths)}, expected one length")
    rows = zip(*(c.tolist() for c in columns), strict=True)
    lines = [",".join(mapping), *(",".join(map(repr, row)) for row in rows)]
    return ("\n".join(lines) + "\n").encode("ascii")


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


def ss_mat(matrices: Mapping[str, Array], states: Sequence[str], more: Mapping[str, Any]) -> bytes:
    """Return a MATLAB file with a struct `model`: A, B, C, D and the names and units of an ss object."""
    lists = {name: cells(value) if isinstance(value, list | tuple) else value for name, value in more.items()}
    return struct_bytes({"model": {**matrices, "StateName": cells(states), **lists}})


def cells(words: Sequence[str]) -> Any:
    """Return a column of cells of text, empty ones too."""
    cells = np.empty((len(words), 1), dtype=object)
    for i, word in enumerate(words):
        cells[i, 0] = word
    return cells


def struct_bytes(content: Mapping[str, Any]) -> bytes:
    """Return a MATLAB 5 file of name -> struct. No date: the same data give the same bytes."""
    from scipy.io import savemat  # loads slowly: only when wanted

    out = io.BytesIO()
    savemat(out, dict(content))
    return HEADER.ljust(HEADER_TEXT_BYTES) + out.getvalue()[HEADER_TEXT_BYTES:]
