"""Bias of a gauge against reference values: one part measured many times, or several over the range.

A study of one part gives the bias with its t test and, by the tolerance, the indices Cg and Cgk of a study of type 1. A
study of parts over the range gives the line of the bias against the reference, its linearity ([AIAG-MSA] chapter III).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from checks.arrays import Array

LEAST = 10  # readings of a part: fewer know the spread too badly ([AIAG-MSA] chapter III B)
CONFIDENCE = 0.95
SHARE, SIGMAS = 0.2, 6.0  # of the tolerance that the spread of a gauge may take, and its width in sigmas (type 1)
CAPABLE = 1.33  # least Cg and Cgk of a gauge that is fit for the tolerance


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error, its 95 % interval, t against zero and the chance of such a t without bias."""

    value: float
    error: float
    lo: float
    hi: float
    t: float
    p: float

    @property
    def significant(self) -> bool:
        return not self.lo <= 0.0 <= self.hi


@dataclass(frozen=True)
class BiasStudy:
    """Study of readings of a part. sigma: repeatability; Cg, Cgk: None without a tolerance."""

    n: int
    mean: float
    sigma: float
    bias: Estimate
    Cg: float | None
    Cgk: float | None

    @property
    def capable(self) -> bool | None:
        """Return whether the gauge is fit for the tolerance, None without one."""
        return None if self.Cgk is None or self.Cg is None else min(self.Cg, self.Cgk) >= CAPABLE


@dataclass(frozen=True)
class LinearityStudy:
    """Line of the bias over the reference: slope, intercept; sigma about it; biases: mean bias of each reference."""

    n: int
    slope: Estimate
    intercept: Estimate
    sigma: float
    r_squared: float
    references: tuple[float, ...]
    biases: tuple[Estimate, ...]

    @property
    def linear(self) -> bool:
        """Return whether neither slope nor intercept differs significantly from zero."""
        return not (self.slope.significant or self.intercept.significant)


def bias_study(values: Array, reference: float, tolerance: float | None = None) -> BiasStudy:
    """Return the study of readings (n,) of a part of this reference value. tolerance: distance between the limits.

    Raises ValueError for fewer than `LEAST` readings, one that is not finite, readings that do not vary, or a tolerance
    of zero or less.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or x.size < LEAST or not np.isfinite([*x, reference]).all():
        raise ValueError(f"{x.size} readings, expected {LEAST} or more, all finite")
    sigma, mean = float(x.std(ddof=1)), float(x.mean())
    if sigma == 0.0:
        raise ValueError(f"all {x.size} readings are {mean:g}: their resolution hides the spread")
    if tolerance is not None and not tolerance > 0.0:
        raise ValueError(f"a tolerance of {tolerance:g}, expected more than zero")
    bias = mean - reference
    Cg = None if tolerance is None else SHARE * tolerance / (SIGMAS * sigma)
    Cgk = None if tolerance is None else (SHARE / 2.0 * tolerance - abs(bias)) / (SIGMAS / 2.0 * sigma)
    return BiasStudy(x.size, mean, sigma, _estimate(bias, sigma / math.sqrt(x.size), x.size - 1), Cg, Cgk)


def linearity_study(references: Array, values: Array) -> LinearityStudy:
    """Return the line of bias against reference of readings values (n,) with their reference values (n,).

    Raises ValueError for fewer than three references, fewer than two readings of one, or a value that is not finite.
    """
    at, x = np.asarray(references, dtype=float), np.asarray(values, dtype=float)
    if at.shape != x.shape or at.ndim != 1 or not (np.isfinite(at).all() and np.isfinite(x).all()):
        raise ValueError(f"{x.size} values of {at.size} references, expected as many, all finite")
    levels, counts = np.unique(at, return_counts=True)
    if levels.size < 3 or counts.min() < 2:
        raise ValueError(f"{levels.size} references, expected 3 or more, each with 2 or more readings")
    bias, n = x - at, x.size
    off = at - at.mean()
    slope = float(off @ bias / (off @ off))
    intercept = float(bias.mean() - slope * at.mean())
    rest = float(((bias - intercept - slope * at) ** 2).sum())
    sigma = math.sqrt(rest / (n - 2))
    total = float(((bias - bias.mean()) ** 2).sum())
    return LinearityStudy(
        n=n,
        slope=_estimate(slope, sigma / math.sqrt(float(off @ off)), n - 2),
        intercept=_estimate(intercept, sigma * math.sqrt(1.0 / n + at.mean() ** 2 / float(off @ off)), n - 2),
        sigma=sigma,
        r_squared=1.0 - rest / total if total > 0.0 else 0.0,
        references=tuple(map(float, levels)),
        biases=tuple(_mean_bias(bias[at == one]) for one in levels),
    )


def _mean_bias(bias: Array) -> Estimate:
    return _estimate(float(bias.mean()), float(bias.std(ddof=1)) / math.sqrt(bias.size), bias.size - 1)


def _estimate(value: float, error: float, degrees: int) -> Estimate:
    half = float(stdtrit(degrees, 0.5 + CONFIDENCE / 2.0)) * error
    t = value / error if error > 0.0 else math.copysign(math.inf, value) if value else 0.0
    return Estimate(value, error, value - half, value + half, t, 2.0 * float(stdtr(degrees, -abs(t))))
