"""Control charts against textbook data, closed forms, and the rates at which they ring."""

import numpy as np
import pytest

from accept.fleet.process_control.control_chart import (
    FALSE_ALARM,
    LEAST,
    NELSON,
    chart,
    estimate_baseline,
    false_alarm_rate,
    nelson,
    simulated_rate,
)
from accept.fleet.process_control.spread import D2, moving_range_degrees, moving_range_sigma

COSTS = [310, 288, 297, 298, 307, 303, 294, 297, 308, 306, 294, 299, 297, 299, 314, 295, 293, 306, 301, 304]


def test_the_spread_is_that_of_the_textbook():
    """Loan processing costs of 20 weeks ([Montgomery] example 6.5): mean 300.5, mean moving range 7.79, limits of three
    sigma 279.78 and 321.22 (the book rounds); in control."""
    made = chart(np.array(COSTS, dtype=float))
    assert made.baseline.mean == pytest.approx(300.5)
    assert made.baseline.sigma * D2 == pytest.approx(7.79, abs=0.005)
    assert 300.5 - 3.0 * made.baseline.sigma == pytest.approx(279.78, abs=0.02)
    assert not made.alarms


def test_degrees_of_freedom_of_the_moving_range():
    """By simulation: 1 / (2 nu) is the relative variance of the estimate; 20,000 draws know it to 1 % (2 % allowed)."""
    rng = np.random.default_rng(3)
    sigmas = [moving_range_sigma(row) for row in rng.standard_normal((20_000, 25))]
    assert 1.0 / (2.0 * np.var(sigmas)) == pytest.approx(moving_range_degrees(25), rel=0.03)


def test_gross_values_do_not_widen_a_baseline():
    rng = np.random.default_rng(4)
    x = 360.0 + 4.0 * rng.standard_normal(100)
    x[[20, 60]] = 181.0
    base = estimate_baseline(x)
    assert (base.n, base.left_out) == (98, 2)
    assert base.sigma == pytest.approx(4.0, rel=0.2)  # 100 values know it to 9 % (1 sd)
    assert base.mean == pytest.approx(360.0, abs=1.6)  # 4 standard errors


@pytest.mark.parametrize(("n", "before"), [(30, None), (200, None), (200, 20), (200, 60)])
def test_a_process_in_control_rings_in_one_chart_of_fifty(n, before):
    """`FALSE_ALARM` in the whole chart; 1000 charts, so 0.02 + 3 sd = 0.033 at most."""
    assert false_alarm_rate(n, before) <= FALSE_ALARM + 0.013


@pytest.mark.parametrize(("n", "before"), [(20, None), (200, None), (50, 20), (200, 50)])
def test_the_stated_rate_is_the_simulated_one(n, before):
    """The table is of the present tests of a chart: the simulation is seeded, so both are equal."""
    assert false_alarm_rate(n, before) == simulated_rate(n, before, ())


@pytest.mark.parametrize(("before", "n"), [(33, 80), (45, 120), (40, 700)])
def test_limits_between_and_beyond_the_simulated_ones_ring_as_seldom(before, n):
    """200 charts each, so 0.02 + 3 sd = 0.05 at most."""
    rng = np.random.default_rng(before)
    quiet = [chart(rng.standard_normal(n), estimate_baseline(rng.standard_normal(before))).alarms for _ in range(200)]
    assert np.mean([bool(alarms) for alarms in quiet]) <= 0.05


@pytest.mark.parametrize(("before", "asked"), [(40, 0.85), (60, 0.90)])
def test_a_drift_of_a_meter_within_a_month_is_found(before, asked):
    """A stroke of 361 um drifts by 1.5 % over 80 units of a standard deviation of 4.08 um; by 1,000 charts 0.872 and
    0.938 are found (a weighted mean with limits by Bonferroni: 0.48 and 0.60). 400 charts: sd 0.017, 2 sd below."""
    rng = np.random.default_rng(before)
    found = 0
    for _ in range(400):
        base = estimate_baseline(rng.standard_normal(before))
        alarms = chart(rng.standard_normal(80) + np.linspace(0.0, 0.015 * 361.0 / 4.08, 80), base).alarms
        found += any(a.lasts and a.direction == "up" for a in alarms)
    assert found / 400 >= asked - 0.034


def test_rules_of_runs_cost_false_alarms_and_the_rate_says_so():
    assert false_alarm_rate(200, 60, (1, 2, 3, 4)) > 0.5


def test_a_drift_that_gross_values_would_hide_is_seen_with_direction_and_size():
    """Two sigma over 200 units, two units grossly off: the whole month that a chart of 3 sigma of all values misses."""
    rng = np.random.default_rng(6)
    named = 0
    for _ in range(50):
        x = rng.standard_normal(200) - np.linspace(0.0, 2.0, 200)
        x[[31, 150]] = -45.0
        alarms = chart(x).alarms
        gross = [a for a in alarms if a.rule == "value"]
        lasting = [a for a in alarms if a.rule in ("shift", "drift")]
        assert {31, 150} <= {a.first for a in gross}
        assert all(a.direction == "down" for a in lasting)
        named += bool(lasting)
        for a in lasting:
            if a.rule == "drift":
                assert abs(a.size + 2.0) < 2.0 * a.U  # U is 0.5; a drift is named only in some, so 4 sd of those
    assert named >= 48  # a change of one sigma between the halves is 7 standard errors, 3.9 are needed


def test_a_step_is_placed_where_it_began_and_not_before():
    """1.5 sigma at unit 100 of 200, with and without a baseline of 60: median of the first unit named within one of
    it, 9 of 10 within 8 (the step's place is known to some (sigma / size)^2 units)."""
    rng = np.random.default_rng(7)
    for before in (None, 60):
        first = []
        for _ in range(60):
            x = rng.standard_normal(200)
            x[100:] += 1.5
            made = chart(x) if before is None else chart(x[before:], estimate_baseline(x[:before]))
            steps = [a for a in made.alarms if a.rule == "shift" and a.direction == "up"]
            first += [steps[0].first + (before or 0)] if steps else []
        assert len(first) >= 55
        assert np.median(first) == pytest.approx(100, abs=1)
        assert np.mean(np.abs(np.array(first) - 100) <= 8) >= 0.9
        assert np.mean(np.array(first) < 80) <= 0.05  # `FALSE_ALARM` of the charts ring before the step


def test_the_size_of_a_step_lies_within_its_uncertainty():
    """U is twice the standard deviation; the beginning is chosen so that the step is largest, so 85 % instead of 95."""
    rng = np.random.default_rng(8)
    hits = 0
    for _ in range(100):
        x = rng.standard_normal(120)
        x[60:] -= 2.0
        steps = [a for a in chart(x).alarms if a.rule == "shift"]  # one in a hundred is named a drift: a miss here
        hits += bool(steps) and abs(steps[0].size + 2.0) <= steps[0].U
    assert hits >= 85


def test_a_shift_that_ends_is_one_alarm_with_its_end():
    rng = np.random.default_rng(9)
    x = rng.standard_normal(150)
    x[50:80] += 2.5
    (alarm,) = [a for a in chart(x, estimate_baseline(rng.standard_normal(100))).alarms if a.rule == "shift"]
    assert alarm.first == pytest.approx(50, abs=3)
    assert alarm.last == pytest.approx(80, abs=8)  # the sum needs some units to come back


def test_a_drift_is_named_a_drift_and_a_step_a_step():
    """Two sigma over 200 units against 1.5 sigma at the middle: a line and a step explain the same values nearly alike
    (a step three quarters of a line's variance), so nine of ten and not all."""
    rng = np.random.default_rng(16)
    ramp, step = np.linspace(0.0, 2.0, 200), np.repeat([0.0, 1.5], 100)
    named = {"drift": 0, "shift": 0}
    for rule, truth in (("drift", ramp), ("shift", step)):
        for _ in range(60):
            named[rule] += [a.rule for a in chart(rng.standard_normal(200) + truth).alarms if a.lasts] == [rule]
    assert named["drift"] >= 0.87 * 60  # 93 % by simulation of 300; 87 % is 2 sd below
    assert named["shift"] >= 0.90 * 60  # 96 % are one shift alone; 90 % is 2.4 sd below


@pytest.mark.parametrize("before", [None, 60])
def test_many_in_a_row_that_are_far_off_are_one_shift(before):
    """A lot of 12 units six sigma off: its first and last unit, its size, and nothing else, its end least of all."""
    rng = np.random.default_rng(17)
    x = rng.standard_normal(120)
    x[70:82] -= 6.0
    (alarm,) = chart(x, before and estimate_baseline(rng.standard_normal(before))).alarms
    assert (alarm.rule, alarm.first, alarm.last, alarm.direction) == ("shift", 70, 81, "down")
    assert alarm.size == pytest.approx(-6.0, abs=alarm.U)


def test_a_value_at_the_edge_of_a_shift_is_no_gross_value():
    """The first unit of a shift may by chance lie on the other side of its beginning."""
    rng = np.random.default_rng(18)
    gross = 0
    for _ in range(60):
        x = rng.standard_normal(100)
        x[50:] += 6.0
        gross += sum(a.rule == "value" for a in chart(x).alarms)
    assert gross <= 4  # `FALSE_ALARM` of 60 charts is 1.2


PATTERNS = {
    1: [0.1, -0.2, 3.1],
    2: [0.3] * 9,
    3: [-0.6, -0.3, 0.1, 0.4, 0.8, 1.2],
    4: [0.5, -0.5] * 7,
    5: [2.1, 0.3, 2.2],
    6: [1.1, 1.2, 0.2, 1.3, 1.1],
    7: [0.2, -0.3] * 7 + [0.4],
    8: [1.2, -1.1] * 4,
}


@pytest.mark.parametrize("rule", NELSON)
def test_each_rule_rings_at_the_value_that_completes_it(rule):
    z = np.array(PATTERNS[rule])
    assert z.size - 1 in nelson(z)[rule]
    if rule not in (1, 5, 6):  # these need fewer values than their window holds
        assert rule not in nelson(z[1:])
    assert rule not in nelson(z[:-1])


def test_rule_one_rings_as_often_as_normal_values_do():
    """0.27 % of normal values: 54 of 20,000 expected, sd 7.3."""
    assert 30 < nelson(np.random.default_rng(5).standard_normal(20_000))[1].size < 80


@pytest.mark.parametrize("values", [np.ones(LEAST - 1), np.array([1.0] * 9 + [np.nan]), np.ones((4, 4))])
def test_too_few_or_missing_values_are_refused(values):
    with pytest.raises(ValueError, match="expected"):
        chart(values)


def test_values_that_never_change_ring_nothing():
    assert chart(np.full(20, 3.0)).alarms == ()
    (alarm,) = chart(np.array([3.0] * 19 + [4.0])).alarms
    assert (alarm.rule, alarm.first, alarm.direction) == ("value", 19, "up")
