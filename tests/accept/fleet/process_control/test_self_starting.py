"""The chart of one part: its limits against the textbook and simulation, and what it finds of a gauge that drifts."""

import numpy as np
import pytest
from scipy import stats

from accept.fleet.process_control.control_chart import SHIFT, VALUE
from accept.fleet.process_control.self_starting import (
    BEFORE,
    FEWEST,
    findable_change,
    part_chart,
    score,
    sums_limit,
)

CHANCE = 0.02
REPEATABILITY = 0.0022  # of the gauge of the quarter


def test_the_limit_of_the_sums_is_that_of_the_textbook():
    """[Montgomery] 9.1: h = 5, k = 1/2 has an average run length of 938.2 to one side, 469.1 to both."""
    assert sums_limit(100, 1.0 - np.exp(-100 / 469.1)) == pytest.approx(5.0, abs=0.001)


def test_a_score_is_the_chance_of_a_new_value_by_student():
    """The prediction of one more value of n: t = (x - mean) / (s sqrt(1 + 1/n)) with n - 1 degrees."""
    x = np.random.default_rng(3).standard_normal(9)
    assert not part_chart(x, CHANCE).sums[:BEFORE].any()
    assert score(x[BEFORE - 1], x[: BEFORE - 1], 0.0) is None
    t = (x[8] - x[:8].mean()) / (x[:8].std(ddof=1) * np.sqrt(1 + 1 / 8))
    assert score(x[8], x[:8], 0.0) == pytest.approx(stats.norm.ppf(stats.t(7).cdf(t)))


@pytest.mark.parametrize("n", [13, 52, 130])
def test_a_bench_in_control_rings_in_one_chart_of_fifty(n):
    """1000 charts: 2 % + 3 sd of the count is 3.3 %; the limit counts sums as if they began in the middle of a long
    series, so short charts ring less."""
    rng = np.random.default_rng(n)
    rang = sum(bool(part_chart(rng.standard_normal(n), CHANCE).alarms) for _ in range(1000))
    assert rang <= 33
    assert n < 100 or rang >= 7


def drifting(rng: np.random.Generator, before: int, a_week: int) -> tuple[np.ndarray, np.ndarray]:
    """A gauge that drifts by 1.5 % in four weeks of thirteen, then is calibrated, and which values are off."""
    days = np.array([7 * week + 4 * k // a_week for week in range(13) for k in range(a_week)])
    drift = np.where((days >= 21) & (days < 49), 0.015 * (days - 21) / 28, 0.0)
    true = np.concatenate([np.zeros(before), drift])
    return 1.0 + true + REPEATABILITY * rng.standard_normal(true.size), true > 0


@pytest.mark.parametrize(
    ("before", "a_week", "least", "most"),
    [
        (0, 4, 0.95, 1.0),  # each shift: 99 %
        (5, 2, 0.83, 1.0),  # 93 %, and in 6 % more with an end or a beginning that is too far off
        (0, 2, 0.88, 1.0),  # 95 %
        (0, 1, 0.23, 0.55),  # 38 %: three Mondays before the drift know the spread to 50 %
    ],
)
def test_a_drift_of_a_gauge_is_found_if_the_unit_is_measured_each_shift(before, a_week, least, most):
    """At the chance of one of five quantities. Percentages are of 300 charts; 100 here: 3 sd of a count of 77 is 13."""
    rng, found = np.random.default_rng(7), 0
    for _ in range(100):
        x, off = drifting(rng, before, a_week)
        found += any(
            a.rule == SHIFT and off[a.first : a.last + 1].mean() > 0.6 for a in part_chart(x, CHANCE / 5).alarms
        )
    assert least <= found / 100 <= most


def test_a_shift_has_its_beginning_its_end_and_its_size_and_is_no_part_of_the_limits():
    x = 360.0 + np.random.default_rng(11).standard_normal(80)
    x[40:52] += 5.0
    made = part_chart(x, CHANCE)
    (alarm,) = made.alarms
    assert (alarm.rule, alarm.first, alarm.last) == (SHIFT, 40, 51)
    assert alarm.size == pytest.approx(5.0, abs=1.5 * alarm.U)
    assert made.baseline.sigma == pytest.approx(1.0, rel=0.26)  # 3 sd of 68 values
    assert (made.baseline.n, made.baseline.left_out) == (68, 12)


def test_one_gross_value_is_no_shift():
    x = np.random.default_rng(12).standard_normal(40)
    x[30] += 12.0
    (alarm,) = part_chart(x, CHANCE).alarms
    assert (alarm.rule, alarm.first, alarm.last) == (VALUE, 30, 30)


def test_equal_readings_of_a_coarse_meter_ring_at_no_single_step():
    assert not part_chart(np.full(30, 4.96), CHANCE).alarms
    assert not part_chart(np.array([4.96] * 20 + [4.97] + [4.96] * 9), CHANCE).alarms
    assert part_chart(np.array([4.96] * 20 + [5.06] * 9), CHANCE).alarms


def test_a_value_that_is_missing_is_refused():
    with pytest.raises(ValueError, match="all finite"):
        part_chart(np.array([1.0, np.nan]), CHANCE)


def test_a_gross_value_just_after_a_shift_is_not_a_good_one():
    x = np.random.default_rng(11).standard_normal(80)
    x[40:52] += 5.0
    x[53] -= 12.0
    assert (VALUE, 53) in [(alarm.rule, alarm.first) for alarm in part_chart(x, CHANCE).alarms]


@pytest.mark.parametrize("n", [13, 30])
def test_a_chart_finds_the_changes_that_it_says_it_finds(n):
    """Of the later half, at the chance of one of five quantities: nine of ten. 100 charts: 3 sd of 90 is 9."""
    rng, half = np.random.default_rng(n), n // 2
    for size, shape in zip(findable_change(n), (np.ones(half), np.arange(1, half + 1) / half), strict=True):
        off = np.concatenate([np.zeros(n - half), size * shape])
        charts = (part_chart(rng.standard_normal(n) + off, CHANCE / 5) for _ in range(100))
        assert sum(any(a.rule == SHIFT for a in made.alarms) for made in charts) >= 81
    assert findable_change(FEWEST - 1) is None
