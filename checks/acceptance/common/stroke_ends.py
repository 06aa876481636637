"""Displacement at the ends of the voltage range, and the drift of the gauge between them."""

import math

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.cause import Cause, NoResult
from checks.signals.slow.loops import ScalarEstimate
from checks.signals.slow.regression import least_squares

UM = 1e-6
MIN_SAMPLES = 12  # of a rest at an end of the range, for a mean and its scatter
MAX_FIRST = 0.05  # of the stroke, beside the opening that the first rise leaves
# That is, of the opening at mid-voltage, 0.8 if the loop contains the first rise and 2 if it is a settled one
# (Rayleigh's law; [DAMJANOVIC98]); half as much again for loops of another shape.
LEFT_OPEN = {False: 1.2, True: 3.0}
MAX_RETURN = 0.15  # of the stroke: later loops close but for creep, so larger differences are drift of the gauge


def drift(
    V: Array,
    d: Array,
    bottom: NDArray[np.bool_],
    start: ScalarEstimate,
    stroke: ScalarEstimate,
    reach: float,
    opening: float,
    settled: bool,
) -> float:
    """Return how far the gauge may have drifted over the record [m], from d each time V is back at its start.

    bottom: mask (N,) of V within `reach` [V] of its start; opening: that of the last loop at mid-voltage [m]; settled:
    whether that loop excludes the first rise.

    Settled loops close: the difference between later returns is drift. After one loop only, drift cannot be
    distinguished from the remanence of the first rise; the top lies midway, so half of it counts. Differences within
    the scatter do not count. Raises NoResult if d does not come back."""
    returns = _returns(V, d, bottom, reach)
    most = MAX_FIRST * stroke.value + LEFT_OPEN[settled] * opening
    for _, back in returns:
        left, later = back.value - start.value, back.value - returns[0][1].value
        if abs(left) > most or abs(later) > MAX_RETURN * stroke.value:
            raise NoResult(Cause.GAUGE_DRIFT, channel="d", value=left / UM, voltage=V[0], stroke=stroke.value / UM)
    if not returns:
        return 0.0
    if len(returns) == 1:
        return _beyond_scatter(returns[0][1], start) / 2
    (first, a), (last, b) = returns[0], returns[-1]
    return _beyond_scatter(a, b) * V.size / (last - first)


def drift_rate(V: Array, d: Array, bottom: NDArray[np.bool_], reach: float) -> float:
    """Return how far the gauge may drift in one sample [m], as a standard uncertainty: by the first and the last return
    of V to its start, and their scatter. 0 with fewer than two: only settled loops distinguish drift from remanence."""
    returns = _returns(V, d, bottom, reach)
    if len(returns) < 2:
        return 0.0
    (first, a), (last, b) = returns[0], returns[-1]
    return math.hypot(b.value - a.value, a.u, b.u) / (last - first)


def _returns(V: Array, d: Array, bottom: NDArray[np.bool_], reach: float) -> list[tuple[int, ScalarEstimate]]:
    """Return the first sample of each later interval in which V is back at its start, and the values of d there."""
    return [
        (lo, level(V - V[lo:hi].min(), d, lo + int(np.argmin(V[lo:hi])), bottom, reach))
        for lo, hi in stays(bottom)
        if lo > 0
    ]


def _beyond_scatter(a: ScalarEstimate, b: ScalarEstimate) -> float:
    return max(0.0, abs(a.value - b.value) - 3 * math.hypot(a.u, b.u))


def stays(zone: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the (first, last + 1) samples of each unbroken stretch of `zone` that is long enough for a fit."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zone, [False]]).astype(int)))
    return [(int(lo), int(hi)) for lo, hi in edges.reshape(-1, 2) if hi - lo >= MIN_SAMPLES]


def running_mean(x: Array, n: int) -> Array:
    """Return the mean over n samples about each one; the ends repeat the first and the last sample."""
    padded = np.pad(x, (n // 2, n - 1 - n // 2), mode="edge")
    return np.convolve(padded, np.full(n, 1.0 / n), mode="valid")


def highest(V: Array, d: Array, zone: NDArray[np.bool_], reach: float) -> ScalarEstimate:
    """Return the largest d while V is in the zone at its top. If only noise separates the highest intervals, their mean
    is used, because the largest would be too high."""
    tops = stays(zone)
    if not tops:
        raise NoResult(Cause.FEW_SAMPLES, samples=0, where="at the top of the voltage range", needed=MIN_SAMPLES)
    levels = [level(V - V[lo:hi].max(), d, lo + int(np.argmax(V[lo:hi])), zone, reach) for lo, hi in tops]
    best = max(levels, key=lambda one: one.value)
    alike = [one for one in levels if best.value - one.value <= 3 * math.hypot(best.u, one.u)]
    u = math.hypot(*(one.u for one in alike)) / len(alike)
    return ScalarEstimate(sum(one.value for one in alike) / len(alike), u)


def level(v: Array, d: Array, at: int, zone: NDArray[np.bool_], reach: float) -> ScalarEstimate:
    """Return d at the end of the range near sample `at`. v is the voltage from that end. Each branch in the unbroken
    stretch of `zone` is a parabola in v, and both meet at v = 0. In v, not in time, so that the drive may turn, break
    or hold."""
    out = np.flatnonzero(~zone)
    lo = int(out[out < at].max(initial=-1)) + 1
    hi = int(out[out > at].min(initial=zone.size))
    if hi - lo < MIN_SAMPLES:
        raise NoResult(Cause.FEW_SAMPLES, samples=hi - lo, where="at an end of the voltage range", needed=MIN_SAMPLES)
    s, after = v[lo:hi] / reach, np.arange(lo, hi) > at
    sides = [
        x for x in (np.where(after, 0.0, s), np.where(after, s, 0.0)) if (np.abs(x) > 0.3).sum() >= MIN_SAMPLES / 3
    ]
    design = np.column_stack([np.ones_like(s), *(power for x in sides for power in (x, x * x))])
    fit = least_squares(design, d[lo:hi])
    return ScalarEstimate(float(fit.x[0]), fit.u(np.eye(fit.x.size)[0]))
