"""Periodic input is recognised, and its noise is what differs between periods."""

import numpy as np
import pytest
from scipy import signal
from scipy.stats import binom

from checks.signals.spectral.periodic import PeriodicPart, detect, periodic_frf

P, FS = 2048, 1024.0
LAST = 400  # highest excited line


def multisine(seed: int, first: int = 1, last: int = LAST) -> np.ndarray:
    """One period of unit rms with random phases on the lines first..last."""
    spectrum = np.zeros(P // 2 + 1, dtype=complex)
    spectrum[first : last + 1] = np.exp(2j * np.pi * np.random.default_rng(seed).random(last + 1 - first))
    x = np.fft.irfft(spectrum, P)
    return x / x.std()


@pytest.mark.parametrize("count", [2, 3, 7])
def test_period_is_found(count: int) -> None:
    found = detect(np.tile(multisine(1), count) + 2.5)
    assert found == PeriodicPart(P, 0, count, pytest.approx(0.0, abs=1e-12))


def test_ramps_and_quantisation_are_no_obstacle() -> None:
    u = np.concatenate([np.linspace(-1, 3.25, 1500), np.tile(multisine(1), 6) + 3.25, np.linspace(3.25, -1, 900)])
    found = detect(np.round(u / 3e-4) * 3e-4)
    assert found is not None
    assert found.samples == P
    assert found.count in (5, 6)  # the end of the ramp may happen to repeat, or the first sample not
    assert abs(found.start - 1500) <= P
    assert found.deviation < 1e-3


def test_slow_sine_and_fraction_of_a_sample() -> None:
    t = np.arange(40_000)
    slow = detect(np.sin(2 * np.pi * t / 10_000))
    assert slow is not None
    assert slow.samples == 10_000
    half = detect(np.sin(2 * np.pi * t / 100.5))
    assert half is not None
    assert half.samples == 201
    assert detect(np.sin(2 * np.pi * t / 100.37123)) is None


def test_what_is_not_periodic() -> None:
    rng = np.random.default_rng(2)
    t = np.arange(20_000) / 1e4
    assert detect(rng.standard_normal(20_000)) is None
    assert detect(signal.chirp(t, 10, 2, 400, "logarithmic")) is None
    assert detect(np.zeros(1000)) is None
    assert detect(np.tile(multisine(1), 4) + 0.01 * rng.standard_normal(4 * P)) is None
    assert detect(np.tile(multisine(1), 2)[:-1]) is None
    growing = np.sin(2 * np.pi * t * 10) * np.repeat([1, 2, 3, 4], 5000)
    assert detect(growing) is None


def test_variance_over_periods_covers() -> None:
    """Six periods behind a filter in its steady state, noise of known size, shared by half between two channels."""
    u = np.tile(multisine(3), 7)
    lines = np.arange(1, LAST + 1)
    truth = signal.freqz([0.3], [1.0, -0.7], lines * FS / P, fs=FS)[1]
    y = signal.lfilter([0.3], [1.0, -0.7], u)  # the filter forgets in 100 samples; one period is skipped
    inside, var, cov = [], [], []
    for seed in range(200):
        e = 0.05 * np.random.default_rng(seed).standard_normal((3, u.size))
        period = detect(u)
        assert period is not None
        frf = periodic_frf(u, {"a": y + e[0] + e[1], "b": y + e[0] + e[2]}, FS, period, input="Va")
        inside.append(np.abs(frf.H[:, 0] - truth) <= frf.radius(0.95)[:, 0])
        var.append(frf.var[:, 0])
        cov.append(frf.cov[:, 0, 1].real)
    assert frf.f == pytest.approx(lines * FS / P)
    assert frf.nu == pytest.approx(5.0)
    lo, hi = (float(x) / 200 for x in binom.interval(0.999, 200, 0.95))
    for k in (3, 100, 300):
        assert lo <= np.mean(inside, axis=0)[k] <= hi
    lo, hi = (float(x) / (200 * LAST) for x in binom.interval(0.999, 200 * LAST, 0.95))
    assert lo <= np.mean(inside) <= hi
    # E|E|^2 = P sigma^2 per period, six averaged, over |U|^2 = (P/2)^2 2/LAST: 80,000 values, 0.2 % standard error.
    expected = 2 * 0.05**2 * P / 6 / (P**2 / 4 * 2 / LAST)
    assert np.mean(var) == pytest.approx(expected, rel=0.01)
    assert np.mean(cov) == pytest.approx(expected / 2, rel=0.02)


def test_refusals() -> None:
    u = np.tile(multisine(1), 3)
    with pytest.raises(ValueError, match=r"2 period\(s\) less 1 leave 1"):
        periodic_frf(u, u, FS, PeriodicPart(P, 0, 2, 0.0))
    with pytest.raises(ValueError, match="channel 'y0' has shape"):
        periodic_frf(u, u[:-1], FS, PeriodicPart(P, 0, 3, 0.0))
    with pytest.raises(ValueError, match="channel 'y0' holds NaN or inf"):
        periodic_frf(u, np.where(np.arange(u.size) == 3000, np.nan, u), FS, PeriodicPart(P, 0, 3, 0.0))
