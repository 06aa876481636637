"""Conversion of a parser's errors on damaged files into a RecordError; no other module does it."""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from checks.cause import Cause, because
from checks.errors import RecordError

# Errors that numpy, zlib and HDF5 raised, or document, on files with flipped bytes, cut ends and absurd sizes.
DAMAGE = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    BufferError,
    EOFError,
    LookupError,
    MemoryError,
    NotImplementedError,
    OSError,
    RecursionError,
    RuntimeError,
    SystemError,
    TypeError,
    ValueError,
    struct.error,
    zlib.error,
)


@contextmanager
def refused(file: str) -> Iterator[None]:
    """Turn every failure of a parser inside the block into a RecordError that names the file.

    Floating-point warnings are held back: a signalling NaN warns when it is cast, and is refused in words anyway."""
    try:
        with np.errstate(all="ignore"):
            yield
    except RecordError:
        raise
    except DAMAGE as e:
        words = " ".join(str(e).split())[:200]
        detail = f"{type(e).__name__}: {words}" if words else type(e).__name__
        raise RecordError(because(Cause.FILE_DAMAGED, file=file, detail=detail)) from e
