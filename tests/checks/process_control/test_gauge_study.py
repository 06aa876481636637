"""Gauge studies against the published example of the AIAG manual, and against variances that were put in."""

import numpy as np
import pytest

from checks.process_control.gauge_study import gauge_study

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
    assert study.repeatability == pytest.approx(0.199933, abs=5e-6)
    assert study.reproducibility == pytest.approx(0.226838, abs=5e-6)
    assert study.gauge == pytest.approx(0.302373, abs=5e-6)
    assert study.parts == pytest.approx(1.042327, abs=5e-6)
    assert study.percent_of_study == pytest.approx(27.86, abs=0.005)
    assert study.p_interaction == pytest.approx(0.974, abs=0.001)
    assert study.distinct_categories == 4


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
    assert study.repeatability**2 == pytest.approx(repeats, rel=1e-11)
    assert study.interaction**2 == pytest.approx((interaction - repeats) / 3, rel=1e-11)
    assert study.operators**2 == pytest.approx((operators - interaction) / 30, rel=1e-11)
    assert study.parts**2 == pytest.approx((parts - interaction) / 9, rel=1e-11)
    assert study.p_interaction == pytest.approx(6.675189503383e-10, rel=1e-9)
    assert study.degrees == 60


def test_the_components_that_were_put_in_are_found():
    """Parts 1.0, operators 0.3, interaction 0.2, repeats 0.1; 60 parts, 12 operators. Mean of 40 studies within four of
    its own standard errors."""
    rng = np.random.default_rng(2)
    found = []
    for _ in range(40):
        x = rng.standard_normal((60, 1, 1)) + 0.3 * rng.standard_normal((1, 12, 1))
        x = x + 0.2 * rng.standard_normal((60, 12, 1)) + 0.1 * rng.standard_normal((60, 12, 3))
        s = gauge_study(x)
        found.append([s.parts**2, s.operators**2, s.interaction**2, s.repeatability**2])
    mean, error = np.mean(found, axis=0), np.std(found, axis=0, ddof=1) / np.sqrt(40)
    assert (np.abs(mean - [1.0, 0.09, 0.04, 0.01]) < 4 * error).all()


@pytest.mark.parametrize("values", [np.ones((1, 2, 2)), np.ones((3, 3)), np.full((2, 2, 2), np.nan)])
def test_studies_that_are_none_are_refused(values):
    with pytest.raises(ValueError, match="expected"):
        gauge_study(values)
