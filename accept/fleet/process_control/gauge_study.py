"""Crossed gauge study by analysis of variance: how much of the spread is the measurement's own.

Every operator measures every part several times. Mean squares of parts, operators, their interaction and repeats give
the variance of each source; an interaction that is not significant is pooled with the repeats ([AIAG-MSA] chapter III).
Intervals of the components are generalised confidence intervals: every mean square divided by a drawn chi-square
([Burdick] chapter 3), because a component of three operators has two degrees of freedom and no normal interval.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from checks.arrays import Array

POOLED_ABOVE = 0.25  # p of the interaction above which it is taken for repeatability ([AIAG-MSA]: alpha to remove)
STUDY_SIGMAS = 6.0  # width that holds 99.73 % of the readings ([AIAG-MSA] chapter II)
GOOD, USABLE = 10.0, 30.0  # percent of the study or of the tolerance ([AIAG-MSA] chapter II)
CATEGORIES = 5  # groups of parts that a gauge should tell apart ([AIAG-MSA] chapter II)
# Of [AIAG-MSA] appendix C: mean range of so many repeats in sigmas, and, of a single range of so many operators or
# parts, the root of its mean square (d2*): 1 / K1, 1 / K2 and 1 / K3 of the form for averages and ranges.
_MEAN_RANGE = {2: 1.12838, 3: 1.69257, 4: 2.05875, 5: 2.32593, 6: 2.53441}
_SINGLE_RANGE = (
    1.41421, 1.91155, 2.23887, 2.48124, 2.67253, 2.82981, 2.96288, 3.07794, 3.17905, 3.26909, 3.35016, 3.42378, 3.49116,
    3.55333, 3.61071, 3.66422, 3.71424, 3.76118, 3.80537,
)  # fmt: skip
_DRAWS = 20_000  # of the intervals: their ends are known to some 1 %


@dataclass(frozen=True)
class VarianceRow:
    """A row of the analysis of variance; F and p are None for the row that others are compared with."""

    degrees: int
    squares: float
    mean_square: float
    F: float | None
    p: float | None


@dataclass(frozen=True)
class Component:
    """A standard deviation in the unit of the values, with its two-sided 95 % interval."""

    sigma: float
    lo: float
    hi: float


@dataclass(frozen=True)
class GaugeStudy:
    """A study of values (parts, operators, repeats).

    table: "parts", "operators", "interaction", "repeats" -> its row. components: "repeatability" (equipment),
    "operators", "interaction" (0 if pooled), "reproducibility" (operators and interaction), "gauge" (both), "parts" and
    "total" -> standard deviation. degrees: of freedom of the repeatability.
    """

    table: Mapping[str, VarianceRow]
    components: Mapping[str, Component]
    pooled: bool
    degrees: int

    @property
    def percent_of_study(self) -> float:
        """Return gauge R&R as a share of the total spread [%]."""
        return 100.0 * self.components["gauge"].sigma / self.components["total"].sigma

    @property
    def distinct_categories(self) -> int:
        """Return the number of groups of parts that the gauge can distinguish."""
        gauge, parts = self.components["gauge"].sigma, self.components["parts"].sigma
        return max(1, int(np.sqrt(2.0) * parts / gauge)) if gauge > 0 else 10**6

    def percent_of_tolerance(self, width: float) -> float:
        """Return gauge R&R (6 sigma) as a share [%] of the distance between the limits."""
        return 100.0 * STUDY_SIGMAS * self.components["gauge"].sigma / width

    def verdict(self, tolerance: float | None = None) -> str:
        """Return "good", "conditional" or "not usable", the worst of the shares of the study and of the tolerance, and
        of the categories. tolerance: distance between the limits, if given."""
        share = max(self._shares(tolerance).values())
        if share > USABLE:
            return "not usable"
        return "conditional" if share > GOOD or self.distinct_categories < CATEGORIES else "good"

    def decided_by(self, tolerance: float | None = None) -> str:
        """Return the figure that the verdict follows from, with what is wanted, in words."""
        of, share = max(self._shares(tolerance).items(), key=lambda each: each[1])
        if share <= GOOD and self.distinct_categories < CATEGORIES:
            return f"it distinguishes {self.distinct_categories} categories of parts, {CATEGORIES} or more are wanted"
        wanted = f"at most {USABLE if share > USABLE else GOOD:g} %"
        return f"gauge R&R is {share:.1f} % of the {of}, {wanted} {'is usable' if share > USABLE else 'is good'}"

    def _shares(self, tolerance: float | None) -> dict[str, float]:
        """Return what gauge R&R is compared with -> its share of it [%]."""
        of_tolerance = {} if tolerance is None else {"tolerance": self.percent_of_tolerance(tolerance)}
        return {"study": self.percent_of_study} | of_tolerance


def gauge_study(values: Array) -> GaugeStudy:
    """Return the variance components of values (parts, operators, repeats).

    Raises ValueError for fewer than two parts, operators or repeats, or a value that is not finite.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 3 or min(x.shape) < 2 or not np.isfinite(x).all():
        raise ValueError(
            f"values of shape {x.shape}: expected (parts, operators, repeats), two or more each, all finite"
        )
    table = _analysis_of_variance(x)
    interaction = table["interaction"].p
    pooled = interaction is not None and interaction > POOLED_ABOVE
    names = ("parts", "operators", "interaction", "repeats")
    squares = np.array([table[name].mean_square for name in names])
    degrees = np.array([table[name].degrees for name in names], dtype=float)
    drawn = squares * degrees / np.random.default_rng(20_261_101).chisquare(degrees, (_DRAWS, 4))
    made, spread = _sigmas(squares, x.shape, pooled), _sigmas(drawn, x.shape, pooled)
    lo, hi = ({name: float(np.quantile(of, q)) for name, of in spread.items()} for q in (0.025, 0.975))
    components = {name: Component(float(sigma), lo[name], hi[name]) for name, sigma in made.items()}
    return GaugeStudy(table, components, pooled, int(degrees[3] + (degrees[2] if pooled else 0)))


def averages_and_ranges(values: Array) -> dict[str, float] | None:
    """Return component -> standard deviation of values (parts, operators, repeats) by the averages and ranges of
    [AIAG-MSA] chapter III, as a check of the analysis of variance by hand: it knows no interaction. None for a study
    larger than the published constants (six repeats, twenty operators or parts)."""
    p, o, r = np.shape(values)
    if r not in _MEAN_RANGE or max(p, o) - 2 >= len(_SINGLE_RANGE):
        return None
    repeats = float(np.ptp(values, axis=2).mean()) / _MEAN_RANGE[r]
    operators = float(np.ptp(values.mean(axis=(0, 2)))) / _SINGLE_RANGE[o - 2]
    variance = {
        "repeatability": repeats**2,
        "reproducibility": max(0.0, operators**2 - repeats**2 / (p * r)),
        "parts": (float(np.ptp(values.mean(axis=(1, 2)))) / _SINGLE_RANGE[p - 2]) ** 2,
    }
    variance["gauge"] = variance["repeatability"] + variance["reproducibility"]
    variance["total"] = variance["gauge"] + variance["parts"]
    return {name: float(np.sqrt(v)) for name, v in variance.items()}


def _sigmas(mean_squares: Array, shape: tuple[int, ...], pooled: bool) -> dict[str, Array]:
    """Return component -> standard deviation (...) from mean squares (..., 4) in the order of the table."""
    p, o, r = shape
    parts, operators, interaction, repeats = np.moveaxis(mean_squares, -1, 0)
    if pooled:
        more, own = (p - 1) * (o - 1), p * o * (r - 1)
        repeats = interaction = (interaction * more + repeats * own) / (more + own)
    variance = {
        "repeatability": repeats,
        "operators": np.maximum(0.0, (operators - interaction) / (p * r)),
        "interaction": np.maximum(0.0, (interaction - repeats) / r),
        "parts": np.maximum(0.0, (parts - interaction) / (o * r)),
    }
    variance["reproducibility"] = variance["operators"] + variance["interaction"]
    variance["gauge"] = variance["repeatability"] + variance["reproducibility"]
    variance["total"] = variance["gauge"] + variance["parts"]
    return {name: np.sqrt(v) for name, v in variance.items()}


def _analysis_of_variance(x: Array) -> dict[str, VarianceRow]:
    """Return the table of x (parts, operators, repeats), both factors random: compared with the interaction."""
    p, o, r = x.shape
    mean, cells = x.mean(), x.mean(axis=2)
    by_part, by_operator = x.mean(axis=(1, 2)), x.mean(axis=(0, 2))
    both = cells - by_part[:, None] - by_operator[None, :] + mean
    rows = {
        "parts": (o * r * ((by_part - mean) ** 2).sum(), p - 1),
        "operators": (p * r * ((by_operator - mean) ** 2).sum(), o - 1),
        "interaction": (r * (both**2).sum(), (p - 1) * (o - 1)),
        "repeats": (((x - cells[:, :, None]) ** 2).sum(), p * o * (r - 1)),
    }
    beside = {"parts": "interaction", "operators": "interaction", "interaction": "repeats"}
    table = {}
    for name, (squares, degrees) in rows.items():
        F = p_value = None
        if name in beside:
            other, of = rows[beside[name]]
            F = float((squares / degrees) / (other / of)) if other > 0 else float("inf")
            p_value = float(fdtrc(degrees, of, F)) if np.isfinite(F) else 0.0
        table[name] = VarianceRow(degrees, float(squares), float(squares / degrees), F, p_value)
    return table
