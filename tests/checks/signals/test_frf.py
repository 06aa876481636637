"""H1 against scipy, closed forms and the statistics that it states."""

import numpy as np
import pytest
from scipy import signal
from scipy.stats import binom
from scipy.stats import f as f_distribution

from checks.errors import RecordError
from checks.record import Record
from checks.signals.spectral.frf import Frf, h1, h1_record, quantile

FS = 10_000.0


@pytest.fixture(scope="module")
def noise() -> tuple[np.ndarray, np.ndarray]:
    """Input (N,) and three outputs (N, 3) with different filters, offsets and noise."""
    rng = np.random.default_rng(1)
    u = rng.standard_normal(60_001) + 3.0
    y = np.stack([signal.lfilter([1.0, 0.5], [1.0, -a], u) for a in (0.3, 0.8, -0.6)], axis=1)
    return u, y + 0.1 * rng.standard_normal(y.shape) - 7.0


def close(a: np.ndarray, b: np.ndarray) -> bool:
    """Equal to 1e-12 of the largest value around: where terms cancel, rounding is relative to the terms."""
    return bool(np.abs(a - b).max() <= 1e-12 * np.abs(b).max())


@pytest.mark.parametrize("nperseg", [1000, 999, 1024, 512])
def test_equals_scipy(noise: tuple[np.ndarray, np.ndarray], nperseg: int) -> None:
    u, y = noise
    frf = h1(u, y, FS, nperseg)
    for c in range(3):
        kwargs = {"fs": FS, "nperseg": nperseg}
        f, Syu = signal.csd(u, y[:, c], **kwargs)
        Suu = signal.welch(u, **kwargs)[1]
        # The offsets of 3 and 7 leave rounding at the first bins: the mean is summed in another order.
        assert np.abs(frf.H[:, c] * Suu / Syu - 1.0)[2:].max() < 1e-12
        assert np.abs(frf.coherence[:, c] / signal.coherence(u, y[:, c], **kwargs)[1] - 1.0)[2:].max() < 1e-12
        assert np.abs(frf.f - f).max() < 1e-9


def test_variance_is_the_closed_form(noise: tuple[np.ndarray, np.ndarray]) -> None:
    u, y = noise
    frf = h1(u, y, FS, 1000)
    K = frf.segments
    assert K == 119
    nu = K / (1 + 2 / 36 * (K - 1) / K) - 1
    assert frf.nu == pytest.approx(nu, rel=1e-12)
    # 1 - coherence loses digits where the coherence is near 1.
    expected = np.abs(frf.H) ** 2 * (1 - frf.coherence) / (frf.coherence * nu)
    assert np.abs(frf.var / expected - 1)[2:].max() < 1e-9
    assert close(frf.cov, frf.cov.conj().transpose(0, 2, 1))
    assert frf.correlation == pytest.approx((4 / 9, 1 / 36), rel=1e-3)
    assert frf.stride == 3


def test_delay_has_falling_phase() -> None:
    u = np.random.default_rng(7).standard_normal(2**17)
    frf = h1(u, 3e-6 * np.roll(u, 4), FS, 4096)
    truth = 3e-6 * np.exp(-2j * np.pi * frf.f * 4 / FS)
    # 4 of 4096 samples leave each segment; a conjugate in the wrong place is off by 2.
    assert (np.abs(frf.H[:, 0] - truth)[9:-9] / 3e-6).max() < 0.003


def test_refusals(noise: tuple[np.ndarray, np.ndarray]) -> None:
    u, y = noise
    with pytest.raises(ValueError, match=r"1400 samples hold 1 segment\(s\) of 1000 samples every 500"):
        h1(u[:1400], y[:1400], FS, 1000)
    with pytest.raises(ValueError, match="equal length"):
        h1(u, y[:-1], FS, 1000)
    with pytest.raises(ValueError, match=r"\[2\] hold NaN or inf"):
        h1(u, np.where(np.arange(3) == 1, np.where(u > 6.5, np.nan, y.T).T, y), FS, 1000)
    with pytest.raises(ValueError, match=r"\[0\] hold NaN or inf"):
        h1(np.where(u > 6.5, np.inf, u), y, FS, 1000)
    with pytest.raises(ValueError, match="sampling frequency is nan Hz"):
        h1(u, y, np.nan, 1000)
    with pytest.raises(ValueError, match="no output channel"):
        h1(u, {}, FS, 1000)


def test_no_power_is_infinite_variance_and_not_nan(noise: tuple[np.ndarray, np.ndarray]) -> None:
    _, y = noise
    frf = h1(np.full(y.shape[0], 2.5), y, FS, 1000)
    assert not frf.usable.any()
    assert np.isinf(frf.var).all()
    assert (frf.coherence == 0).all()
    assert (frf.H == 0).all()
    sine = np.sin(2 * np.pi * 0.1 * np.arange(y.shape[0]))
    frf = h1(sine, y, FS, 1000)
    assert frf.usable[100]
    assert not frf.usable[300]


def test_dead_output_is_zero_without_noise(noise: tuple[np.ndarray, np.ndarray]) -> None:
    u, y = noise
    frf = h1(u, {"live": y[:, 0], "dead": np.zeros(u.size)}, FS, 1000)
    assert (frf.select("dead").coherence == 0).all()
    assert (frf.select("dead").H == 0).all()


def test_selecting_keeps_rows_and_columns_together(noise: tuple[np.ndarray, np.ndarray]) -> None:
    u, y = noise
    frf = h1(u, {"de": y[:, 0], "da": y[:, 1], "Vs": y[:, 2]}, FS, 1000, input="Va")
    part = frf.band(100.0, 200.0).select("Vs", "de")
    assert part.channels == ("Vs", "de")
    assert part.f[[0, -1]] == pytest.approx([100.0, 200.0])
    assert (part.cov[:, 0, 1] == frf.cov[10:21, 2, 0]).all()
    assert (part.H[:, 0] == frf.H[10:21, 2]).all()
    assert frf.independent().f[1] == pytest.approx(30.0)
    with pytest.raises(KeyError, match="has: de, da, Vs"):
        frf.index("Va")


def test_record_channels() -> None:
    rng = np.random.default_rng(2)
    u = rng.standard_normal(20_000)
    record = Record(np.arange(20_000) / FS, {"Va": u, "de": 2 * u}, {"Va": "V", "de": "m"})
    frf = h1_record(record, "Va", ("de",))
    assert frf.H[1:, 0] == pytest.approx(2.0)
    assert frf.f[1] == pytest.approx(2.0)
    with pytest.raises(RecordError, match=r"no channel .*da"):
        h1_record(record, "Va", ("da",))


def test_quantile_is_that_of_F() -> None:
    nu = np.array([1.0, 7.0, 150.3])
    for p in (0.5, 0.95, 0.999999):
        assert quantile(p, nu) == pytest.approx(f_distribution.ppf(p, 2, 2 * nu), rel=1e-9)


def coverage_band(n: int) -> tuple[float, float]:
    """99.9 % band of the share of n intervals of 95 % that hold the truth."""
    lo, hi = binom.interval(0.999, n, 0.95)
    return float(lo) / n, float(hi) / n


def simulated(seed: int, nperseg: int) -> Frf:
    """Twenty segments of white noise through short filters, with correlated noise on two outputs."""
    rng = np.random.default_rng(seed)
    n = nperseg * 21 // 2
    u = rng.standard_normal(n + 10)
    e = rng.standard_normal((2, n + 10))
    y = [0.7 * u + 0.5 * e[0], signal.lfilter([0.0, 0.5], [1.0], u) + 0.4 * e[0] - 0.3 * e[1]]
    return h1(u[10:], np.stack(y, axis=1)[10:], 1.0, nperseg)


def test_regions_cover_and_covariance_is_true() -> None:
    """200 repeats, seeds fixed: regions of each channel, the cross-channel covariance and the bin correlation."""
    frfs = [simulated(seed, 256) for seed in range(200)]
    f = frfs[0].f
    truth = np.stack([np.full(f.shape, 0.7 + 0j), 0.5 * np.exp(-2j * np.pi * f)], axis=1)
    error = np.array([frf.H - truth for frf in frfs])
    inside = np.array([np.abs(frf.H - truth) <= frf.radius(0.95) for frf in frfs])
    lo, hi = coverage_band(200)
    for k in (20, 50, 80, 110):
        for c in range(2):
            assert lo <= inside[:, k, c].mean() <= hi
    lo, hi = coverage_band(200 * 40)  # bins three apart count as independent
    assert lo <= inside[:, 5:125:3, 0].mean() <= hi
    inner = slice(5, 125)
    scatter = np.einsum("sfc,sfd->cd", error[:, inner], error[:, inner].conj()) / error[:, inner, 0].size
    stated = np.mean([frf.cov[inner].mean(axis=0) for frf in frfs], axis=0)
    # 24,000 values, a third of them independent: 1.1 % standard error, taken four times.
    assert np.abs(scatter / stated - 1).max() < 0.05
    e = error[:, inner, 0]
    for lag, rho in enumerate((4 / 9, 1 / 36, 0.0), start=1):
        measured = (e[:, lag:] * e[:, :-lag].conj()).mean() / (np.abs(e) ** 2).mean()
        assert abs(measured - rho) < 0.06  # same standard error; overlap moves 4/9 by a few percent
