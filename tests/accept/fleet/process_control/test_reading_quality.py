"""Two populations, steps of a meter and exchanged digits: found with their values, and seldom where nothing is."""

import numpy as np
import pytest

from accept.fleet.process_control.reading_quality import (
    AGREES,
    LIKELIER,
    exchanged,
    residuals,
    step_of,
    two_populations,
)
from accept.fleet.process_control.spread import most_sigmas
from accept.fleet.reading_alarms import coarse_meters


def test_two_populations_have_their_values():
    """Those of the quarter: 4.851 and 5.101 uF, sd 0.035. A mean of 130 is known to 0.003, a share to 0.031: 3 sd."""
    rng = np.random.default_rng(1)
    upper = rng.random(260) < 0.5
    x = np.where(upper, 5.101, 4.851) + 0.035 * rng.standard_normal(260)
    found = two_populations(x)
    assert found is not None
    assert found.means == pytest.approx((4.851, 5.101), abs=0.01)
    assert found.sigma == pytest.approx(0.035, rel=0.14)
    assert found.upper_share == pytest.approx(upper.mean(), abs=0.01)
    assert (found.upper == upper).mean() > 0.99
    # closed form: the log likelihood of a fitted normal population is -n (log sigma + 1/2) but for a constant
    one = -260 * (np.log(x.std()) + 0.5)
    parts = np.exp(-0.5 * ((x[:, None] - np.array(found.means)) / found.sigma) ** 2) / found.sigma
    two = np.log(parts @ [1 - found.upper_share, found.upper_share]).sum()
    assert found.ratio == pytest.approx(2 * (two - one), abs=0.01)


@pytest.mark.parametrize("n", [30, 200])
def test_one_population_is_not_called_two(n):
    """Simulated: 2 log likelihood ratio exceeds 14.5 in 0.1 % of samples; LIKELIER leaves less. 200 samples: none."""
    rng = np.random.default_rng(n)
    assert not any(two_populations(rng.standard_normal(n)) for _ in range(200))
    assert LIKELIER > 14.5


@pytest.mark.parametrize(("apart", "least"), [(6.0, 20), (4.0, 18)])
def test_populations_far_enough_apart_are_found(apart, least):
    """Of 20 samples of 260 values, half in either."""
    rng = np.random.default_rng(3)
    found = [two_populations(apart * (rng.random(260) < 0.5) + rng.standard_normal(260)) for _ in range(20)]
    assert sum(each is not None for each in found) >= least


@pytest.mark.parametrize("step", [0.001, 0.01, 0.02, 0.5, 5.0])
def test_the_step_of_a_meter(step):
    counts = 1000 + np.random.default_rng(4).integers(0, 400, 50)
    assert step_of(counts * step) == pytest.approx(step)
    assert step_of(np.random.default_rng(4).standard_normal(50)) is None


def test_exchanges_of_two_digits():
    assert exchanged(9.251, 0.001) == pytest.approx([2.951, 9.215, 9.521])
    assert exchanged(336.2, 0.1) == pytest.approx([332.6, 363.2])
    assert exchanged(-4.95, 0.01) == pytest.approx([-9.45, -4.59])


def units(rng: np.random.Generator, n: int = 300) -> np.ndarray:
    """Two stacks to one with a ratio known to 0.45 %, of two suppliers; a stroke of its own."""
    sensor = np.where(rng.random(n) < 0.5, 4.851, 5.101) + 0.035 * rng.standard_normal(n)
    actuator = sensor * (2.0 + 0.009 * rng.standard_normal(n))
    return np.column_stack([sensor, actuator, 362.6 + 4.0 * rng.standard_normal(n)])


def test_a_value_that_its_limits_pass_is_found_by_the_ratio_of_the_stacks():
    """9.251 for 9.521, within 8.8 to 11.0: 0.27 uF where the ratio is known to 0.045 uF, 6 sd."""
    x = units(np.random.default_rng(5))
    x[100, :2] = 4.7605, 9.251
    rest, sigmas = residuals(x)
    assert rest[100, 1] == pytest.approx(-0.27, abs=0.05)  # the level of 31 residuals is known to 0.01 uF, 3 sd
    assert sigmas[100, 1] == pytest.approx(0.045, rel=0.2)
    assert abs(rest[100, 1] / sigmas[100, 1]) > most_sigmas(900, 898, 0.001)
    assert min(abs(9.521 - (9.251 - rest[100, 1])) / sigmas[100, 1], 9.0) < AGREES
    assert abs(rest[100, 2] / sigmas[100, 2]) < 4.0


def test_a_missing_value_leaves_the_others_of_its_unit_compared():
    x = units(np.random.default_rng(6))
    x[::2, 0] = np.nan
    x[50, 2] += 60.0
    rest, sigmas = residuals(x)
    assert np.isnan(rest[::2, 0]).all()
    assert np.isfinite(rest[:, 1:]).all()
    assert rest[50, 2] / sigmas[50, 2] > most_sigmas(900, 898, 0.001)


def test_sound_units_are_seldom_called_unlike():
    """40 stores of 300 units: at a chance of 0.1 % in all their values none is expected, two would be one in 1000."""
    rng, rang = np.random.default_rng(7), 0
    for _ in range(40):
        rest, sigmas = residuals(units(rng))
        rang += bool((np.abs(rest) > most_sigmas(rest.size, rest.size - 2, 0.001) * sigmas).any())
    assert rang <= 1


def test_the_chance_of_many_readings_on_a_coarse_meter_is_a_number():
    """500 readings of a meter with ten times the step of the other: 1 in 10^500, less than the smallest number."""
    x = np.random.default_rng(8).normal(5.0, 0.2, 1000)
    bench = np.repeat(np.array(["B1", "B2"], dtype=object), 500)
    (words,) = coarse_meters(np.where(bench == "B1", x.round(3), x.round(2)), {"bench": bench}, "uF")
    assert "bench B2 shows steps of 0.01 uF, others in 0.001 uF (by chance 1 in 10^500)" in words
