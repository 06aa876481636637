"""Branches of a cyclic drive, and the opening of the loop between a rising and a falling one."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

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
