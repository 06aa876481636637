"""The units of a bench, what they wait for, and what they come to in this week."""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from statistics import NormalDist, median

from accept.workflow.steps.unit_list import LISTED, KnownUnit, Queue
from checks.verdict import UnitVerdict

DAYS = 7
LAST = 20  # units, of which a drift is told
_FEWEST = 10  # values; the trend of fewer is no drift
_BY_CHANCE = 1e-3  # how often any of the quantities is said to drift where none does


@dataclass(frozen=True)
class Drift:
    """The quantity of a kind with the clearest trend over the last units. way: 1 up, -1 down, 0 if it may be chance."""

    kind: str
    quantity: str
    values: tuple[float, ...]
    way: int


@dataclass(frozen=True)
class Week:
    """The units of this week. begun: units of this week; accepted, rejected, judged: of these, by their verdicts; held:
    of these; by_day: verdicts on each day from Monday; minutes: of each unit from its first entry to its verdict, in
    their order; whole: no unit of this week is too old for the list."""

    begun: int = 0
    accepted: int = 0
    rejected: int = 0
    held: int = 0
    judged: int = 0
    by_day: tuple[int, ...] = (0,) * DAYS
    minutes: tuple[float, ...] = ()
    drift: Drift | None = None
    whole: bool = True
    undecided: int = 0  # judged, and neither accepted, rejected nor held

    @property
    def usual_minutes(self) -> float:
        return median(self.minutes)


@dataclass(frozen=True)
class Overview:
    """All units of the bench. units: the newest first; queues: what they wait for, that of all units first."""

    units: Sequence[KnownUnit]
    queues: Sequence[Queue]
    week: Week


def week_of(units: Sequence[KnownUnit], now: datetime) -> Week:
    """Return what became of the units that were begun since Monday. now: in its time zone; units: newest first."""
    monday = (now - timedelta(days=now.weekday())).replace(hour=0, minute=0, second=0, microsecond=0)
    of_week = [unit for unit in units if _local(unit.begun, now) >= monday]
    judged = sorted((unit for unit in of_week if unit.judged), key=lambda unit: unit.judged)
    by_day = [0] * DAYS
    for unit in judged:
        by_day[_local(unit.judged, now).weekday()] += 1
    return Week(
        len(of_week),
        sum(unit.verdict == UnitVerdict.ACCEPTED and not unit.held for unit in judged),
        sum(unit.verdict == UnitVerdict.REJECTED for unit in judged),
        sum(unit.held and unit.verdict != UnitVerdict.REJECTED for unit in of_week),
        len(judged),
        tuple(by_day),
        tuple(_minutes(unit) for unit in judged if unit.measured),
        drift(units),
        len(of_week) < LISTED,
        sum(unit.verdict not in (UnitVerdict.ACCEPTED, UnitVerdict.REJECTED) and not unit.held for unit in judged),
    )


def _local(time: str, now: datetime) -> datetime:
    return datetime.fromisoformat(time).astimezone(now.tzinfo)


def _minutes(unit: KnownUnit) -> float:
    return (datetime.fromisoformat(unit.judged) - datetime.fromisoformat(unit.measured)).total_seconds() / 60


def drift(units: Sequence[KnownUnit]) -> Drift | None:
    """Return the clearest trend among the quantities of the units with a verdict, by the test of Mann and Kendall; None
    if no quantity has enough values."""
    values = defaultdict[tuple[str, str], list[float]](list)
    for unit in sorted((unit for unit in units if unit.judged), key=lambda unit: unit.judged):
        for finding in unit.findings:
            if finding.value is not None and math.isfinite(finding.value):
                values[unit.kind, finding.quantity].append(finding.value)
    last = {key: found[-LAST:] for key, found in values.items() if len(found) >= _FEWEST}
    if not last:
        return None
    trends = {key: _trend(found) for key, found in last.items()}
    clearest = max(trends, key=lambda key: abs(trends[key]))
    beyond = NormalDist().inv_cdf(1 - _BY_CHANCE / 2 / len(trends))
    way = 0 if abs(trends[clearest]) < beyond else int(math.copysign(1, trends[clearest]))
    return Drift(*clearest, tuple(last[clearest]), way)


def _trend(values: Sequence[float]) -> float:
    """Return Kendall's S over its standard deviation without a trend, corrected for continuity."""
    n = len(values)
    s = sum((values[j] > values[i]) - (values[j] < values[i]) for i in range(n) for j in range(i + 1, n))
    return math.copysign(max(0, abs(s) - 1), s) / math.sqrt(n * (n - 1) * (2 * n + 5) / 18)
