"""Branches of a cyclic drive, and the opening of the loop between a rising and a falling one; periods of slow sines in
a drive whose amplitude grows, found in the data, with any offset, pauses and ramps."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.signals.slow.regression import least_squares

TURN = 0.8  # of the amplitude: beyond it a branch counts as having reached its end
NEAR_MIDDLE = (
    0.15  # of the amplitude: half-width of the local fit of a branch, wide enough to average, still a parabola
)
MIN_SAMPLES = 8  # for a line through a branch and its scatter
MAX_DRAWN = 1500  # points of a curve in a picture


@dataclass(frozen=True)
class ScalarEstimate:
    """A value and its standard uncertainty from the scatter of the samples, in the value's unit."""

    value: float
    u: float


@dataclass(frozen=True)
class Branch:
    """Samples start..stop (included) of a drive that runs from one turning point to the next."""

    start: int
    stop: int
    rising: bool

    @property
    def samples(self) -> slice:
        return slice(self.start, self.stop + 1)


def branches(drive: Array, middle: float, amplitude: float) -> list[Branch]:
    """Return the rising and falling branches of a drive (N,) about `middle`, in order. A turning point is the extreme
    of each interval beyond `TURN` of the amplitude, so that noise and ripple make no extra turn."""
    side = np.where(drive > middle + TURN * amplitude, 1, np.where(drive < middle - TURN * amplitude, -1, 0))
    outside = np.flatnonzero(side)
    if outside.size == 0:
        return []
    cuts = np.flatnonzero(np.diff(side[outside])) + 1
    stays = np.split(outside, cuts)
    turns = [int(s[np.argmax(drive[s] * side[s[0]])]) for s in stays]
    return [Branch(a, b, bool(side[b] > 0)) for a, b in pairwise(turns)]


def branch_at(drive: Array, response: Array, branch: Branch, at: float, reach: float) -> ScalarEstimate:
    """Return the response of one branch at the drive `at`, by a parabola over the samples within `reach` of it.

    Raises ValueError for fewer than `MIN_SAMPLES` samples."""
    v = (drive[branch.samples] - at) / reach
    near = np.abs(v) <= 1.0
    if near.sum() < MIN_SAMPLES:
        raise ValueError(f"only {near.sum()} samples near mid-voltage on one branch, {MIN_SAMPLES} are needed")
    fit = least_squares(np.vander(v[near], 3, increasing=True), response[branch.samples][near])
    return ScalarEstimate(float(fit.x[0]), fit.u(np.array([1.0, 0.0, 0.0])))


def opening(
    drive: Array, response: Array, pair: tuple[Branch, Branch], middle: float, amplitude: float
) -> ScalarEstimate:
    """Return the width of the loop at mid-drive: response on the falling branch minus that on the rising one, so a
    response that lags its drive opens positively. Raises ValueError if a branch has too few samples there."""
    reach = NEAR_MIDDLE * amplitude
    first, second = (branch_at(drive, response, b, middle, reach) for b in pair)
    sign = -1.0 if pair[1].rising else 1.0
    return ScalarEstimate(sign * (second.value - first.value), float(np.hypot(first.u, second.u)))


def last_pair(found: list[Branch]) -> tuple[Branch, Branch] | None:
    """Return the last two adjoining branches: the loop is most settled there."""
    return (found[-2], found[-1]) if len(found) >= 2 else None


def longest_stand(drive: Array, response: Array) -> tuple[int, float]:
    """Return (first sample, range of the drive in its unit) of the interval over which a response (N,) repeats one
    value while the drive (N,) moves furthest: it is held, stuck or clipped there."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(response)) + 1])
    passed = np.maximum.reduceat(drive, starts) - np.minimum.reduceat(drive, starts)
    worst = int(np.argmax(passed))
    return int(starts[worst]), float(passed[worst])


def thin(values: Array) -> Array:
    """Return at most about `MAX_DRAWN` of the values (N,), evenly taken: a picture needs no more."""
    return values[:: max(1, values.size // MAX_DRAWN)]


SINE_SAMPLES = 50  # per period, at least
NO_SINE = 0.02  # rms of the residual of a sine, relative to its amplitude: above it the drive was changing
SAME_AMPLITUDE = 0.02
ABOVE_NOISE = 5.0
REFINEMENTS = 4


@dataclass(frozen=True, eq=False)
class Cycle:
    """One period of a drive: samples start..stop (excluded); amplitude and centre in the drive's unit; angle (n,) [rad]
    of the fitted sine, 0 on the way up through the centre."""

    start: int
    stop: int
    amplitude: float
    centre: float
    angle: Array

    @property
    def samples(self) -> slice:
        return slice(self.start, self.stop)


def last_cycles(drive: Array) -> list[Cycle]:
    """Return the last whole period of each amplitude in a drive (N,), by growing amplitude."""
    found: list[Cycle] = []
    for cycle in sine_cycles(drive):
        same = [i for i, c in enumerate(found) if abs(c.amplitude / cycle.amplitude - 1) <= SAME_AMPLITUDE]
        if same:
            found[same[0]] = cycle
        else:
            found.append(cycle)
    return sorted(found, key=lambda c: c.amplitude)


def sine_cycles(drive: Array) -> list[Cycle]:
    """Return every period of a drive (N,) that is a sine about the middle of its range, in time order."""
    if drive.size < SINE_SAMPLES:
        return []
    middle = (drive.max() + drive.min()) / 2
    ups, downs = _passages(drive, float(middle))
    cycles = (_cycle(drive, int(up), _period(int(up), ups, downs)) for up in ups)
    return [c for c in cycles if c is not None]


def _passages(drive: Array, middle: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first samples after the drive's passages up and down through the middle, without those of noise."""
    trembling = ABOVE_NOISE * float(np.median(np.abs(np.diff(drive, 2)))) / math.sqrt(6.0)
    side = np.where(drive > middle + trembling, 1, np.where(drive < middle - trembling, -1, 0))
    clear = np.flatnonzero(side)
    turns = np.flatnonzero(np.diff(side[clear]))
    after = clear[turns + 1]
    up = side[after] > 0
    return after[up], after[~up]


def _period(up: int, ups: NDArray[np.intp], downs: NDArray[np.intp]) -> int | None:
    """Return the number of samples of the period that begins at `up`: to the next passage upwards, or twice the half
    period if a pause, a change of amplitude or the end of the record follows."""
    later_downs, later_ups = downs[downs > up], ups[ups > up]
    if later_downs.size == 0:
        return None
    twice = 2 * (int(later_downs[0]) - up)
    whole = int(later_ups[0]) - up if later_ups.size else 0
    return whole if abs(whole - twice) <= 0.1 * twice else twice


def _cycle(drive: Array, start: int, period: int | None) -> Cycle | None:
    """Return the cycle if a sine describes it, its frequency fitted too (four-parameter fit of [IEEE1057],
    Gauss-Newton)."""
    if period is None or period < SINE_SAMPLES or start + 0.99 * period > drive.size:
        return None
    stop = min(start + period, drive.size)
    n = np.arange(stop - start)
    y, rate = drive[start:stop], 2 * math.pi / period
    for _ in range(REFINEMENTS):
        sine, cosine = np.sin(rate * n), np.cos(rate * n)
        base = np.column_stack([np.ones(n.size), sine, cosine])
        centre, a, b = np.linalg.lstsq(base, y, rcond=None)[0]
        slope = n * (a * cosine - b * sine)
        rate += float(np.linalg.lstsq(np.column_stack([base, slope]), y, rcond=None)[0][3])
    amplitude = math.hypot(a, b)
    residual = y - base @ [centre, a, b]
    if not float(np.sqrt(np.mean(residual**2))) <= NO_SINE * amplitude:
        return None
    return Cycle(start, stop, amplitude, float(centre), np.asarray(rate * n + math.atan2(b, a)))
