"""Periods of slow sines in a drive whose amplitude grows: found in the data, with any offset, pauses and ramps."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array

MIN_SAMPLES = 50  # per period
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
    if drive.size < MIN_SAMPLES:
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
    if period is None or period < MIN_SAMPLES or start + 0.99 * period > drive.size:
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
