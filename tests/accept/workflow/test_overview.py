"""What the units of a week come to: counts, days and times from the store's own, and a drift that is none by chance."""

import re
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from accept.tui.widgets.bench.cards import week_text
from accept.workflow.steps.overview import drift, week_of
from accept.workflow.steps.unit_list import LISTED, KnownUnit
from checks.verdict import Finding, Verdict

THURSDAY = datetime(2026, 11, 26, 10, 52, tzinfo=UTC)


def finding(value: float) -> Finding:
    return Finding("stroke", "stroke_um", value, "um", 1.0, 330.0, 400.0, "guarded", Verdict.PASS, 0.0, None)


def unit(n: int, begun: datetime, verdict: str | None = None, minutes: float = 20.0, **more: object) -> KnownUnit:
    """A unit whose first entry came a minute after it was begun."""
    measured = begun + timedelta(minutes=1)
    judged = (measured + timedelta(minutes=minutes)).isoformat() if verdict else ""
    times = {"begun": begun.isoformat(), "measured": measured.isoformat(), "judged": judged}
    return KnownUnit(f"APA-{n:03d}", "apa", 1, verdict, 0, 4, **times, **more)


def test_the_units_that_were_begun_since_monday_are_counted_by_what_became_of_them():
    monday = datetime(2026, 11, 23, 7, 0, tzinfo=UTC)
    units = [
        unit(7, THURSDAY - timedelta(minutes=20)),
        unit(6, THURSDAY - timedelta(minutes=30), "incomplete", 5.0),
        unit(5, monday + timedelta(days=1), "conditional", 50.0, held=True),
        unit(4, monday + timedelta(days=1), "rejected", 30.0),
        unit(3, monday + timedelta(hours=1), "accepted", 10.0),
        unit(2, monday, "accepted", 20.0),
        unit(1, monday - timedelta(days=1), "accepted"),  # of the week before
    ]
    week = week_of(units, THURSDAY)
    assert (week.begun, week.judged, week.accepted, week.rejected, week.held) == (6, 5, 2, 1, 1)
    assert week.by_day == (2, 2, 0, 1, 0, 0, 0)
    assert week.minutes == (20.0, 10.0, 30.0, 50.0, 5.0)
    assert week.usual_minutes == 20.0
    counts = dict(re.findall(r"([a-z]+) +(\d+)\n", week_text(week).plain))
    assert (counts["undecided"], counts["open"]) == ("1", "1")  # red before: 2 were open
    assert week.whole
    assert week_of([], THURSDAY).begun == 0


def test_a_day_is_one_of_the_bench_s_clock():
    late = datetime(2026, 11, 22, 23, 30, tzinfo=UTC)  # half past midnight on Monday, an hour to the east
    east = THURSDAY.astimezone(timezone(timedelta(hours=1)))
    assert week_of([unit(1, late, "accepted")], east).by_day[0] == 1
    assert week_of([unit(1, late, "accepted")], THURSDAY).begun == 0


def test_a_week_of_more_units_than_are_listed_says_so():
    assert not week_of([unit(n, THURSDAY) for n in range(LISTED)], THURSDAY).whole


def series(values: list[float]) -> list[KnownUnit]:
    """Units judged one after the other, the last one on top."""
    days = (THURSDAY + timedelta(hours=n) for n in range(len(values)))
    units = [
        unit(n, day, "accepted", findings=(finding(value),))
        for n, (day, value) in enumerate(zip(days, values, strict=True))
    ]
    return units[::-1]


@pytest.mark.parametrize(("slope", "way"), [(1.0, 1), (-1.0, -1)])
def test_a_quantity_that_goes_one_way_drifts(slope: float, way: int):
    found = drift(series([360.0 + slope * n for n in range(30)]))
    assert found is not None
    assert (found.quantity, found.way, len(found.values)) == ("stroke_um", way, 20)
    assert found.values[-1] == 360.0 + slope * 29


def test_few_values_are_no_drift_and_equal_ones_have_none():
    assert drift(series([360.0 + n for n in range(9)])) is None
    assert drift(series([360.0] * 12)).way == 0


def test_chance_alone_seldom_drifts():
    rng = np.random.default_rng(5)
    told = sum(drift(series(rng.standard_normal(20).tolist())).way != 0 for _ in range(1000))
    assert told <= 5  # one is expected; six or more come once in 1700 times
