"""Scales of skewed values: charts of a size that cannot be below zero ring no more often than others."""

import numpy as np
import pytest

from accept.fleet.process_control.capability import normality
from accept.fleet.process_control.control_chart import FALSE_ALARM, chart
from accept.fleet.process_control.scale import POWERS, as_measured, from_scale, scale_of, to_scale


@pytest.mark.parametrize("name", POWERS)
def test_a_scale_and_back(name):
    x = np.array([0.02, 0.9, 4.0, 360.0])
    assert from_scale(to_scale(x, name), name) == pytest.approx(x)


def test_normal_values_stay_as_measured_and_skewed_ones_become_normal():
    rng = np.random.default_rng(1)
    assert scale_of(360.0 + 4.0 * rng.standard_normal(200)) == ""
    assert scale_of(rng.standard_normal(200)) == ""  # some below zero
    for x in (2.5 * rng.weibull(1.6, 300), np.exp(0.5 * rng.standard_normal(300))):
        assert normality(x) < 0.005
        assert normality(to_scale(x, scale_of(x))) > 0.005


def test_a_drift_is_no_skewness():
    rng = np.random.default_rng(2)
    drifting = [scale_of(360.0 + 4.0 * rng.standard_normal(200) - np.linspace(0.0, 30.0, 200)) for _ in range(40)]
    assert drifting.count("") >= 37


def rings(x: np.ndarray) -> bool:
    name = scale_of(x)
    return bool(as_measured(chart(to_scale(x, name)), x, name).alarms)


def test_skewed_values_in_control_ring_as_rarely_as_normal_ones():
    """200 Weibull values: as measured every third chart rings. 150 charts at twice `FALSE_ALARM`, and 3 sd."""
    rng = np.random.default_rng(3)
    x = rng.weibull(1.6, (150, 200))
    assert sum(map(rings, x)) <= 150 * 2.0 * FALSE_ALARM + 3.0 * (150 * 0.04 * 0.96) ** 0.5
    assert sum(bool(chart(row).alarms) for row in x) > 35


def test_what_the_chart_says_is_as_measured():
    rng = np.random.default_rng(4)
    x = np.exp(1.0 + 0.4 * rng.standard_normal(200))
    x[120:] *= 2.0
    x[30] = 60.0
    name = scale_of(x[:120])
    made = as_measured(chart(to_scale(x, name)), x, name)
    assert (made.values == x).all()
    assert 0.0 < made.lower < made.baseline.mean < made.upper < 60.0
    gross, step = made.alarms
    assert (gross.rule, gross.first) == ("value", 30)
    assert (step.rule, step.first) == ("shift", pytest.approx(120, abs=3))
    assert made.level[119] == pytest.approx(np.e, rel=0.15)  # the median before: 120 values know it to 4 %
    assert made.level[150] == pytest.approx(2.0 * np.e, rel=0.15)
