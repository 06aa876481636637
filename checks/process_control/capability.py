"""Process capability: how many standard deviations of the process fit between its mean and the nearest limit.

Cpk and its interval: [Bissell]; normal values are assumed, and the process must be in control for it to mean anything.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from checks.arrays import Array

LEAST = 10  # below, the interval of Cpk is wider than any decision about it
CONFIDENCE = 0.95  # two-sided, as usual for capability


@dataclass(frozen=True)
class Capability:
    """Cpk with its two-sided 95 % interval; Cp where there are two limits. n values, their mean and sigma."""

    n: int
    mean: float
    sigma: float
    cpk: float
    lo: float
    hi: float
    cp: float | None


def capability(values: Array, lower: float | None, upper: float | None, confidence: float = CONFIDENCE) -> Capability:
    """Capability of values (n,) against limits in the same unit.

    Raises ValueError for fewer than `LEAST` values, one that is not finite, no limit, or values that do not vary.
    """
    x = np.asarray(values, dtype=float)
    if x.size < LEAST or not np.isfinite(x).all():
        raise ValueError(f"{x.size} values, expected {LEAST} or more, all finite")
    if lower is None and upper is None:
        raise ValueError("neither a lower nor an upper limit: capability needs one")
    mean, sigma = float(x.mean()), float(x.std(ddof=1))
    if sigma == 0.0:
        raise ValueError(f"all {x.size} values are {mean:g}: they were not measured one by one")
    sides = [(upper - mean) if upper is not None else math.inf, (mean - lower) if lower is not None else math.inf]
    cpk = min(sides) / (3.0 * sigma)
    half = float(ndtri(0.5 + confidence / 2.0)) * math.sqrt(1.0 / (9.0 * x.size) + cpk**2 / (2.0 * (x.size - 1)))
    cp = (upper - lower) / (6.0 * sigma) if lower is not None and upper is not None else None
    return Capability(x.size, mean, sigma, cpk, cpk - half, cpk + half, cp)
