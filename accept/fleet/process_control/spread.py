"""The spread within a process, from differences of consecutive values: a drift or a step does not widen it."""

import numpy as np

from checks.arrays import Array

D2 = 1.128379167095513  # mean range of two normal values / sigma: 2 / sqrt(pi)
MEDIAN_RANGE = 0.9538725524  # median range of two normal values / sigma: sqrt(2) times the upper quartile


def moving_range_sigma(values: Array) -> float:
    """Return the standard deviation within a process from the mean moving range of values (n,) ([Montgomery] 6.4)."""
    return float(np.abs(np.diff(values)).mean()) / D2


def robust_sigma(values: Array) -> float:
    """Return the standard deviation within a process from the median moving range: gross values do not widen it."""
    return float(np.median(np.abs(np.diff(values)))) / MEDIAN_RANGE


def moving_range_degrees(n: int) -> float:
    """Return the degrees of freedom of `moving_range_sigma` of n values.

    Its variance is (0.8264 n - 1.082) / (n - 1)^2 of sigma^2 ([CryerRyan]); a chi distribution with nu degrees has
    1 / (2 nu).
    """
    return (n - 1) ** 2 / (2.0 * (0.8264 * n - 1.082))
