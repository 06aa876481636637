"""Datasets: independent bins, honest noise, a tolerance that does not average away."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal, stats

from checks.errors import RecordError
from checks.fitting.dataset import STEP, Dataset, simulated
from checks.fitting.goodness import gaps, overall
from checks.fitting.whitener import NARROW, SCALES_OCTAVES, SHARE, whitener
from checks.record import Record
from checks.signals.spectral.lpm import lpm_record

FS, N = 10_000.0, 200_000
OUTPUTS = ("Vs", "de", "da")
B, A = signal.bilinear(*signal.zpk2tf([], 2 * np.pi * np.array([-5 + 600j, -5 - 600j]), (2 * np.pi * 600) ** 2), FS)


def truth(f: np.ndarray) -> np.ndarray:
    """(F, 3) of the filter, with the channels at three gains."""
    return signal.freqz(B, A, f, fs=FS)[1][:, None] * np.array([1.0, -2.0, 0.5])


def record(seed: int, sigma: float = 0.05, line_Hz: float = 0.0) -> Record:
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(N)
    y = signal.lfilter(B, A, u)
    t = np.arange(N) / FS
    channels = {"Va": u}
    for name, gain in zip(OUTPUTS, (1.0, -2.0, 0.5), strict=True):
        hum = 0.5 * np.sin(2 * np.pi * line_Hz * t) if line_Hz else 0.0
        channels[name] = gain * y + sigma * rng.standard_normal(N) + hum
    return Record(t, channels, {"Va": "V", "Vs": "V", "de": "m", "da": "m"}, name=f"seed {seed}", sha256="0")


def test_errors_have_the_stated_covariance_and_are_independent_between_bins() -> None:
    ratios, between = [], []
    for seed in range(4):
        data = Dataset.from_records(record(seed), f_lo=20.0, f_hi=2000.0)
        z = (data.H - truth(data.f)) / np.sqrt(data.noise)
        ratios.append(np.abs(z) ** 2)
        between.append(np.mean(z[1:] * z[:-1].conj()))
    x = np.concatenate(ratios)
    # mean of F(2, 2 nu) with nu = 35; 4 x 2329 x 3 exponential values: standard error 0.6 %, shared noise adds as much
    assert x.mean() == pytest.approx(35 / 34, abs=0.04)
    # chance beyond the 1 % point: 280 of 28,000 expected, sd 17; windows that share an estimate make it 25
    assert np.mean(x > 35 * (0.01 ** (-1 / 35) - 1)) == pytest.approx(0.01, abs=0.003)
    assert np.abs(np.mean(between)) < 4 / np.sqrt(x.size)


def test_shared_noise_has_many_degrees_of_freedom() -> None:
    data = Dataset.from_records(record(0), f_lo=20.0, f_hi=2000.0)
    own = Dataset.of(lpm_record(record(0), "Va", OUTPUTS, 20.0, 2000.0, step=STEP))
    assert np.median(data.nu) == 35.0  # five windows of seven
    assert np.median(own.nu) == 7.0
    # the log of a mean of n exponentials has the variance 1 / n; what the input's power adds is in both
    gained = np.log(own.noise[:, 0]).var() - np.log(data.noise[:, 0]).var()
    assert gained == pytest.approx(1 / 7 - 1 / 35, rel=0.35)


def test_a_line_of_the_mains_keeps_its_own_noise_and_harms_no_neighbour() -> None:
    quiet = Dataset.from_records(record(3), f_lo=20.0, f_hi=400.0)
    hum = Dataset.from_records(record(3, line_Hz=150.0), f_lo=20.0, f_hi=400.0)
    at = np.abs(hum.f - 150.0) < 0.5
    assert at.sum() == 1
    assert (hum.noise[at] > 100 * quiet.noise[at]).all()
    assert hum.nu[at] == 7.0
    beside = (np.abs(hum.f - 150.0) < 5) & ~at
    np.testing.assert_allclose(hum.noise[beside], quiet.noise[beside], rtol=0.5)
    squared = np.abs(hum.H - truth(hum.f)) ** 2 / hum.noise
    assert squared.max() < 35 * (1e-6 ** (-1 / 35) - 1)  # of 1,300 values


def test_bands_join_at_the_merging_frequency() -> None:
    data = Dataset.from_records(record(0), record(1), 350.0, f_lo=20.0, f_hi=1000.0)
    low, high = (Dataset.from_records(record(k), f_lo=20.0, f_hi=1000.0) for k in (0, 1))
    below = int(np.sum(low.f <= 350.0))
    np.testing.assert_array_equal(data.H[:below], low.H[:below])
    assert (np.diff(data.f) > 0).all()
    assert data.f[-1] > 990.0
    above = data.f[below:]
    at = np.searchsorted(high.f, above[np.isin(above, high.f)])
    np.testing.assert_array_equal(data.H[below:][np.isin(above, high.f)], high.H[at])
    squared = np.abs(data.H[below:] - truth(above)) ** 2 / data.noise[below:]
    assert squared.mean() == pytest.approx(35 / 34, abs=0.15)  # 2,300 values: sd 2 %, shared noise as much again


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"channels": ("Vs", "dx")}, "no channel dx"),
        ({"f_lo": 4999.7, "f_hi": 4999.9}, "no bin"),
        ({"high": True, "merge_Hz": None}, "merge_Hz is None"),
        ({"high": True, "merge_Hz": 5.0}, "merge_Hz is 5"),
    ],
)
def test_refusals_name_the_value(arguments: dict, words: str) -> None:
    given = dict(arguments)
    high = record(1) if given.pop("high", False) else None
    with pytest.raises(RecordError, match=words):
        Dataset.from_records(record(0), high, **given)


def test_select_and_band_keep_the_rows_together() -> None:
    data = flat(40, 0.1).around(np.full((40, 3), 2.0 + 0j))
    some = data.select(["da", "Vs"]).band(100.0, 200.0)
    assert some.channels == ("da", "Vs")
    assert some.cov.shape == (some.f.size, 2, 2)
    assert some.reference.shape == (some.f.size, 2)
    with pytest.raises(RecordError, match="no channel 'de2'"):
        data.select(["de2"])
    assert data.thinned(10).f.size <= 10


def flat(bins: int, tolerance: float, noise: float = 1e-3, nu: float = np.inf) -> Dataset:
    f = np.geomspace(10.0, 2000.0, bins)
    cov = np.tile(noise**2 * (np.eye(3) + 0.5j * np.diag([1, 0], 1) - 0.5j * np.diag([1, 0], -1)), (bins, 1, 1))
    return Dataset(f, np.ones((bins, 3), complex), OUTPUTS, cov, np.full(bins, nu), tolerance)


def test_noise_alone_is_white_after_whitening() -> None:
    rng = np.random.default_rng(5)
    data = flat(30, 0.0)
    draws = [simulated(data.f, data.H, OUTPUTS, data.cov, rng).H - data.H for _ in range(2000)]
    white = data.whitener(np.array(draws))
    C = white.T @ white / len(draws)
    assert np.abs(C - np.eye(len(C))).max() < 5.5 / np.sqrt(
        len(draws)
    )  # 16,000 entries of sd 1 / sqrt(n), sqrt(2) more


def test_whitening_inverts_the_stated_covariance() -> None:
    """W^T W is the inverse of noise, narrow errors and smooth errors together, built here entry by entry."""
    data = flat(25, 0.02)
    F, C = data.H.shape
    narrow = np.maximum(1.0, NARROW * data.f / np.gradient(data.f))
    total = np.zeros((F * C, F * C), complex)
    for i in range(F):
        block = data.cov[i] + np.eye(C) * SHARE * data.tolerance**2 * narrow[i]
        total[i * C : i * C + C, i * C : i * C + C] = block
    x = np.log2(data.f / data.f[0])
    for width in SCALES_OCTAVES:
        for k in range(int(np.ceil(x[-1] / width)) + 1):
            away = np.abs(x / width - k)
            bump = np.where(away < 1, np.cos(np.pi / 2 * away), 0.0)
            for c in range(C):
                column = np.zeros((F, C))
                column[:, c] = bump * np.sqrt(SHARE) * data.tolerance
                total += np.outer(column.ravel(), column.ravel())
    # of a circular complex vector: real and imaginary parts have half of it each
    wanted = 0.5 * np.block([[total.real, -total.imag], [total.imag, total.real]])
    basis = np.vstack([np.eye(F * C), 1j * np.eye(F * C)]).reshape(2 * F * C, F, C)
    W = whitener(data.f, data.H, data.cov, data.nu, data.tolerance)(basis)
    np.testing.assert_allclose(
        W @ W.T, np.linalg.inv(wanted), rtol=1e-6, atol=1e-6 * np.abs(np.linalg.inv(wanted)).max()
    )


@pytest.mark.parametrize("bins", [100, 1000, 10_000])
def test_a_tolerance_does_not_average_away(bins: int) -> None:
    """A gain known through any number of bins stays unknown by most of the tolerance."""
    data = flat(bins, 0.01, noise=1e-5)
    sensitivity = data.whitener(data.H * np.array([1.0, 0.0, 0.0]))
    sd = 1 / np.linalg.norm(sensitivity)
    assert 0.2 * 0.01 < sd < 0.01


def test_G_is_one_for_noise_and_grows_with_a_real_difference() -> None:
    rng = np.random.default_rng(2)
    data = flat(2000, 0.0, nu=35.0)
    # the covariance that is stated is an estimate: that of 35 complex degrees of freedom
    stated = data.cov * (rng.gamma(35.0, 1 / 35.0, 2000))[:, None, None]
    drawn = simulated(data.f, data.H, OUTPUTS, data.cov, rng)
    measured = Dataset(data.f, drawn.H, OUTPUTS, stated, data.nu)
    found = gaps([measured], [measured.H - data.H])
    for gap in found.values():
        assert gap.G == pytest.approx(1.0, abs=0.1)  # 2,000 bins: sd 2.5 %
        assert gap.p > 1e-3
    assert overall(found).G == pytest.approx(1.0, abs=0.06)
    wrong = gaps([measured], [measured.H - 1.002 * data.H])  # twice the noise off
    assert all(gap.G > 3.0 and gap.p < 1e-6 for gap in wrong.values())


def test_p_of_G_is_uniform_where_nothing_is_wrong() -> None:
    rng = np.random.default_rng(4)
    data = flat(300, 0.0, nu=35.0)
    p = []
    for _ in range(200):
        stated = data.cov * (rng.gamma(35.0, 1 / 35.0, 300))[:, None, None]
        drawn = simulated(data.f, data.H, OUTPUTS, data.cov, rng)
        p.append(gaps([Dataset(data.f, drawn.H, OUTPUTS, stated, data.nu)], [drawn.H - data.H])["de"].p)
    assert stats.kstest(p, "uniform").pvalue > 1e-3


def test_a_kept_dataset_whitens_the_same_and_takes_the_room_of_its_arrays() -> None:
    """Red before: 14.8 MB for 0.5 MB of arrays."""
    data = replace(Dataset.from_records(record(5), f_lo=20.0, f_hi=2000.0), tolerance=0.01)
    residual = 0.02 * data.H
    white = data.whitener(residual)
    kept = pickle.dumps(data)
    assert len(kept) < 1.1 * sum(x.nbytes for x in (data.f, data.H, data.cov, data.nu)) + 2000
    np.testing.assert_array_equal(pickle.loads(kept).whitener(residual), white)
