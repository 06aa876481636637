"""A chart of the repeated measurements of one part, without a baseline: each value against all good ones before it.

A part that is measured again and again has few values when its chart begins. The distance of a value from the mean of
those before it, in their standard deviation, is a t value whose chance is known exactly however few they are; as a
score of a normal distribution it goes into cumulative sums ([Hawkins87]; [Montgomery] 9.1). Scores of a process in
control are independent and standard normal from the fourth value on, so the limits need no simulation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtr

from accept.fleet.process_control.control_chart import ALLOWANCE, SHIFT, VALUE, Alarm
from checks.arrays import Array

AGAIN = 3  # values after a shift that end it
BEFORE = 3  # values before the first that is compared
OF_SUMS = 0.75  # share of the chance of a false alarm that the sums have; single values have the rest
_OVERSHOOT = 1.166  # sigmas by which a sum exceeds its limit on average, twice 0.583 ([Siegmund])


@dataclass(frozen=True, eq=False)
class PartChart:
    """values (N,) of one part. scores (N,): standard normal in control, NaN for values that are not compared; sums
    (N, 2), upwards and downwards; good (N,): what no alarm is about; mean, sigma: of the good ones (sigma 0 for
    fewer than two); lower, upper: limits of one more value; alarms by their first value."""

    values: Array
    scores: Array
    sums: Array
    sums_limit: float
    good: Array
    mean: float
    sigma: float
    lower: float
    upper: float
    alarms: tuple[Alarm, ...]


def part_chart(values: Array, chance: float) -> PartChart:
    """Return the chart of values (N,) of one part in the order of measurement.

    chance: that the chart of a bench in control rings anywhere. Raises ValueError for a value that is not finite.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise ValueError(f"{x.size} values, expected one or more, all finite")
    limit, single = sums_limit(x.size, OF_SUMS * chance), -float(ndtri((1.0 - OF_SUMS) * chance / (2.0 * x.size)))
    rounding = _rounding(x)
    scores, sums, good = np.full(x.size, np.nan), np.zeros((x.size, 2)), np.ones(x.size, dtype=bool)
    now, left_zero, runs, ringing = np.zeros(2), np.zeros(2, dtype=int), list[list[int]](), False
    for i in range(x.size):
        before = x[:i][good[:i]]
        if before.size >= BEFORE and (sigma := float(np.hypot(before.std(ddof=1), rounding))) > 0.0:
            t = (x[i] - before.mean()) / (sigma * np.sqrt(1.0 + 1.0 / before.size))
            scores[i] = np.sign(t) * -ndtri(stdtr(before.size - 1, -abs(t)))
            held = np.clip(scores[i], -single, single)  # one gross value is no shift
            left_zero[now == 0.0] = i
            now = np.clip(now + np.array([held, -held]) - ALLOWANCE, 0.0, limit)
            good[i] = abs(scores[i]) < single
            if not ringing and now.max() >= limit:
                runs.append([int(left_zero[np.argmax(now)]), i])
                ringing, good[runs[-1][0] : i + 1] = True, False
            elif ringing:
                first = runs[-1][0]
                runs[-1][1] = last = _end(x[first : i + 1] - before.mean()) + first
                good[first : i + 1] = np.arange(first, i + 1) > last
                if i - last >= AGAIN:
                    ringing, now = False, np.zeros(2)
        sums[i] = now
    kept = x[good]
    mean, sigma = float(kept.mean()), float(kept.std(ddof=1)) if kept.size > 1 else 0.0
    half = single * sigma
    gross = [int(i) for i in np.flatnonzero(~good) if not any(a <= i <= b for a, b in runs)]
    alarms = [_alarm(x, VALUE, i, i, mean, sigma, kept.size) for i in gross]
    alarms += [_alarm(x, SHIFT, first, last, mean, sigma, kept.size) for first, last in runs]
    return PartChart(
        x,
        scores,
        sums,
        limit,
        good,
        mean,
        sigma,
        mean - half,
        mean + half,
        tuple(sorted(alarms, key=lambda a: a.first)),
    )


def _end(off: Array) -> int:
    """Return the index of the last value of a shift among values (n,) since its first, as distances from the mean
    before it: the maximum-likelihood one."""
    return int(np.argmax(np.cumsum(off) ** 2 / np.arange(1, off.size + 1)))


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


def _alarm(x: Array, rule: str, first: int, last: int, mean: float, sigma: float, n: int) -> Alarm:
    size = float(x[first : last + 1].mean()) - mean
    U = 2.0 * sigma * float(np.sqrt(1.0 / (last - first + 1) + 1.0 / n))
    return Alarm(rule, int(first), int(last), "up" if size > 0 else "down", size, U, int(last - first + 1))
