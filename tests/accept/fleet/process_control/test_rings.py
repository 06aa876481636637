"""One chance for all charts of a page: what it is divided into, what rings by it, and what it can find."""

import numpy as np
import pytest

from accept.fleet.process_control.control_chart import (
    FALSE_ALARM,
    SHIFT,
    VALUE,
    Alarm,
    Baseline,
    chart,
    estimate_baseline,
)
from accept.fleet.rings import BESIDE, OF_A_PAGE, findable_shift, ringing, shared_chance


def test_the_shares_of_all_charts_of_a_page_are_one_chance():
    """Five quantities of all units, of two benches, of thirteen lots and of a golden unit."""
    charts = {"all": 5, "bench": 10, "lot": 65, "golden": 5}
    assert sum(n * shared_chance(by, n) for by, n in charts.items()) == pytest.approx(OF_A_PAGE - BESIDE)


def test_an_alarm_rings_if_each_strict_chart_shows_it():
    gross, shift = Alarm(VALUE, 7, 7, 1.0, 0.1), Alarm(SHIFT, 20, 40, 1.0, 0.1)
    later = Alarm(SHIFT, 25, 38, 1.0, 0.1)
    assert [a.rings for a in ringing([gross, shift], [[later], [later]])] == [False, True]
    assert [a.rings for a in ringing([gross, shift], [[later, gross], [gross]])] == [True, False]
    assert [a.rings for a in ringing([Alarm(VALUE, 30, 30, 1.0, 0.1)], [[later]])] == [True]  # a value of a shift


@pytest.mark.parametrize("before", [None, 40, 100])
@pytest.mark.parametrize("chance", [FALSE_ALARM, 0.0009])
def test_what_is_called_findable_is_found_in_nine_of_ten_charts(before, chance):
    """The later half of 80 values. 100 charts: 90 less 3 sd of 9, less 4 for a course that is not the likeliest."""
    rng, found = np.random.default_rng(3), 0
    size = findable_shift(Baseline(0.0, 1.0, before or 80), 80, before is not None, chance)
    for _ in range(100):
        x = rng.standard_normal(80) + size * (np.arange(80) >= 40)
        base = before and estimate_baseline(rng.standard_normal(before))
        found += any(a.lasts and a.direction == "up" for a in chart(x, base, (), chance).alarms)
    assert found >= 77
    assert found_of_two_thirds(size, before, chance) <= found - 20  # and one of two thirds of it is not


def found_of_two_thirds(size: float, before: int | None, chance: float) -> int:
    rng, found = np.random.default_rng(4), 0
    for _ in range(100):
        x = rng.standard_normal(80) + size * 2 / 3 * (np.arange(80) >= 40)
        base = before and estimate_baseline(rng.standard_normal(before))
        found += any(a.lasts for a in chart(x, base, (), chance).alarms)
    return found


@pytest.mark.parametrize(("before", "n"), [(20, 80), (40, 80), (60, 200)])
def test_a_chart_of_a_small_chance_rings_as_seldom(before, n):
    """0.2 %, between the chances that were simulated: of 2000 charts 4, and 3 sd."""
    rng = np.random.default_rng(n)
    quiet = [
        chart(rng.standard_normal(n), estimate_baseline(rng.standard_normal(before)), (), 0.002) for _ in range(2000)
    ]
    assert sum(bool(made.alarms) for made in quiet) <= 4 + 6
