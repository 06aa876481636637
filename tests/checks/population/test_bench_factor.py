"""What several units have alike is found, what one of them has is not; where records tell nothing, nothing is
learned."""

import numpy as np
import pytest

from checks.arrays import Array, Complex
from checks.fitting import Dataset
from checks.fitting.goodness import misfit
from checks.population.bench_factor import learn_factor

F = np.arange(10.0, 2000.0, 4.25)
CHANNELS = ("Vs", "de")
NOISE = 2e-3  # relative, 1 sd


def resonance(f: Array, f0: float, size: float) -> Complex:
    x = f / f0
    return size / (1.0 - x * x + 0.04j * x)


def truth() -> Complex:
    """A filter's magnitude on Vs, a resonance on de."""
    return np.array([-0.02 * (F / 2000.0) ** 2 + 0j, resonance(F, 420.0, 0.01)]).T


def ratios(units: int, d: Complex, seed: int = 1, scatter: float = 0.0) -> tuple[Complex, Array, Array]:
    rng = np.random.default_rng(seed)
    shape = (units, F.size, 2)
    e = NOISE * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    own = scatter * rng.standard_normal((units, 1, 2)) * np.array([0.0, 1.0])
    return d + e + own, np.full(shape, NOISE**2), np.ones(shape)


@pytest.mark.parametrize("units", [3, 8])
def test_what_all_have_alike_is_found(units: int) -> None:
    d = truth()
    found = learn_factor(F, *ratios(units, d), CHANNELS).learned
    off = np.abs(found.factor - d) / np.hypot(found.sd, 1e-4)
    # 936 values: of each, |error| / sd of a complex normal is beyond 3 once in 8000; what is smoothed adds a little
    assert np.mean(off < 3.0) > 0.97
    assert np.median(found.sd) < NOISE / np.sqrt(units)  # smooth where it may be
    assert np.median(found.tolerance) < NOISE


def test_a_latency_is_left_to_its_name() -> None:
    """5 us on Vs: the units' own fits have to give it, not a factor without a name."""
    late = np.array([np.exp(-2j * np.pi * F * 5e-6) - 1.0, resonance(F, 420.0, 0.01)]).T
    found = learn_factor(F, *ratios(4, late), CHANNELS).learned
    assert np.abs(found.factor[:, 0]).max() < 0.1 * np.abs(late[:, 0]).max()
    assert np.abs(found.factor[:, 1] - late[:, 1]).max() < 0.1 * np.abs(late[:, 1]).max()


def test_nothing_is_learned_from_noise() -> None:
    found = learn_factor(F, *ratios(5, np.zeros((F.size, 2), dtype=complex)), CHANNELS).learned
    assert np.sqrt(np.mean(np.abs(found.factor) ** 2)) < 0.3 * NOISE


def test_an_effect_of_one_unit_is_not_the_bench_s() -> None:
    """One of four has a resonance of its own, fifty times the noise: the bench does not show a fortieth of it."""
    d = truth()
    r, noise, sizes = ratios(4, d)
    own = np.zeros((F.size, 2), dtype=complex)
    own[:, 1] = resonance(F, 900.0, 0.1)
    r[2] += own
    found = learn_factor(F, r, noise, sizes, CHANNELS)
    peak = np.argmax(np.abs(own[:, 1]))
    assert np.abs(found.learned.factor[peak, 1] - d[peak, 1]) < np.abs(own[peak, 1]) / 40.0
    assert found.weights[2, peak, 1] < 0.1
    assert found.weights[[0, 1, 3], peak, 1].min() > 0.5


def test_what_differs_from_unit_to_unit_is_tolerated() -> None:
    """A gain of de that scatters by 2 %: the tolerance there is that, wider by what eight units do not know of it."""
    found = learn_factor(F, *ratios(8, truth(), scatter=0.02), CHANNELS).learned
    assert 0.012 < np.median(found.tolerance[:, 1]) < 0.04  # a scatter from eight is known to a quarter
    assert np.median(found.tolerance[:, 0]) < NOISE


def test_fewer_frequencies_say_the_same() -> None:
    learned = learn_factor(F, *ratios(5, truth()), CHANNELS).learned
    small = learned.simplified()
    assert small.f.size < 0.7 * F.size
    for i, c in enumerate(CHANNELS):
        near = np.maximum(0.15 * np.hypot(learned.sd, learned.tolerance)[:, i], 3e-4)
        assert (np.abs(np.asarray(small.at(F, c)) - 1.0 - learned.factor[:, i]) < 1.5 * near).all()


def test_a_misfit_stays_in_its_band_and_channel() -> None:
    H = np.ones((F.size, 2), dtype=complex)
    measured = H.copy()
    inside = (F > 400.0) & (F < 500.0)
    measured[inside, 1] *= 1.2
    cov = np.zeros((F.size, 2, 2), dtype=complex)
    cov[:, [0, 1], [0, 1]] = 1e-6
    data = Dataset(F, measured, CHANNELS, cov, np.full(F.size, np.inf), 0.01)
    found = misfit(data, H)
    assert found[(F > 430.0) & (F < 470.0), 1].max() == pytest.approx(0.2 / np.sqrt(np.log(2.0)), rel=0.1)
    assert not found[(F < 330.0) | (F > 600.0)].any()
    assert not found[:, 0].any()
