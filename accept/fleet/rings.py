"""One chance of a false ring for all charts of a page, so that a quiet quarter is quiet.

A chart has a chance of its own to raise an alarm without a cause, for a person who watches that one quantity. Five of
them, of each bench and lot, golden units beside them, ring too often for a person who reads all. What is as rare as
their shared chance demands rings; what only its own chart finds rare is to be watched.

The chance is divided by Bonferroni's inequality, which holds for charts of the same units too: half for the charts of
all units, a sixth each for those of a column (benches, lots) and of golden units, then evenly among the charts.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.special import ndtri

from accept.fleet.process_control.control_chart import (
    ALLOWANCE,
    SHORTEST,
    VALUE,
    Alarm,
    Baseline,
    sums_limit,
)
from accept.fleet.process_control.spread import most_sigmas, moving_range_degrees

OF_A_PAGE = 0.02  # chance that anything rings in a process in control
BESIDE = 0.002  # of it: values unlike the others of their unit (`reading_alarms.CHANCE`), and two populations
GOLDEN = "golden"
OF_ALL, OF_A_COLUMN = 1.0 / 2.0, 1.0 / 6.0
OF_CHART, OF_EQUAL, OF_OFFSET = 0.5, 0.25, 0.25  # of a chart's chance: values and shifts, equal values, offsets
FOUND = 0.9  # share of charts in which what is called findable is found


def shared_chance(by: str, charts: int) -> float:
    """Return the chance of one of so many charts, "all", of a column or `GOLDEN`, to ring without a cause."""
    return (OF_A_PAGE - BESIDE) * (OF_ALL if by == "all" else OF_A_COLUMN) / max(charts, 1)


def count_of_quantities(frame: pd.DataFrame) -> int:
    """Return how many quantities rows of judgements have values of: each has a chart."""
    return int(frame.loc[frame["value"].notna(), "quantity"].nunique())


def ringing(alarms: Iterable[Alarm], strict: Sequence[Sequence[Alarm]]) -> tuple[Alarm, ...]:
    """Return the alarms of a chart, marked if they ring: if each strict chart of the same values shows them too."""
    return tuple(replace(alarm, rings=all(_is_among(alarm, others) for others in strict)) for alarm in alarms)


def _is_among(alarm: Alarm, others: Iterable[Alarm]) -> bool:
    """Return whether another alarm is about the same values; a single value may lie in a shift."""
    return any(
        other.first <= alarm.last and alarm.first <= other.last and (other.lasts or other.rule == alarm.rule == VALUE)
        for other in others
    )


def findable_shift(base: Baseline, n: int, frozen: bool, chance: float) -> float | None:
    """Return the smallest shift, of the later half of n values, that `FOUND` of the charts with a chance of a false
    alarm find; None for too few values. frozen: whether the baseline is of values before these.

    It is that whose most likely course just rings: of the difference of two halves, or of the sum of the later half
    beside the uncertainty of the baseline."""
    half, beyond = n // 2, float(ndtri(FOUND))
    if half < SHORTEST or base.sigma == 0.0:
        return None
    spread = 1.0 / (2.0 * moving_range_degrees(base.n))  # relative variance of the estimated sigma
    if not frozen:
        significant = most_sigmas(n - 2 * SHORTEST + 1, moving_range_degrees(base.n), chance)
        scatter = float(np.sqrt(1.0 + significant**2 * spread))
        return (significant + beyond * scatter) * 2.0 * base.sigma / float(np.sqrt(n))
    limit = sums_limit(base.n, n, chance)
    scatter = float(np.sqrt(half + half**2 / base.n + limit**2 * spread))
    return (ALLOWANCE + (limit + beyond * scatter) / half) * base.sigma
