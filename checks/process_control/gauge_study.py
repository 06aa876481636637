"""Crossed gauge study by analysis of variance: how much of the spread is the measurement's own.

Every operator measures every part several times. Mean squares of parts, operators, their interaction and repeats give
the variance of each source; an interaction that is not significant is pooled with the repeats ([AIAG-MSA] chapter III).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from checks.arrays import Array

POOLED_ABOVE = 0.25  # p of the interaction above which it is taken for repeatability ([AIAG-MSA]: alpha to remove)
STUDY_SIGMAS = 6.0  # width that holds 99.73 % of the readings ([AIAG-MSA] chapter II)


@dataclass(frozen=True)
class GaugeStudy:
    """Standard deviations in the unit of the values. repeatability: equipment; reproducibility: operators and, where it
    is significant, their interaction with parts; gauge: both; parts; total. degrees: of freedom of repeatability."""

    parts: float
    operators: float
    interaction: float
    repeatability: float
    reproducibility: float
    gauge: float
    total: float
    degrees: int
    p_interaction: float

    @property
    def percent_of_study(self) -> float:
        """Gauge R&R as a share of the total spread [%]: below 10 good, above 30 not usable ([AIAG-MSA])."""
        return 100.0 * self.gauge / self.total

    @property
    def distinct_categories(self) -> int:
        """How many groups of parts the gauge tells apart; five or more are wanted."""
        return max(1, int(np.sqrt(2.0) * self.parts / self.gauge)) if self.gauge > 0 else 10**6

    def percent_of_tolerance(self, width: float) -> float:
        """Gauge R&R (6 sigma) as a share [%] of the distance between the limits."""
        return 100.0 * STUDY_SIGMAS * self.gauge / width


def gauge_study(values: Array) -> GaugeStudy:
    """Variance components of values (parts, operators, repeats).

    Raises ValueError for fewer than two parts, operators or repeats, or a value that is not finite.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 3 or min(x.shape) < 2 or not np.isfinite(x).all():
        raise ValueError(
            f"values of shape {x.shape}: expected (parts, operators, repeats), two or more each, all finite"
        )
    p, o, r = x.shape
    squares = _mean_squares(x)
    within, degrees = squares["repeats"], p * o * (r - 1)
    f_ratio = squares["interaction"] / within if within > 0 else np.inf
    chance = float(fdtrc((p - 1) * (o - 1), degrees, f_ratio)) if np.isfinite(f_ratio) else 0.0
    pooled = chance > POOLED_ABOVE
    if pooled:
        more = (p - 1) * (o - 1)
        within = (squares["interaction"] * more + within * degrees) / (more + degrees)
        degrees += more
    beside = within if pooled else squares["interaction"]
    interaction = 0.0 if pooled else max(0.0, (squares["interaction"] - within) / r)
    operators = max(0.0, (squares["operators"] - beside) / (p * r))
    parts = max(0.0, (squares["parts"] - beside) / (o * r))
    between = operators + interaction
    sigma = {k: float(np.sqrt(v)) for k, v in {"p": parts, "o": operators, "i": interaction, "w": within}.items()}
    gauge, total = float(np.sqrt(within + between)), float(np.sqrt(within + between + parts))
    return GaugeStudy(
        parts=sigma["p"],
        operators=sigma["o"],
        interaction=sigma["i"],
        repeatability=sigma["w"],
        reproducibility=float(np.sqrt(between)),
        gauge=gauge,
        total=total,
        degrees=degrees,
        p_interaction=chance,
    )


def _mean_squares(x: Array) -> dict[str, float]:
    p, o, r = x.shape
    mean, cells = x.mean(), x.mean(axis=2)
    by_part, by_operator = x.mean(axis=(1, 2)), x.mean(axis=(0, 2))
    left = cells - by_part[:, None] - by_operator[None, :] + mean
    return {
        "parts": float(o * r * ((by_part - mean) ** 2).sum() / (p - 1)),
        "operators": float(p * r * ((by_operator - mean) ** 2).sum() / (o - 1)),
        "interaction": float(r * (left**2).sum() / ((p - 1) * (o - 1))),
        "repeats": float(((x - cells[:, :, None]) ** 2).sum() / (p * o * (r - 1))),
    }
