"""A chart of the repeated measurements of one part, without a baseline: each value against all good ones before it.

A part that is measured again and again has few values when its chart begins. The distance of a value from the mean of
those before it, in their standard deviation, is a t value whose chance is known exactly however few they are; as a
score of a normal distribution it goes into cumulative sums ([Hawkins87]; [Montgomery] 9.1). Scores of a process in
control are independent and standard normal from the fourth value on, so the limits need no simulation.

The first comparisons know their spread badly. Of a short chart all values are looked at afterwards too: for a step, or
a drift that grows, in any stretch of them, against all others.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtr

from accept.fleet.process_control.control_chart import (
    ALLOWANCE,
    SHIFT,
    VALUE,
    Alarm,
    Baseline,
    Chart,
    finite,
    shift_length,
)
from accept.fleet.process_control.spread import most_sigmas
from checks.arrays import Array

AGAIN = 3  # values after a shift that end it
BEFORE = 3  # values before the first that is compared
OF_SUMS = 0.75  # share of the chance of a false alarm that the sums have; single values have the rest
SCANNED = 60  # values up to which a chart is scanned afterwards as well: many more are enough for the sums
# Repeatabilities by which the later half of so many values must shift, or drift by its end, so that nine of ten charts
# with a chance of 0.4 % show it (2 % for five quantities); simulated, known to 10 %. To ring takes a fifth more.
_FOUND = {8: (8.8, 10.9), 13: (5.3, 7.0), 20: (3.5, 4.8), 30: (2.6, 3.5), 60: (1.6, 2.3), 130: (1.0, 1.5)}
FEWEST = min(_FOUND)
_OVERSHOOT = 1.166  # sigmas by which a sum exceeds its limit on average, twice 0.583 ([Siegmund])


def part_chart(values: Array, chance: float) -> Chart:
    """Return the chart of values (N,) of one part in the order of measurement. baseline: of the good values, those that
    no alarm is about (sigma 0 for fewer than two); lower, upper: limits of one more value.

    chance: that the chart of a bench in control rings anywhere. Raises ValueError for a value that is not finite.
    """
    x = finite(values)
    is_scanned = 2 * BEFORE < x.size <= SCANNED
    whole, chance = chance, chance / 2.0 if is_scanned else chance
    limit = sums_limit(x.size, OF_SUMS * chance)
    single = most_sigmas(x.size, np.inf, (1.0 - OF_SUMS) * chance)
    rounding = _rounding(x)
    good, near = np.ones(x.size, dtype=bool), np.ones(x.size, dtype=bool)
    sums, now = np.zeros((x.size, 2)), np.zeros(2)
    left_zero, runs, ringing = np.zeros(2, dtype=int), list[tuple[int, int]](), False
    for i in range(x.size):
        before = x[:i][good[:i]]
        if (z := score(x[i], before, rounding)) is not None:
            held = np.clip(z, -single, single)  # one gross value is no shift
            left_zero[now == 0.0] = i
            now = np.clip(now + np.array([held, -held]) - ALLOWANCE, 0.0, limit)
            good[i] = near[i] = abs(z) < single
            if ringing:
                first = runs[-1][0]
                last = first + shift_length(x[first : i + 1] - before.mean()) - 1
                runs[-1] = first, last
                good[first : i + 1] = near[first : i + 1] & (np.arange(first, i + 1) > last)
                if i - last >= AGAIN:
                    ringing, now = False, np.zeros(2)
            elif now.max() >= limit:
                runs.append((int(left_zero[np.argmax(now)]), i))
                ringing, good[runs[-1][0] : i + 1] = True, False
        sums[i] = now
    if is_scanned and not runs and (run := stretch(x, np.flatnonzero(good), whole - chance, rounding)):
        runs.append(run)
        good[run[0] : run[1] + 1] = False
    kept = x[good]
    base = Baseline(
        float(kept.mean()), float(kept.std(ddof=1)) if kept.size > 1 else 0.0, kept.size, x.size - kept.size
    )
    gross = [i for i in map(int, np.flatnonzero(~good)) if not any(first <= i <= last for first, last in runs)]
    level, alarms = np.full_like(x, base.mean), list[Alarm]()
    for rule, first, last in (*((VALUE, i, i) for i in gross), *((SHIFT, *run) for run in runs)):
        n, size = last - first + 1, float(x[first : last + 1].mean()) - base.mean
        alarms.append(Alarm(rule, first, last, size, base.U_of_mean(n), n))
        level[first : last + 1] += size if rule == SHIFT else 0.0
    half = single * base.sigma
    alarms.sort(key=lambda a: a.first)
    return Chart(x, base, base.mean - half, base.mean + half, level, sums, limit, tuple(alarms))


def stretch(x: Array, kept: NDArray[np.intp], chance: float, rounding: float) -> tuple[int, int] | None:
    """Return the first and last of the values in which x[kept] shows a step, or a drift that grows, most clearly, after
    the first `BEFORE`; None if values in control show one as clear with this chance. rounding: as in `score`.

    Bonferroni's bound of Student's t of as many regressions as there are stretches of two or more."""
    y, n = x[kept], kept.size
    if n < BEFORE + 2 or np.ptp(y) == 0.0:
        return None
    ends, shapes, squares = _shapes(n)
    y = y - y.mean()
    explained = (shapes @ y) ** 2 / squares / (y @ y)
    best = int(np.argmax(explained))
    rest = (1.0 - explained[best]) * (y @ y) + n * rounding**2
    if explained[best] * (y @ y) * (n - 2) <= most_sigmas(len(shapes), n - 2, chance) ** 2 * rest:
        return None
    first, end = ends[best % len(ends)]
    return int(kept[first]), int(kept[end - 1])


@lru_cache(maxsize=8)
def _shapes(n: int) -> tuple[list[tuple[int, int]], Array, Array]:
    """Return the first and end of each stretch of n values, its step and its drift about their means, and the sums of
    their squares."""
    ends, at = [(i, k) for i in range(BEFORE, n - 1) for k in range(i + 2, n + 1)], np.arange(n)
    inside = np.array([(at >= i) & (at < k) for i, k in ends], dtype=float)
    shapes = np.concatenate([inside, inside * (at - np.array(ends)[:, :1] + 1)])
    shapes -= shapes.mean(axis=1, keepdims=True)
    return ends, shapes, (shapes**2).sum(axis=1)


def score(value: float, before: Array, rounding: float) -> float | None:
    """Return the distance of a value from the good ones before it as a score of a normal distribution; None if those
    are fewer than `BEFORE`, or equal with a rounding of 0. rounding: its standard deviation."""
    if before.size < BEFORE or (sigma := float(np.hypot(before.std(ddof=1), rounding))) == 0.0:
        return None
    t = (value - before.mean()) / (sigma * np.sqrt(1.0 + 1.0 / before.size))
    return float(np.sign(t) * -ndtri(stdtr(before.size - 1, -abs(t))))


def findable_change(n: int) -> tuple[float, float] | None:
    """Return the shift and the drift of the later half of n values that nine of ten charts show, in standard deviations
    of the values; None for fewer than `FEWEST`."""
    if n < FEWEST:
        return None
    at, known = np.log([*_FOUND]), np.log([*_FOUND.values()])
    step, drift = (float(np.exp(np.interp(np.log(n), at, sizes))) for sizes in known.T)
    return step, drift


def sums_limit(n: int, chance: float) -> float:
    """Return the limit of the larger of two cumulative sums that n independent standard normal values exceed with a
    chance: the average run length of one sum is (exp(b) - b - 1) / (2 k^2) with b = 2 k (h + 1.166) ([Siegmund];
    [Montgomery] eq. 9.6), k = `ALLOWANCE`."""
    wanted = 2.0 * n / -np.log1p(-chance) * 2.0 * ALLOWANCE**2
    b = np.log(wanted)
    for _ in range(20):  # exp(b) = wanted + b + 1
        b = np.log(wanted + b + 1.0)
    return max(0.0, float(b) / (2.0 * ALLOWANCE) - _OVERSHOOT)


def _rounding(x: Array) -> float:
    """Return the standard deviation of rounding to the smallest step between values: equal readings of a coarse meter
    do not show that it repeats exactly."""
    steps = np.diff(np.unique(x))
    return float(steps.min()) / np.sqrt(12.0) if steps.size else 0.0
