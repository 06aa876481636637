"""Transforms of whole channels, which several checks of a record use."""

from weakref import finalize

import numpy as np
import scipy.fft

from checks.arrays import Array, Complex

KEPT_SAMPLES = 4_000_000  # of all channels whose transforms are kept: 32 MB
_KEPT: dict[tuple[int, int], Complex] = {}  # by the channel and the number of its samples


def fast_length(x: Array) -> int:
    """Return the number of first samples of a channel (N,), N or a few less, whose transform is made several times as
    fast as one of a length with a large prime factor."""
    return int(scipy.fft.prev_fast_len(x.size, real=True))


def transform(x: Array, n: int | None = None) -> Complex:
    """Return the transform (n // 2 + 1,) of the first n samples of a channel (N,), by default all, without their mean.
    That of an array that cannot change, as in a record that was read, is kept as long as the array is."""
    key = id(x), n or x.size
    if (kept := _KEPT.get(key)) is not None:
        return kept
    first = x[: key[1]]
    X: Complex = scipy.fft.rfft(first - np.mean(first))
    if not x.flags.writeable and 2 * sum(one.size for one in _KEPT.values()) + first.size <= KEPT_SAMPLES:
        X.flags.writeable = False
        _KEPT[key] = X
        finalize(x, _KEPT.pop, key)
    return X
