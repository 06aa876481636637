"""Integration over time against closed forms."""

import numpy as np
import pytest

from checks.signals.spectral.recursion import DAMPING, CORNER_Hz, integrated

FS = 48_000.0


@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("f_Hz", [60.0, 281.0, 800.0])
def test_a_sine_comes_out_as_the_filter_says_and_near_the_integral(times: int, f_Hz: float) -> None:
    t = np.arange(int(FS)) / FS
    w, w0 = 2 * np.pi * f_Hz, 2 * np.pi * CORNER_Hz
    y = integrated(np.sin(w * t), FS, times)[int(FS) // 2 :]  # the filter's own decay is over
    s = 1j * w
    truth = abs(s ** (2 - times) / (s * s + 2 * DAMPING * w0 * s + w0 * w0))
    assert y.max() == pytest.approx(truth, rel=4e-3)  # at 800 Hz: 1.8e-3 of the bilinear transform, 1.4e-3 of sampling
    assert truth * w**times == pytest.approx(1.0, abs=0.03)


def test_an_offset_and_noise_do_not_move_what_comes_out() -> None:
    noise = 0.4 * np.random.default_rng(3).standard_normal(int(FS))
    y = integrated(5.0 + noise, FS, 2)
    assert abs(y).max() < 2e-6  # its own noise is 4.2e-7 rms; an offset of 0.4 would give 1.1e-5


def test_nothing_comes_before_a_hit() -> None:
    x = np.zeros(2000)
    x[1000:1030] = 1.0
    assert not integrated(x, FS, 2)[:1000].any()


def test_only_once_or_twice() -> None:
    with pytest.raises(ValueError, match="expected 1 or 2"):
        integrated(np.zeros(10), FS, 3)
