"""Filters, means and peaks against scipy, whose functions they stand for."""

import numpy as np
import pytest
from scipy import ndimage, signal

from checks.signals.spectral.recursion import moving_mean, peaks, recursion, smooth_lowpass


@pytest.mark.parametrize(
    ("b", "a"), [([0.03, 0.02], [1.0, -0.95]), ([0.1, 0.2, 0.1], [1.0, -1.6, 0.81]), ([0.5, -0.5], [1.0, 0.5j - 0.7])]
)
def test_a_recursion_is_that_of_scipy(b: list[complex], a: list[complex]) -> None:
    x = np.random.default_rng(1).standard_normal(5000).astype(np.result_type(*a, float))
    expected = signal.lfilter(b, a, x)
    np.testing.assert_allclose(recursion(b, a, x), expected, rtol=0, atol=1e-13 * np.abs(expected).max())  # rounding


@pytest.mark.parametrize(("fs", "corner_Hz", "n"), [(200.0, 20.0, 2000), (1e4, 60.0, 50_000), (1e3, 3.0, 12)])
def test_the_lowpass_is_that_of_scipy_up_to_both_ends(fs: float, corner_Hz: float, n: int) -> None:
    x = np.cumsum(np.random.default_rng(2).standard_normal(n)) + 100.0
    padded = min(15, n - 1)  # what scipy.signal extends by, which needs more samples than that
    expected = signal.sosfiltfilt(signal.butter(4, corner_Hz, fs=fs, output="sos"), x, padlen=padded)
    # sections of low corners lose digits to their sums: 1e-12 of the corner's 60 Hz at 10 kHz
    np.testing.assert_allclose(smooth_lowpass(x, fs, corner_Hz), expected, rtol=0, atol=1e-10 * np.ptp(x))


@pytest.mark.parametrize("count", [1, 2, 17, 40, 41, 200])
def test_a_moving_mean_is_that_of_scipy_to_the_last_digit(count: int) -> None:
    """Powers over nine decades: the order in which they are summed decides the last digits."""
    rng = np.random.default_rng(count)
    x = rng.standard_normal((200, 3)) ** 2 * 10 ** rng.uniform(-9, 0, (200, 3))
    np.testing.assert_array_equal(moving_mean(x, count), ndimage.uniform_filter1d(x, count, axis=0, mode="nearest"))


@pytest.mark.parametrize("seed", range(60))
def test_peaks_are_those_of_scipy(seed: int) -> None:
    """Noise, slow curves, and steps with flat tops."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(int(rng.integers(3, 400)))
    x = np.round(2 * x) if seed % 3 == 0 else np.cumsum(x) if seed % 3 == 1 else x
    height = rng.uniform(-1.0, 1.0, x.size) if seed % 2 else None
    distance, prominence = int(rng.integers(1, 20)), float(rng.uniform(0.0, 2.0))
    expected, _ = signal.find_peaks(x, height=height, distance=distance, prominence=prominence)
    assert peaks(x, prominence, distance, height).tolist() == expected.tolist()
