"""Recursive filters in time, moving means, and peaks of a curve, as scipy.signal and scipy.ndimage have them: loading
those packages takes as long as judging an APA."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas

from checks.arrays import Array, Complex

# Of the high-pass: far below a part's modes, and high enough that a sensor's slow noise does not hide its rest.
CORNER_Hz, DAMPING = 30.0, 0.7


def integrated(x: Array, fs: float, times: int) -> Array:
    """Return x (N,) at fs [Hz], integrated once or twice above 30 Hz: s^(2 - times) / (s^2 + 1.4 w0 s + w0^2).

    It is causal, so nothing rings before a hit, and adds one pole pair at 30 Hz; above 60 Hz its magnitude is that of
    an integration within 3 %, and a mode's frequency and damping stay as they are. Raises ValueError."""
    if times not in (1, 2):
        raise ValueError(f"integrated {times} times: expected 1 or 2")
    w, s = 2.0 * np.pi * CORNER_Hz, 2.0 * fs
    scale, a = second_order(w, 2.0 * DAMPING * w * s, s)
    b = [scale, 2.0 * scale, scale] if times == 2 else [s * scale, 0.0, -s * scale]
    return recursion(b, a, x - np.median(x))  # the offset of a sensor would begin as a step


_Series = TypeVar("_Series", Array, Complex)
_EXTENSION = 15  # samples that the record is continued by at each end, turned about the end point: as scipy.signal does


def recursion(b: Sequence[complex], a: Sequence[complex], x: _Series) -> _Series:
    """Return y (N,) of a[0] y[n] + a[1] y[n - 1] + ... = b[0] x[n] + b[1] x[n - 1] + ... from rest; a[0] is 1. The
    samples of y solve a triangular band matrix ([OPPENHEIM10] 6.1). Complex coefficients need a complex x."""
    band = np.empty((len(a), x.size), dtype=x.dtype, order="F")
    band[:] = np.asarray(a, dtype=x.dtype)[:, None]
    moving = np.convolve(x, np.asarray(b, dtype=x.dtype))[: x.size]
    solve = blas.ztbsv if np.iscomplexobj(x) else blas.dtbsv
    y: _Series = solve(len(a) - 1, band, moving, lower=1, diag=1, overwrite_x=True)
    return y


def smooth_lowpass(x: Array, fs: float, corner_Hz: float) -> Array:
    """Return x (N,), sampled at fs [Hz], through a Butterworth low-pass of fourth order forwards and backwards: no
    delay, and half of the amplitude at the corner. At both ends the record is extended by its reflection about the end
    point, and the filter starts in the steady state of the first value."""
    k = min(_EXTENSION, x.size - 1)
    y = np.concatenate([2 * x[0] - x[k:0:-1], x, 2 * x[-1] - x[-2 : -k - 2 : -1]])
    for _ in range(2):
        start = y[0]
        y = y - start
        for b, a in _butterworth(corner_Hz / fs):
            y = recursion(b, a, y)
        y = (y + start)[::-1]
    return np.asarray(y[k : y.size - k])


def _butterworth(corner: float) -> list[tuple[list[float], list[float]]]:
    """Return (b, a) of both sections of fourth order for a corner in cycles a sample, by the bilinear transform with
    the corner kept ([OPPENHEIM10] 7.2)."""
    w = np.tan(np.pi * corner)
    sections = []
    for half_turn in (np.pi / 8, 3 * np.pi / 8):
        scale, a = second_order(w, 2.0 * np.cos(half_turn) * w)
        gain = w * w * scale
        sections.append(([gain, 2.0 * gain, gain], a))
    return sections


def second_order(w: float, damping: float, s: float = 1.0) -> tuple[float, list[float]]:
    """Return the scale of the numerator, and a, of 1 / (p^2 + damping p / s + w^2) by the bilinear transform: p is
    s (1 - 1/z) / (1 + 1/z) ([OPPENHEIM10] 7.2)."""
    scale = 1.0 / (s * s + damping + w * w)
    return scale, [1.0, 2.0 * (w * w - s * s) * scale, (s * s - damping + w * w) * scale]


def moving_mean(x: Array, count: int) -> Array:
    """Return the mean of `count` neighbours along the first axis of x (N, ...); of an even number, one more before than
    after. Beyond its ends x keeps its first and last value. By a running sum, as scipy.ndimage.uniform_filter1d."""
    before = count // 2
    around = np.pad(x, [(before, count - 1 - before)] + [(0, 0)] * (x.ndim - 1), mode="edge")
    first = np.cumsum(around[:count], axis=0)[-1:]
    return np.asarray(np.cumsum(np.concatenate([first, around[count:] - around[:-count]]), axis=0) / count)


def peaks(x: Array, prominence: float, distance: int = 1, height: Array | None = None) -> NDArray[np.intp]:
    """Return the indices of the maxima of x (N,), of a flat top its middle, in order: at least as high as `height`
    (N,), the highest of all within less than `distance` samples, and standing out by `prominence` above the higher of
    the two lowest points between it and the next higher one on each side. As scipy.signal.find_peaks."""
    tops = _maxima(x)
    if height is not None:
        tops = tops[x[tops] >= height[tops]]
    tops = tops[_highest_around(tops, x[tops], distance)]
    return np.asarray([k for k in tops if _prominence(x, int(k)) >= prominence], dtype=np.intp)


def _maxima(x: Array) -> NDArray[np.intp]:
    """Return the middle of each run of equal values that is above both of its neighbours."""
    first = np.flatnonzero(np.concatenate([[True], x[1:] != x[:-1]]))
    last = np.append(first[1:], x.size) - 1
    level = x[first]
    top = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])) + 1
    return np.asarray((first[top] + last[top]) // 2)


def _highest_around(at: NDArray[np.intp], height: Array, distance: int) -> NDArray[np.bool_]:
    """Return which points at (P,) have no higher one within less than `distance` samples, apart from removed ones."""
    stays = np.ones(at.size, dtype=bool)
    for k in np.argsort(height)[::-1]:
        if stays[k]:
            stays[np.searchsorted(at, at[k] - distance, "right") : np.searchsorted(at, at[k] + distance)] = False
            stays[k] = True
    return stays


def _prominence(x: Array, top: int) -> float:
    """Return the height of a maximum over the higher of the lowest points towards a higher one on either side."""
    higher = np.flatnonzero(x > x[top])
    place = int(np.searchsorted(higher, top))
    lo = int(higher[place - 1]) + 1 if place else 0
    hi = int(higher[place]) if place < higher.size else x.size
    return float(x[top] - max(x[lo : top + 1].min(), x[top:hi].min()))
