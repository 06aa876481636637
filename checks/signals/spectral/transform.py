"""Transforms of whole channels, which several checks of a record use."""

from weakref import finalize

import numpy as np
import scipy.fft

from checks.arrays import Array, Complex

KEPT_SAMPLES = 4_000_000  # of all channels whose transforms are kept: 32 MB
_KEPT: dict[int, Complex] = {}  # by the channel


def transform(x: Array) -> Complex:
    """Return the transform (N // 2 + 1,) of a channel (N,) without its mean. That of an array that cannot change, as in
    a record that was read, is kept as long as the array is."""
    if (kept := _KEPT.get(id(x))) is not None:
        return kept
    X: Complex = scipy.fft.rfft(x - np.mean(x))
    if not x.flags.writeable and 2 * sum(one.size for one in _KEPT.values()) + x.size <= KEPT_SAMPLES:
        X.flags.writeable = False
        _KEPT[id(x)] = X
        finalize(x, _KEPT.pop, id(x))
    return X
