"""Process capability and performance: how the spread of a process compares with its limits.

Capability (Cp, Cpk) takes the spread within the process, from the moving range of consecutive values; performance (Pp,
Ppk) takes the spread of all values, drifts and steps included ([AIAG-SPC] chapter IV). They agree if the process is in
control. Both assume normal values; for others Ppk of the reference interval is given, from the percentiles of a fitted
distribution ([ISO22514-2]).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtri, ndtr, ndtri

from accept.fleet.process_control.spread import moving_range_degrees, moving_range_sigma
from checks.arrays import Array

LEAST = 10  # below, the interval of Cpk is wider than any decision about it
CONFIDENCE = 0.95  # two-sided, as usual for capability
NOT_NORMAL = 0.005  # p of the Anderson-Darling test; not 0.05: it is asked of every quantity, every time
REFERENCE = 0.00135  # the reference interval leaves this share on each side ([ISO22514-2]): 6 sigma of normal values


@dataclass(frozen=True)
class Index:
    """An index with its two-sided 95 % interval."""

    value: float
    lo: float
    hi: float


@dataclass(frozen=True)
class Percentiles:
    """Percentiles 0.135, 50 and 99.865 % of the fitted distribution, and the performance that they give."""

    distribution: str
    low: float
    median: float
    high: float
    Ppk: float


@dataclass(frozen=True)
class Capability:
    """Indices of n values with their mean and both standard deviations.

    Cp and Pp are None if there is one limit. p_normal: of the Anderson-Darling test; percentiles: None for normal
    values, and if no distribution fits.
    """

    n: int
    mean: float
    sigma_within: float
    sigma_overall: float
    Cp: Index | None
    Cpk: Index
    Pp: Index | None
    Ppk: Index
    p_normal: float
    percentiles: Percentiles | None

    @property
    def normal(self) -> bool:
        return self.p_normal >= NOT_NORMAL


def capability(values: Array, lower: float | None, upper: float | None) -> Capability:
    """Return the capability of values (n,), in the order of measurement, against limits in the same unit.

    Raises ValueError for fewer than `LEAST` values, a value that is not finite, no limit, or values that do not vary.
    """
    x = np.asarray(values, dtype=float)
    if x.size < LEAST or not np.isfinite(x).all():
        raise ValueError(f"{x.size} values, expected {LEAST} or more, all finite")
    if lower is None and upper is None:
        raise ValueError("neither a lower nor an upper limit: capability needs one")
    mean, overall, within = float(x.mean()), float(x.std(ddof=1)), moving_range_sigma(x)
    if overall == 0.0 or within == 0.0:
        raise ValueError(f"the {x.size} values do not vary from one to the next: they were not measured one by one")
    sides = [upper - mean if upper is not None else math.inf, mean - lower if lower is not None else math.inf]
    width = upper - lower if lower is not None and upper is not None else None
    p = normality(x)
    return Capability(
        n=x.size,
        mean=mean,
        sigma_within=within,
        sigma_overall=overall,
        Cp=_of_width(width, within, moving_range_degrees(x.size)),
        Cpk=_of_side(min(sides), within, x.size, moving_range_degrees(x.size)),
        Pp=_of_width(width, overall, x.size - 1),
        Ppk=_of_side(min(sides), overall, x.size, x.size - 1),
        p_normal=p,
        percentiles=_percentiles(x, lower, upper) if p < NOT_NORMAL else None,
    )


def _of_width(width: float | None, sigma: float, degrees: float) -> Index | None:
    """Return width / (6 sigma) with its chi-square interval, for a sigma with these degrees of freedom."""
    if width is None:
        return None
    value = width / (6.0 * sigma)
    tail = (1.0 - CONFIDENCE) / 2.0
    lo, hi = (math.sqrt(float(chdtri(degrees, p)) / degrees) for p in (1.0 - tail, tail))
    return Index(value, value * lo, value * hi)


def _of_side(distance: float, sigma: float, n: int, degrees: float) -> Index:
    """Return distance / (3 sigma) with its interval ([Bissell]), for a sigma with these degrees of freedom."""
    value = distance / (3.0 * sigma)
    half = float(ndtri(0.5 + CONFIDENCE / 2.0)) * math.sqrt(1.0 / (9.0 * n) + value**2 / (2.0 * degrees))
    return Index(value, value - half, value + half)


def normality(values: Array) -> float:
    """Return p of the Anderson-Darling test that values (n,) are normal, mean and sigma estimated ([Stephens])."""
    x = np.sort(np.asarray(values, dtype=float))
    return _p_of(_anderson_darling(ndtr((x - x.mean()) / x.std(ddof=1))))


def _anderson_darling(share: Array) -> float:
    """Return the Anderson-Darling A^2, corrected for n, of ascending values whose distribution function gives share
    (n,)."""
    n = share.size
    share = np.clip(share, 1e-300, 1.0 - 1e-16)  # a value far outside: its logarithm stays finite
    weights = 2.0 * np.arange(1, n + 1) - 1.0
    squared = -n - float((weights * (np.log(share) + np.log1p(-share[::-1]))).mean())
    return squared * (1.0 + 0.75 / n + 2.25 / n**2)


def _p_of(a: float) -> float:
    """Return the chance of a corrected A^2 above a ([Stephens] table 4.9: fits of four ranges)."""
    if a < 0.2:
        return 1.0 - math.exp(-13.436 + 101.14 * a - 223.73 * a**2)
    if a < 0.34:
        return 1.0 - math.exp(-8.318 + 42.796 * a - 59.938 * a**2)
    if a < 0.6:
        return math.exp(0.9177 - 4.279 * a - 1.38 * a**2)
    return math.exp(min(0.0, 1.2937 - 5.709 * a + 0.0186 * a**2)) if a < 13.0 else 0.0


def _percentiles(x: Array, lower: float | None, upper: float | None) -> Percentiles | None:
    """Return the reference interval by the distribution that fits best, None if no distribution fits.

    Candidates are those that [ISO22514-2] names for characteristics with a bound at zero.
    """
    if x.min() <= 0.0:
        return None
    from scipy.stats import foldnorm, lognorm, weibull_min  # a second to load, for values that are not normal only

    ordered, best, chosen = np.sort(x), math.inf, None
    named: dict[str, Any] = {"lognormal": lognorm, "Weibull": weibull_min, "folded normal": foldnorm}
    for name, family in named.items():
        fitted = family(*family.fit(x, floc=0.0))
        distance = _anderson_darling(fitted.cdf(ordered))
        if _p_of(distance) >= NOT_NORMAL and distance < best:
            best, chosen = distance, (name, fitted.ppf)
    if chosen is None:
        return None
    low, median, high = (float(chosen[1](p)) for p in (REFERENCE, 0.5, 1.0 - REFERENCE))
    sides = []
    if upper is not None:
        sides.append((upper - median) / (high - median))
    if lower is not None:
        sides.append((median - lower) / (median - low))
    return Percentiles(chosen[0], low, median, high, min(sides))
