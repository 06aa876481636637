"""Gauge studies against the published example of the AIAG manual, and against variances that were put in."""

import numpy as np
import pytest
from scipy import stats

from accept.fleet.process_control.gauge_study import (
    _MEAN_RANGE,
    _SINGLE_RANGE,
    averages_and_ranges,
    gauge_study,
)

# AIAG, Measurement Systems Analysis, 4th ed., chapter III: ten parts, three appraisers, three trials.
A = [
    [0.29, -0.56, 1.34, 0.47, -0.80, 0.02, 0.59, -0.31, 2.26, -1.36],
    [0.41, -0.68, 1.17, 0.50, -0.92, -0.11, 0.75, -0.20, 1.99, -1.25],
    [0.64, -0.58, 1.27, 0.64, -0.84, -0.21, 0.66, -0.17, 2.01, -1.31],
]
B = [
    [0.08, -0.47, 1.19, 0.01, -0.56, -0.20, 0.47, -0.63, 1.80, -1.68],
    [0.25, -1.22, 0.94, 1.03, -1.20, 0.22, 0.55, 0.08, 2.12, -1.62],
    [0.07, -0.68, 1.34, 0.20, -1.28, 0.06, 0.83, -0.34, 2.19, -1.50],
]
C = [
    [0.04, -1.38, 0.88, 0.14, -1.46, -0.29, 0.02, -0.46, 1.77, -1.49],
    [-0.11, -1.13, 1.09, 0.20, -1.07, -0.67, 0.01, -0.56, 1.45, -1.77],
    [-0.15, -0.96, 0.67, 0.11, -1.45, -0.49, 0.21, -0.49, 1.87, -2.16],
]
AIAG = np.array([A, B, C]).transpose(2, 0, 1)  # (parts, operators, repeats)


def test_the_published_example():
    """As printed: repeatability 0.199933, reproducibility 0.226838, gauge 0.302373, parts 1.042327, total 1.085;
    27.86 % of the study, the interaction not significant (p 0.974), four categories."""
    study = gauge_study(AIAG)
    sigma = {name: component.sigma for name, component in study.components.items()}
    assert sigma["repeatability"] == pytest.approx(0.199933, abs=5e-6)
    assert sigma["reproducibility"] == pytest.approx(0.226838, abs=5e-6)
    assert sigma["gauge"] == pytest.approx(0.302373, abs=5e-6)
    assert sigma["parts"] == pytest.approx(1.042327, abs=5e-6)
    assert study.percent_of_study == pytest.approx(27.86, abs=0.005)
    assert study.table["interaction"].p == pytest.approx(0.974, abs=0.001)
    assert study.distinct_categories == 4
    assert study.pooled


def test_the_published_table_of_variances():
    """[AIAG-MSA] table III-B 7, as printed: sums of squares, degrees, mean squares."""
    rows = gauge_study(AIAG).table
    assert {name: row.degrees for name, row in rows.items()} == {
        "parts": 9, "operators": 2, "interaction": 18, "repeats": 60,
    }  # fmt: skip
    assert rows["parts"].squares == pytest.approx(88.3619, abs=5e-5)
    assert rows["operators"].mean_square == pytest.approx(1.58363, abs=5e-6)
    assert rows["interaction"].squares == pytest.approx(0.3590, abs=5e-5)
    assert rows["repeats"].squares == pytest.approx(2.7589, abs=5e-5)
    assert rows["interaction"].F == pytest.approx(0.434, abs=5e-4)


def test_the_published_form_of_averages_and_ranges():
    """[AIAG-MSA] figure III-B 16, as printed: EV 0.20188, AV 0.22963, GRR 0.30575, PV 1.10456, TV 1.14610. It rounds
    the range of the appraisers to 0.4446 (0.44467: 1.5e-4) and its constants to four digits (K2 0.5231: 0.8e-4): 2.3e-4
    together."""
    found = averages_and_ranges(AIAG)
    printed = {
        "repeatability": 0.20188,
        "reproducibility": 0.22963,
        "gauge": 0.30575,
        "parts": 1.10456,
        "total": 1.14610,
    }
    assert found == pytest.approx(printed, rel=2.5e-4)


def test_the_constants_of_the_ranges_are_those_of_normal_values():
    """Mean and mean square of the range of n, by integration of its distribution (Tippett 1925)."""
    x = np.linspace(-8.0, 8.0, 1601)
    below, step = stats.norm.cdf(x), x[1] - x[0]
    for n, d2 in _MEAN_RANGE.items():
        assert d2 == pytest.approx((1 - below**n - (1 - below) ** n).sum() * step, abs=1e-5)
    low, high = below[:, None], below[None, :]
    for n, d2_star in enumerate(_SINGLE_RANGE, 2):
        apart = 1 - high**n - (1 - low) ** n + np.clip(high - low, 0, None) ** n
        square = 2 * (np.triu(apart, 1).sum() + np.trace(apart) / 2) * step**2
        assert d2_star == pytest.approx(np.sqrt(square), abs=2e-4)  # the grid of 0.01 sigma


def test_a_study_larger_than_the_published_constants_has_none():
    assert averages_and_ranges(np.zeros((21, 3, 3))) is None
    assert averages_and_ranges(np.zeros((10, 3, 7))) is None


def test_the_worst_of_study_tolerance_and_categories_decides():
    study = gauge_study(AIAG)
    assert study.verdict() == "conditional"  # 27.9 % of the study, four categories
    assert study.verdict(tolerance=8.0) == "conditional"  # 22.7 % of the tolerance
    assert study.verdict(tolerance=1.0) == "not usable"  # 181 % of the tolerance
    assert study.decided_by() == "gauge R&R is 27.9 % of the study, at most 10 % is good"
    assert study.decided_by(tolerance=5.7) == "gauge R&R is 31.8 % of the tolerance, at most 30 % is usable"
    fine = gauge_study(AIAG.mean(axis=(1, 2), keepdims=True) + 0.01 * AIAG)
    assert fine.verdict(tolerance=8.0) == "good"
    assert fine.verdict(tolerance=0.05) == "not usable"


def test_intervals_of_the_components_cover():
    """Operators 0.3 of three, repeats 0.1, parts 1.0; 200 studies of ten parts: 95 % within the 99.9 % binomial band
    (180 to 199); generalised intervals of a component near zero cover more, never less ([Burdick])."""
    rng = np.random.default_rng(11)
    truth = {"repeatability": 0.1, "operators": 0.3, "parts": 1.0, "gauge": np.hypot(0.1, 0.3)}
    hits = dict.fromkeys(truth, 0)
    for _ in range(200):
        x = rng.standard_normal((10, 1, 1)) + 0.3 * rng.standard_normal((1, 3, 1))
        found = gauge_study(x + 0.1 * rng.standard_normal((10, 3, 3))).components
        for name, sigma in truth.items():
            hits[name] += found[name].lo <= sigma <= found[name].hi
    assert all(count >= 180 for count in hits.values()), hits


def test_a_known_library_finds_the_same_mean_squares():
    """The table with an interaction added, by `anova_lm(ols("y ~ C(part) * C(operator)"))` of statsmodels 0.15.0: sums
    of squares 99.043934444444 (9), 2.117262222222 (2), 6.428982222222 (18), 2.758933333333 (60), p 6.675189503383e-10.
    Components are their differences ([AIAG-MSA]); the last digits printed are the tolerance."""
    part, operator = np.indices((10, 3))
    study = gauge_study(AIAG + 0.5 * (part * operator % 3)[:, :, None])
    parts, operators, interaction, repeats = (
        99.043934444444 / 9,
        2.117262222222 / 2,
        6.428982222222 / 18,
        2.758933333333 / 60,
    )
    sigma = {name: component.sigma for name, component in study.components.items()}
    assert sigma["repeatability"] ** 2 == pytest.approx(repeats, rel=1e-11)
    assert sigma["interaction"] ** 2 == pytest.approx((interaction - repeats) / 3, rel=1e-11)
    assert sigma["operators"] ** 2 == pytest.approx((operators - interaction) / 30, rel=1e-11)
    assert sigma["parts"] ** 2 == pytest.approx((parts - interaction) / 9, rel=1e-11)
    assert study.table["interaction"].p == pytest.approx(6.675189503383e-10, rel=1e-9)
    assert study.degrees == 60


def test_the_components_that_were_put_in_are_found():
    """Parts 1.0, operators 0.3, interaction 0.2, repeats 0.1; 60 parts, 12 operators. Mean of 40 studies within four of
    its own standard errors."""
    rng = np.random.default_rng(2)
    found = []
    for _ in range(40):
        x = rng.standard_normal((60, 1, 1)) + 0.3 * rng.standard_normal((1, 12, 1))
        x = x + 0.2 * rng.standard_normal((60, 12, 1)) + 0.1 * rng.standard_normal((60, 12, 3))
        s = gauge_study(x).components
        found.append([s[name].sigma ** 2 for name in ("parts", "operators", "interaction", "repeatability")])
    mean, error = np.mean(found, axis=0), np.std(found, axis=0, ddof=1) / np.sqrt(40)
    assert (np.abs(mean - [1.0, 0.09, 0.04, 0.01]) < 4 * error).all()


@pytest.mark.parametrize("values", [np.ones((1, 2, 2)), np.ones((3, 3)), np.full((2, 2, 2), np.nan)])
def test_studies_that_are_none_are_refused(values):
    with pytest.raises(ValueError, match="expected"):
        gauge_study(values)
