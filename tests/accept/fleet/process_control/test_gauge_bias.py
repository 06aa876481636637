"""Bias and linearity against the published examples, Cg and Cgk against their definition."""

import numpy as np
import pytest

from accept.fleet.process_control.gauge_bias import bias_study, linearity_study

# [AIAG-MSA] chapter III B: 15 readings of a part of 6.00; and 12 readings of each of five parts.
BIAS = [5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1, 6.2, 5.6, 6.0]
LINEARITY = {
    2.0: [2.7, 2.5, 2.4, 2.5, 2.7, 2.3, 2.5, 2.5, 2.4, 2.4, 2.6, 2.4],
    4.0: [5.1, 3.9, 4.2, 5.0, 3.8, 3.9, 3.9, 3.9, 3.9, 4.0, 4.1, 3.8],
    6.0: [5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1],
    8.0: [7.6, 7.7, 7.8, 7.7, 7.8, 7.8, 7.8, 7.7, 7.8, 7.5, 7.6, 7.7],
    10.0: [9.1, 9.3, 9.5, 9.3, 9.4, 9.5, 9.5, 9.5, 9.6, 9.2, 9.3, 9.4],
}


def linearity():
    return linearity_study(np.repeat(list(LINEARITY), 12), np.concatenate(list(LINEARITY.values())))


def test_the_published_bias():
    found = bias_study(np.array(BIAS), 6.0)
    assert found.mean == pytest.approx(6.0067, abs=5e-5)
    assert found.sigma == pytest.approx(0.2120, abs=5e-5)
    assert found.bias.value == pytest.approx(0.0067, abs=5e-5)
    assert (found.bias.t, found.bias.p) == pytest.approx((0.1218, 0.9048), abs=1e-4)
    assert (found.bias.lo, found.bias.hi) == pytest.approx((-0.1107, 0.1241), abs=5e-5)
    assert not found.bias.significant
    assert found.capable is None


def test_the_published_linearity():
    found = linearity()
    assert found.slope.value == pytest.approx(-0.131667, abs=5e-7)
    assert found.intercept.value == pytest.approx(0.736667, abs=5e-7)
    assert found.r_squared == pytest.approx(0.714, abs=5e-4)
    assert found.slope.t == pytest.approx(-12.043, abs=5e-4)
    assert found.intercept.t == pytest.approx(10.158, abs=5e-4)
    means = [0.491667, 0.125, 0.025, -0.291667, -0.616667]
    assert [b.value for b in found.biases] == pytest.approx(means, abs=5e-7)
    assert not found.linear


def test_a_known_library_finds_the_same():
    from scipy.stats import linregress, ttest_1samp

    at, x = np.repeat(list(LINEARITY), 12), np.concatenate(list(LINEARITY.values()))
    line, found = linregress(at, x - at), linearity()
    assert (found.slope.value, found.slope.error, found.slope.p) == pytest.approx(
        (line.slope, line.stderr, line.pvalue)
    )
    assert (found.intercept.error, found.r_squared) == pytest.approx((line.intercept_stderr, line.rvalue**2))
    test, bias = ttest_1samp(BIAS, 6.0), bias_study(np.array(BIAS), 6.0).bias
    interval = test.confidence_interval(0.95)
    assert (bias.t, bias.p, bias.lo + 6.0, bias.hi + 6.0) == pytest.approx(
        (test.statistic, test.pvalue, interval.low, interval.high)
    )


def test_indices_of_a_study_of_type_1():
    """Readings with mean 10.02 and sigma 0.05 against 10 and a tolerance of 3: 0.2 * 3 / (6 * 0.05) = 2, and
    (0.1 * 3 - 0.02) / (3 * 0.05) = 1.8667."""
    x = np.random.default_rng(1).standard_normal(50)
    x = 10.02 + 0.05 * (x - x.mean()) / x.std(ddof=1)
    found = bias_study(x, 10.0, 3.0)
    assert (found.Cg, found.Cgk) == pytest.approx((2.0, 0.28 / 0.15))
    assert found.capable
    assert bias_study(x, 10.0, 1.9).capable is False
    assert bias_study(x + 0.2, 10.0, 3.0).capable is False  # as repeatable, but off


def test_intervals_cover():
    """2000 studies each; 95 % +- 1.5 % (3 sd)."""
    rng = np.random.default_rng(2)
    at = np.repeat([1.0, 2.0, 3.0, 4.0, 5.0], 10)
    hits = np.zeros(3)
    for _ in range(2000):
        line = linearity_study(at, at + 0.3 - 0.1 * at + rng.standard_normal(50))
        bias = bias_study(10.5 + rng.standard_normal(12), 10.0).bias
        hits += (line.slope.lo <= -0.1 <= line.slope.hi, line.intercept.lo <= 0.3 <= line.intercept.hi,
                 bias.lo <= 0.5 <= bias.hi)  # fmt: skip
    assert hits / 2000 == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize("values", [[1.0] * 12, [1.0] * 9, [1.0, np.nan] * 6, []])
def test_readings_that_are_no_study_are_refused(values):
    with pytest.raises(ValueError, match="reading"):
        bias_study(np.array(values), 1.0)
    with pytest.raises(ValueError, match="expected"):
        linearity_study(np.repeat([1.0, 2.0], 5), np.arange(10.0))
    with pytest.raises(ValueError, match="tolerance"):
        bias_study(np.array(BIAS), 6.0, 0.0)
