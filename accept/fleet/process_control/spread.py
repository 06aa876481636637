"""The spread within a process, from differences of consecutive values: a drift or a step does not widen it."""

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import stdtrit

from checks.arrays import Array

AROUND = 31  # values whose median is the level of the process there

D2 = 1.128379167095513  # mean range of two normal values / sigma: 2 / sqrt(pi)
MEDIAN_RANGE = 0.9538725524  # median range of two normal values / sigma: sqrt(2) times the upper quartile


def moving_range_sigma(values: Array) -> float:
    """Return the standard deviation within a process from the mean moving range of values (n,) ([Montgomery] 6.4)."""
    return float(np.abs(np.diff(values)).mean()) / D2


def robust_sigma(values: Array) -> float:
    """Return the standard deviation within a process from the median moving range: gross values do not widen it."""
    return float(np.median(np.abs(np.diff(values)))) / MEDIAN_RANGE


def about_level(values: Array) -> Array:
    """Return values (n,) as distances from the level of the process there: neither a drift nor a lot is a spread."""
    return np.asarray(values - median_filter(values, min(AROUND, 2 * (values.size // 2) - 1), mode="mirror"))


def most_sigmas(tests: int, degrees: float, chance: float) -> float:
    """Return the number of estimated sigmas that one of so many tests may be off, in both directions, for a chance of a
    false alarm in all of them. degrees: of freedom of sigma.

    Bonferroni's bound, of the t distribution because sigma is estimated: it holds for tests that depend on each other.
    """
    return float(stdtrit(degrees, 1.0 - chance / (2.0 * tests)))


def moving_range_degrees(n: int) -> float:
    """Return the degrees of freedom of `moving_range_sigma` of n values.

    Its variance is (0.8264 n - 1.082) / (n - 1)^2 of sigma^2 ([CryerRyan]); a chi distribution with nu degrees has
    1 / (2 nu).
    """
    return (n - 1) ** 2 / (2.0 * (0.8264 * n - 1.082))
