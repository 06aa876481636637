"""Outliers of a small fleet: robust scores, and a test with a stated rate of false alarms.

The k farthest from the median are set aside, k from nearly half of the fleet down to 1, and the nearest of the k is
compared with all others: generalised extreme studentised deviates (Rosner 1983, Technometrics 25), written with the t
statistic of a new value. So two bad units cannot mask each other, and few units suffice."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks import distributions as stats
from checks.arrays import Array

CHANCE = 0.01  # probability that a fleet without outliers has a unit flagged
MIN_UNITS = 4  # of three, one odd unit and two odd units look the same
MAD_TO_SD = 1.4826  # 1 / the upper quartile of the standard normal distribution
# Small-sample factors of the median deviation (Croux & Rousseeuw 1992, COMPSTAT); n/(n - 0.8) beyond.
_SMALL = {2: 1.196, 3: 1.495, 4: 1.363, 5: 1.206, 6: 1.200, 7: 1.140, 8: 1.129, 9: 1.107}


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of n values: median; scale, the robust standard deviation; score (n,) = (value - median) over scale and
    the value's own uncertainty together; p (n,) the probability of so far a value by chance in the whole fleet (1: not
    among the farthest); outlier (n,)."""

    median: float
    scale: float
    score: Array
    p: Array
    outlier: NDArray[np.bool_]


def robust_scale(x: Array) -> float:
    """Return the standard deviation of x (n,) by the median deviation from the median, unbiased for normal samples."""
    factor = _SMALL.get(x.size, x.size / (x.size - 0.8)) if x.size > 1 else 1.0
    return MAD_TO_SD * factor * float(np.median(np.abs(x - np.median(x))))


def scores(x: Array, u: Array | None = None, chance: float = CHANCE, only_high: bool = False) -> Scores:
    """Return the scores of values x (n,) with standard uncertainties u (n,), default 0.

    A value's own uncertainty is added to the scale, so that values which differ by less than their uncertainties are
    never flagged; so is the grid on which rounded values lie. only_high: small values are never odd. Raises ValueError
    if there are fewer than 4 values, NaN or inf."""
    u = np.zeros(x.size) if u is None else u
    if x.size < MIN_UNITS:
        raise ValueError(f"{x.size} value(s); {MIN_UNITS} or more are needed to call one odd")
    if not (np.isfinite(x).all() and np.isfinite(u).all() and (u >= 0).all()):
        raise ValueError("values and uncertainties must be finite numbers")
    uncertainty = np.hypot(u, _grid(x) / math.sqrt(12))
    median, scale = float(np.median(x)), robust_scale(x)
    total = np.hypot(scale, uncertainty)
    score = (x - median) / np.where(total > 0, total, 1.0)
    p = _probabilities(x, uncertainty, median, only_high)
    return Scores(median, scale, score, p, p < chance)


def _grid(x: Array) -> float:
    """Return the smallest difference between unequal values, the resolution with which they were written."""
    steps = np.diff(np.unique(x))
    return float(steps.min()) if steps.size else 0.0


def _probabilities(x: Array, u: Array, median: float, only_high: bool) -> Array:
    """Return the probability of each of the farthest values: the smallest p of all sets that contain it."""
    away = x - median if only_high else np.abs(x - median)
    order = np.argsort(-away, kind="stable")
    p, most = np.ones(x.size), (x.size - 1) // 2
    sets = min(most, 2)  # several sets are tried, all of nearly the same values: by simulation, as if there were two
    for k in range(most, 0, -1):
        odd, rest = order[:k], order[k:]
        one = _chance_against(float(x[odd[-1]]), float(u[odd[-1]]), x[rest], only_high)
        p[odd] = np.minimum(p[odd], min(1.0, sets * one * (rest.size + 1)))
    return p


def _chance_against(value: float, u: float, rest: Array, only_high: bool) -> float:
    """Return the probability p of a new value against a sample (Student's t, both sides unless only_high)."""
    spread = math.hypot(float(np.std(rest, ddof=1)) * math.sqrt(1 + 1 / rest.size), u)
    apart = value - float(np.mean(rest))
    if spread == 0.0:
        return 1.0 if apart == 0.0 else 0.0
    size = apart if only_high else abs(apart)
    return float((1 if only_high else 2) * stats.t.sf(size / spread, rest.size - 1))
