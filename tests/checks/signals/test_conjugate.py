"""A response and its complex conjugate differ in the side of their poles, and nothing else is taken for a conjugate."""

import numpy as np
import pytest

from checks.signals.spectral.conjugate import clear_poles, conjugate_resonances

CASES = 400  # plants with 1 to 7 modes each
POLES = 300  # clear resonances among them, at least: 568 when this was written


def plant(rng: np.random.Generator, f: np.ndarray) -> np.ndarray:
    """Return a sum of modes of either sign, as displacement, velocity or acceleration, with a delay and noise."""
    modes = rng.integers(1, 8)
    w, zeta = 2 * np.pi * rng.uniform(30, 900, modes), 10 ** rng.uniform(-3, -1.3, modes)
    s = 2j * np.pi * f
    gains = rng.choice([-1, 1], modes) * rng.uniform(0.1, 1.0, modes)
    H = sum(g * k**2 / (s**2 + 2 * z * k * s + k**2) for g, k, z in zip(gains, w, zeta, strict=True))
    H = (H + rng.uniform(-1, 1) * np.median(np.abs(H))) * s ** rng.integers(0, 3) * np.exp(-s * rng.uniform(0, 2e-3))
    noise = 10 ** rng.uniform(-4, -0.3) * (rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size))
    return H * (1 + noise / np.sqrt(2))


def test_poles_lie_on_the_side_of_the_plant() -> None:
    rng, found = np.random.default_rng(3), 0
    for _ in range(CASES):
        f = np.arange(10.0, 1000.0, 10 ** rng.uniform(-1, 0.5))
        H = plant(rng, f)
        poles = clear_poles(f, H)
        found += len(poles)
        assert all(pole.damping_ratio > 0.0 for pole in poles)
        assert not conjugate_resonances(f, H[:, None])
        assert len(conjugate_resonances(f, H.conj()[:, None])) == len(poles)
    assert found > POLES


def test_the_pole_is_that_of_the_mode() -> None:
    f = np.arange(1.0, 301.0, 0.25)
    s, w = 2j * np.pi * f, 2 * np.pi * 120
    H = w**2 / (s**2 + 2 * 0.01 * w * s + w**2)
    (pole,) = conjugate_resonances(f, H.conj()[:, None])
    assert pole.f_Hz == pytest.approx(120.0, rel=1e-3)
    assert pole.damping_ratio == pytest.approx(-0.01, rel=0.05)  # beside a parabola for the other half of the plane


def test_noise_is_no_conjugate() -> None:
    rng, f = np.random.default_rng(8), np.arange(1.0, 500.0)
    for _ in range(200):
        raw = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
        assert not conjugate_resonances(f, np.convolve(raw, np.hanning(9), "same")[:, None])
