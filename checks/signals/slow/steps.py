"""Abrupt steps of a noisy, creeping signal: their number, times and settling."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from checks.arrays import Array

GRID_S = 0.01  # steps are first looked for on medians of 10 ms: spikes and ringing go, the cost stays bounded
LEVEL_S = 0.5  # stretch whose median is the level before or after a step
GAP_S = 0.2  # left out to either side: a hand needs up to 0.2 s to put a mass down
SAME_SIZE = 0.3  # of the largest jump: a smaller one is not a step of the same mass
ABOVE_SCATTER = 10.0  # times the scatter of the jumps elsewhere
ABOVE_CHANGE = 4.0  # times the usual change of those medians from one to the next
QUIET = 8.0  # times the usual change from sample to sample: a faster signal has not settled
TOUCH_S = 0.075  # a touch shorter than this is not yet the step
MIN_SAMPLES = 100  # one second at the 100 Hz that such records have
REACH_S = 2.0  # a step must settle within it


@dataclass(frozen=True)
class SignalStep:
    """One step of `height` [unit of y] at `t` [s], half-way up, with standard uncertainty `u_t` [s].

    quiet_from, quiet_to : the signal moves abruptly only between `quiet_to` (before) and `quiet_from` (after) [s]."""

    t: float
    u_t: float
    height: float
    quiet_to: float
    quiet_from: float


def find_steps(t: Array, y: Array) -> list[SignalStep]:
    """Return the steps in y (N,) over t (N,) [s], in time order; empty if nothing stands out of the scatter.

    A jump is the difference of the medians over 0.5 s after and before; a step is at the largest jump. Steps less than
    about 1 s apart blur into one another. Raises ValueError if the record is too short for a step."""
    if t.size < MIN_SAMPLES:
        raise ValueError(f"{t.size} samples are too few to hold a step, {MIN_SAMPLES} are needed")
    if (step := float(t[-1] - t[0]) / (t.size - 1)) > GAP_S:
        raise ValueError(f"sampled every {step:.3g} s, too slowly to see a step (every {GAP_S:g} s is needed)")
    per_grid = max(1, round(GRID_S * (t.size - 1) / (t[-1] - t[0])))
    used = t.size // per_grid * per_grid
    level = np.median(y[:used].reshape(-1, per_grid), axis=1)
    grid = t[:used].reshape(-1, per_grid).mean(axis=1)
    n_level, n_gap = (max(2, round(s * (grid.size - 1) / max(grid[-1] - grid[0], 1e-300))) for s in (LEVEL_S, GAP_S))
    if grid.size < 2 * (n_level + n_gap) + 2:
        raise ValueError(f"the record of {t[-1] - t[0]:.2g} s is too short to hold a step")
    medians = np.median(sliding_window_view(level, n_level), axis=1)
    apart = n_level + 2 * n_gap
    jump = medians[apart:] - medians[:-apart]
    at = np.arange(jump.size) + n_level + n_gap  # grid index in the middle of the gap
    scatter = 1.4826 * float(np.median(np.abs(jump - np.median(jump))))
    largest = float(np.abs(jump).max())
    floor = max(SAME_SIZE * largest, ABOVE_SCATTER * scatter, ABOVE_CHANGE * _usual_change(level))
    regions = [r for r in _regions(jump, floor) if r.size <= 2 * apart]  # a slow swing has no step in it
    moving = np.concatenate([_moving_until(t, y), _moving_until(grid, level)]) if regions else np.empty((0, 2))
    return [_locate(t, y, jump[r], grid[at[r]], moving) for r in regions]


def _moving_until(t: Array, y: Array) -> Array:
    """Return start and end (M, 2) of each interval of samples with far more change in y than usual."""
    fast = np.flatnonzero(np.abs(np.diff(y)) > QUIET * _usual_change(y))
    return np.column_stack([t[fast], t[fast + 1]])


def _usual_change(y: Array) -> float:
    change = np.abs(np.diff(y))
    # If the noise stays below the converter's step, most changes are zero: one step up or down is usual then.
    return max(1.4826 * float(np.median(change)), float(change[change > 0].min(initial=np.inf)))


def _regions(jump: Array, floor: float) -> list[NDArray[np.intp]]:
    """Return the unbroken stretches of indices with jumps of one sign beyond the floor."""
    beyond = np.flatnonzero(np.abs(jump) > floor)
    if beyond.size == 0 or floor == 0.0:
        return []
    sign = np.sign(jump[beyond])
    return np.split(beyond, np.flatnonzero((np.diff(beyond) > 1) | (np.diff(sign) != 0)) + 1)


def _locate(t: Array, y: Array, jump: Array, when: Array, moving: Array) -> SignalStep:
    """Return the time of the step in a region of jumps: the first passage midway between the two levels."""
    middle = float(np.median(when))
    height = float(jump[np.argmax(np.abs(jump))])
    before = float(np.median(y[(t >= middle - GAP_S - LEVEL_S) & (t <= middle - GAP_S)]))
    inside = np.flatnonzero((t >= middle - GAP_S - LEVEL_S / 2) & (t <= middle + GAP_S + LEVEL_S / 2))
    rise = (y[inside] - before) / height
    n = 2 * round(TOUCH_S / (t[1] - t[0])) + 1
    # The running median leaves the edge in its place and ignores a touch of the hand that is over before the mass is
    # down. It is beyond the middle where more than half of its samples are.
    count = np.cumsum(np.concatenate([[0], np.pad(rise > 0.5, n // 2, mode="edge")]))
    passed = inside[max(1, int(np.argmax(count[n:] - count[:-n] > n // 2)))]
    below = inside[(rise < 0.1) & (inside < passed)]
    above = inside[(rise > 0.9) & (inside >= passed)]
    lo = int(below[-1]) if below.size else int(passed) - 1
    hi = int(above[0]) if above.size else int(passed)
    dt = float(t[passed] - t[passed - 1])
    quiet_to, quiet_from = _quiet(float(t[lo]), float(t[hi]), moving)
    # The moment is equally likely anywhere between two samples; that of a slower passage is uncertain by about a tenth
    # of its duration, and more if motion goes on long after it (ringing, a second touch).
    doubts = (dt / np.sqrt(12.0), 0.1 * (t[hi] - t[lo] - dt), 0.02 * (quiet_from - t[hi]))
    u_t = float(np.linalg.norm(doubts))
    return SignalStep(float(t[passed]) - dt / 2, u_t, height, quiet_to, quiet_from)


def _quiet(lo: float, hi: float, moving: Array) -> tuple[float, float]:
    """Return (last quiet moment before, first quiet moment after) a passage from lo to hi [s]."""
    near = moving[(moving[:, 1] >= lo - REACH_S / 2) & (moving[:, 0] <= hi + REACH_S)]
    settled = float(near[:, 1].max(initial=hi))
    # A decay below the noise at `settled` continues: wait half as long again.
    return float(near[:, 0].min(initial=lo)), settled + 0.5 * (settled - hi)
