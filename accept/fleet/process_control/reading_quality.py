"""Readings that a chart of one quantity cannot see through: two populations in one, a coarse meter, exchanged digits.

Two populations: a mixture of two normal distributions of one standard deviation against a single one, by the ratio of
their likelihoods, level with level ([McLachlan]). Exchanged digits: what the other quantities of the same unit predict
of a value, by regression; its distance is the part of Hotelling's T^2 that this value adds to theirs ([Mason]).
"""

from dataclasses import dataclass

import numpy as np

from accept.fleet.process_control.control_chart import best_split
from accept.fleet.process_control.spread import about_level, robust_sigma
from checks.arrays import Array

FEWEST = 30  # values below which neither a mixture nor a regression is worth naming
APART = 2.0  # standard deviations between two means of equal normal populations above which their sum has two modes
SMALLEST = 0.05  # share of the smaller population: fewer are single values
# 2 log likelihood ratio. Of one normal population it exceeds, with means so far apart and shares so large, 9.8 in 1 %
# and 14.5 in 0.1 % of 6000 samples of 30 values.
LIKELIER = 20.0
AGREES = 2.0  # standard deviations within which a value with exchanged digits agrees with the other quantities
_ROUNDS = 5  # of a regression without the values that it shows to be gross
_KEPT = 3.0  # robust standard deviations


@dataclass(frozen=True, eq=False)
class Populations:
    """Two normal populations of one standard deviation: means (2,) in order, share of the upper one, 2 log likelihood
    ratio against one population, and which values (N,) belong to the upper one."""

    means: tuple[float, float]
    sigma: float
    upper_share: float
    ratio: float
    upper: Array


def likelier(chance: float) -> float:
    """Return the ratio that two populations exceed with a chance if there is one: what multiplies the chance by 0.1
    adds 2 log 10 to it, as between 1 % and 0.1 %."""
    return max(LIKELIER, 14.5 + 2.0 * float(np.log(0.001 / chance)))


def two_populations(values: Array) -> Populations | None:
    """Return the two populations of values (N,) about their level, None if one describes them as well, or if they
    overlap so far that they have one mode."""
    x = np.asarray(values, dtype=float)
    if x.size < FEWEST or x.std() == 0.0:
        return None
    order = np.sort(x)
    start = best_split(order, 1) or 1  # as k-means has it
    means = np.array([order[:start].mean(), order[start:].mean()])
    share, sigma = 1.0 - start / x.size, float(x.std()) / 2.0
    for _ in range(200):
        parts = np.log([1.0 - share, share])[:, None] - 0.5 * ((x - means[:, None]) / sigma) ** 2
        total = np.logaddexp(*parts)
        belongs = np.exp(parts - total)
        weights = belongs.sum(axis=1)
        if weights.min() < 1.0:
            return None
        moved = float(np.abs(means - (means := belongs @ x / weights)).max())
        share = float(weights[1] / x.size)
        sigma = float(np.sqrt((belongs * (x - means[:, None]) ** 2).sum() / x.size))
        if sigma <= 1e-9 * x.std():
            return None
        if moved < 1e-5 * sigma:
            break
    ratio = 2.0 * float(total.sum() - x.size * np.log(sigma) + x.size * (np.log(x.std()) + 0.5))
    if ratio <= LIKELIER or means[1] - means[0] <= APART * sigma or min(share, 1.0 - share) < SMALLEST:
        return None
    return Populations((float(means[0]), float(means[1])), sigma, share, ratio, belongs[1] > 0.5)


def step_of(values: Array) -> float | None:
    """Return the largest 1, 2 or 5 times a power of ten of which all values (n,) are multiples: the step of the meter
    that shows them; None without one down to a millionth of the largest."""
    x = np.unique(np.abs(np.asarray(values, dtype=float)))
    top = int(np.floor(np.log10(x[-1]))) if x.size and x[-1] > 0.0 else 0
    for step in (m * 10.0**k for k in range(top, top - 7, -1) for m in (5.0, 2.0, 1.0)):
        counts = x / step
        if np.abs(counts - np.round(counts)).max(initial=0.0) < 1e-6 * max(1.0, counts.max(initial=0.0) * 1e-3):
            return step
    return None


def residuals(values: Array) -> tuple[Array, Array]:
    """Return for values (N, Q) of units in the order of measurement how far each lies from what the other quantities
    of its unit predict, level with level, and the standard deviation of that: both (N, Q).

    A missing value (NaN) predicts nothing: its unit is compared by the others, from all units that have those. NaN if
    they are fewer than `FEWEST`. The regression leaves out what it shows to be gross."""
    x = np.asarray(values, dtype=float)
    out, sigmas, there = np.full(x.shape, np.nan), np.full(x.shape, np.nan), np.isfinite(x)
    for pattern in np.unique(there, axis=0):
        columns, units = np.flatnonzero(pattern), np.flatnonzero((there == pattern).all(axis=1))
        whole = np.flatnonzero(there[:, pattern].all(axis=1))
        if whole.size < FEWEST + columns.size or columns.size < 2:
            continue
        of, centred = np.isin(whole, units), x[np.ix_(whole, columns)]
        centred = centred - np.median(centred, axis=0)
        for k, q in enumerate(columns):
            rest, sigma = _regression(np.delete(centred, k, axis=1), centred[:, k])
            out[units, q], sigmas[units, q] = rest[of], sigma
    return out, sigmas


def _regression(others: Array, y: Array) -> tuple[Array, float]:
    """Return what others (N, K) leave of y (N,), about the level of that, and its standard deviation."""
    kept = np.ones(y.size, dtype=bool)
    for _ in range(_ROUNDS):
        rest = about_level(y - others @ np.linalg.lstsq(others[kept], y[kept], rcond=None)[0])
        kept = np.abs(rest) <= _KEPT * max(robust_sigma(rest), 1e-300)
    return rest, 1.014 * float(rest[kept].std())  # normal values cut at 3 sigma have 0.986


def exchanged(value: float, step: float) -> list[float]:
    """Return the values that an exchange of two neighbouring digits makes of one that is shown in steps."""
    decimals = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    digits = f"{abs(value):.{decimals}f}".replace(".", "")
    swapped = {digits[:i] + digits[i + 1] + digits[i] + digits[i + 2 :] for i in range(len(digits) - 1)} - {digits}
    return sorted(int(each) / 10**decimals * (1.0 if value > 0 else -1.0) for each in swapped)
