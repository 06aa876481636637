"""The local polynomial method against the exact response of a lightly damped mode, and the intervals it states."""

import numpy as np
import pytest
from scipy import signal
from scipy.io import loadmat
from scipy.stats import binom

from checks.errors import RecordError
from checks.record import Record
from checks.signals.spectral import transform
from checks.signals.spectral.frf import h1
from checks.signals.spectral.lpm import BATCH_BINS, lpm, lpm_record
from checks.signals.spectral.unexplained import BINS, LEAST_BLOCKS, ORDER, DrivePart, blocks
from tests.shared.recorded_units import RecordedUnits
from tests.soak import SOAK

MODE_HZ, DAMPING, SECONDS = 95.0, 0.005, 20.0


class Mode:
    """A mode driven by a held voltage, discretised exactly: what is simulated and the truth are the same filter."""

    def __init__(self, fs: float) -> None:
        w = 2 * np.pi * MODE_HZ
        self.continuous = ([w * w], [1.0, 2 * DAMPING * w, w * w])
        b, self.a, _ = signal.cont2discrete(self.continuous, 1 / fs, method="zoh")
        self.b, self.fs = b[0], fs

    def response(self, f: np.ndarray) -> np.ndarray:
        return np.asarray(signal.freqz(self.b, self.a, f, fs=self.fs)[1])

    def record(self, seed: int, noise: float, corner_Hz: float) -> tuple[np.ndarray, np.ndarray]:
        """u (N,), y (N,): low-passed noise through the mode, with white noise of this share of the rms of y."""
        rng = np.random.default_rng(seed)
        u = signal.lfilter(*signal.butter(2, corner_Hz, fs=self.fs), rng.standard_normal(int(SECONDS * self.fs)))
        y = signal.lfilter(self.b, self.a, u)
        return u, y + noise * y.std() * rng.standard_normal(y.size)


def band_95(n: int) -> tuple[float, float]:
    """99.9 % band of the share of n intervals of 95 % that hold the truth."""
    lo, hi = binom.interval(0.999, n, 0.95)
    return float(lo) / n, float(hi) / n


def test_truth_of_the_mode_is_the_continuous_one_held() -> None:
    """The hold multiplies by sinc(f/fs) and delays by half a sample; aliases of the mode are 1e-4 of it at 10 kHz."""
    f = np.array([40.0, 94.0, 95.0, 96.0, 300.0])
    mode = Mode(10_000.0)
    held = signal.freqs(*mode.continuous, 2 * np.pi * f)[1] * np.sinc(f / 1e4) * np.exp(-1j * np.pi * f / 1e4)
    assert np.abs(mode.response(f) / held - 1).max() < 5e-4


@pytest.mark.parametrize("seed", range(4))
def test_peak_is_true_where_a_window_is_not(seed: int) -> None:
    """20 s at 10 kHz of a mode at 95 Hz with 0.5 % damping: 1 % plus two standard errors against 40 %."""
    mode = Mode(10_000.0)
    u, y = mode.record(seed, noise=0.01, corner_Hz=1000.0)
    frf = lpm(u, y, mode.fs, f_lo=90.0, f_hi=100.0)
    k = int(np.argmin(np.abs(frf.f - MODE_HZ)))
    truth = np.abs(mode.response(frf.f)[k])
    standard_error = float(np.sqrt(frf.var[k, 0] / 2))
    assert abs(abs(frf.H[k, 0]) - truth) < 0.01 * truth + 2 * standard_error
    assert standard_error < 0.01 * truth
    windowed = h1(u, y, mode.fs, int(mode.fs))
    low = 1 - abs(windowed.H[95, 0]) / truth
    assert 0.25 < low < 0.55
    assert windowed.coherence[95, 0] < 0.75  # which is leakage: there is 1 % of noise
    assert frf.coherence[k, 0] > 0.999


@pytest.mark.parametrize("noise", [0.01, 0.1])
def test_regions_cover_also_at_the_peak(noise: float) -> None:
    """200 repeats, seeds fixed. 20 s at 2 kHz: the bins and the decay of 10 kHz in a fifth of the time."""
    mode = Mode(10_000.0 if SOAK else 2_000.0)
    inside = []
    for seed in range(200):
        frf = lpm(*mode.record(seed, noise, corner_Hz=400.0), mode.fs, f_lo=92.0, f_hi=130.0)
        places = [int(np.argmin(np.abs(frf.f - f))) for f in (93.5, 94.5, MODE_HZ, 95.3, 98.0, 125.0)]
        inside.append((np.abs(frf.H[:, 0] - mode.response(frf.f)) <= frf.radius(0.95)[:, 0])[places])
    lo, hi = band_95(200)
    share = np.mean(inside, axis=0)
    assert (share >= lo).all(), share
    assert (share <= hi).all(), share


@pytest.fixture(scope="module")
def smooth() -> tuple[np.ndarray, np.ndarray, float]:
    """White input, two outputs through short filters with noise of which half is shared; fs."""
    rng = np.random.default_rng(3)
    u, *e = rng.standard_normal((4, 60_000))
    y = np.stack([signal.lfilter([1.0, 0.3], [1.0, -0.5], u), np.roll(u, 3)], axis=1)
    return u, y + 0.1 * np.stack([e[0] + e[1], e[0] + e[2]], axis=1), 1000.0


def test_errors_are_as_stated(smooth: tuple[np.ndarray, np.ndarray, float]) -> None:
    """Covariance across channels, F(2, 2 nu) and the correlation of neighbours, over 1,700 independent bins."""
    u, y, fs = smooth
    frf = lpm(u, y, fs)
    z = np.exp(2j * np.pi * frf.f / fs)
    error = frf.H - np.stack([(1 + 0.3 / z) / (1 - 0.5 / z), z**-3], axis=1)
    lo, hi = band_95(frf.f.size // frf.stride)
    inside = (np.abs(error) <= frf.radius(0.95)).mean(axis=0)
    assert ((lo <= inside) & (inside <= hi)).all()
    # Mean of F(2, 14) is 7/6; 1,700 values of standard deviation 1.5 give 3 %, taken three times.
    assert (np.abs(error) ** 2 / frf.var).mean(axis=0) == pytest.approx(7 / 6, rel=0.1)
    coherent = (error[:, 0] * error[:, 1].conj() / np.sqrt(frf.var[:, 0] * frf.var[:, 1])).mean().real
    assert coherent == pytest.approx(0.5 * 7 / 6, abs=0.08)
    stated = (frf.cov[:, 0, 1] / np.sqrt(frf.var[:, 0] * frf.var[:, 1])).mean().real
    assert stated == pytest.approx(0.5, abs=0.03)
    assert frf.nu == pytest.approx(7.0)
    assert frf.stride == 17
    scaled = error[:, 0] / np.sqrt(frf.var[:, 0])
    scaled = scaled[np.abs(scaled) < 4.0]
    for lag in (1, 3, 6, 12):
        measured = (scaled[lag:] * scaled[:-lag].conj()).mean().real / np.mean(np.abs(scaled) ** 2)
        assert measured == pytest.approx(frf.correlation[lag - 1], abs=0.06)


def test_delay_has_falling_phase_and_no_bias(smooth: tuple[np.ndarray, np.ndarray, float]) -> None:
    u, _, fs = smooth
    frf = lpm(u, np.concatenate([np.zeros(4), u[:-4]]), fs, f_lo=10.0, f_hi=400.0)
    # Without noise what remains is the fit: 4 samples of 60,000 are next to nothing for a polynomial.
    assert np.abs(frf.H[:, 0] - np.exp(-2j * np.pi * frf.f * 4 / fs)).max() < 1e-6


def test_step_and_band_pick_bins_and_change_no_value(smooth: tuple[np.ndarray, np.ndarray, float]) -> None:
    u, y, fs = smooth
    every = lpm(u, {"a": y[:, 0], "b": y[:, 1]}, fs)
    some = lpm(u, {"b": y[:, 1]}, fs, f_lo=100.0, f_hi=200.0, step=5)
    picked = np.flatnonzero(np.isin(np.round(every.f * 60), np.round(some.f * 60)))
    assert some.f[[0, -1]] == pytest.approx([100.0, 200.0])
    assert some.H[:, 0] == pytest.approx(every.H[picked, 1], rel=1e-10)
    assert some.var[:, 0] == pytest.approx(every.var[picked, 1], rel=1e-10)
    assert some.stride == 4  # 15 bins apart still share two
    assert every.f[0] == pytest.approx(9 * fs / 60_000)  # 8 neighbours, and never bin 0


def test_initial_state_is_no_error() -> None:
    """A record that starts while the mode still rings from before: the transient takes it up."""
    mode = Mode(2_000.0)
    u, y = mode.record(5, noise=0.0, corner_Hz=400.0)
    ringing = signal.lfilter(mode.b, mode.a, np.zeros(u.size), zi=[50.0 * y.std(), -50.0 * y.std()])[0]
    frf = lpm(u, y + ringing, mode.fs, f_lo=60.0, f_hi=90.0)
    assert np.abs(frf.H[:, 0] / mode.response(frf.f) - 1).max() < 0.01


def test_where_nothing_drives_the_variance_says_so(smooth: tuple[np.ndarray, np.ndarray, float]) -> None:
    u, y, fs = smooth
    spectrum = np.fft.rfft(u)
    f = np.fft.rfftfreq(u.size, 1 / fs)
    inside = (f > 100.0) & (f < 300.0)
    band = np.fft.irfft(np.where(inside, spectrum, 0.0), u.size)
    frf = lpm(band, y, fs)
    quiet = (frf.f < 99.0) | (frf.f > 301.0)
    assert np.isfinite(frf.H).all()
    assert not np.isnan(frf.var).any()
    assert frf.usable[(frf.f > 101.0) & (frf.f < 299.0)].all()
    assert not frf.usable[quiet].any()
    assert (frf.coherence[quiet] == 0.0).all()
    faint = np.fft.irfft(np.where(inside, spectrum, 1e-5 * spectrum), u.size)
    weak = lpm(faint, y, fs)
    assert (weak.var[quiet] > 1e6 * np.median(weak.var[~quiet])).all()
    silent = lpm(np.zeros(u.size), y, fs)
    assert not silent.usable.any()
    assert (silent.H == 0).all()


def test_lines_with_nothing_between_cannot_be_told_from_a_transient() -> None:
    rng = np.random.default_rng(8)
    period = rng.standard_normal(1000)
    u = np.tile(period, 20)
    frf = lpm(u, u + 1e-3 * rng.standard_normal(u.size), 1000.0)
    assert not frf.usable.any()


def test_refusals(smooth: tuple[np.ndarray, np.ndarray, float]) -> None:
    u, y, fs = smooth
    with pytest.raises(ValueError, match="order 4 over \\+-7 bins leaves 5 degrees of freedom; needed: 7"):
        lpm(u, y, fs, half=7)
    with pytest.raises(ValueError, match="one equal length"):
        lpm(u[:-1], y, fs)
    with pytest.raises(ValueError, match="channel 'y1' holds NaN or inf, first at sample 5"):
        lpm(u, np.where((np.arange(u.size) == 5)[:, None] & (np.arange(2) == 1), np.nan, y), fs)
    with pytest.raises(ValueError, match="no bin"):
        lpm(u, y, fs, f_lo=400.0, f_hi=300.0)
    with pytest.raises(ValueError, match="step 0"):
        lpm(u, y, fs, step=0)


def test_record_channels(smooth: tuple[np.ndarray, np.ndarray, float]) -> None:
    u, y, fs = smooth
    record = Record(np.arange(u.size) / fs, {"Va": u, "de": y[:, 0]}, {"Va": "V", "de": "m"})
    frf = lpm_record(record, "Va", ("de",), 10.0, 20.0)
    assert frf.channels == ("de",)
    assert frf.H[:, 0] == pytest.approx(lpm(u, y[:, 0], fs, f_lo=10.0, f_hi=20.0).H[:, 0])
    with pytest.raises(RecordError, match=r"no channel .*Vs"):
        lpm_record(record, "Va", ("Vs",), 10.0, 20.0)


def test_beginning_and_end_of_a_sweep() -> None:
    """What a sweep does in its first and last seconds looks like a transient to a local fit: its variance says so."""
    mode = Mode(2_000.0)
    t = np.arange(0.0, 40.0, 1 / mode.fs)
    u = signal.chirp(t, 10.0, 40.0, 400.0, "logarithmic")
    y = signal.lfilter(mode.b, mode.a, u)
    y = y + 0.002 * y.std() * np.random.default_rng(1).standard_normal(y.size)
    for f in (14.0, 250.0):
        frf = lpm(u, y, mode.fs, f_lo=f, f_hi=f + 5.0)
        # 200 bins, but few of them independent: the share is looked at roughly.
        assert np.mean(np.abs(frf.H[:, 0] - mode.response(frf.f)) <= frf.radius(0.95)[:, 0]) > 0.75


def test_recorded_unit(recorded_units: RecordedUnits) -> None:
    """A-01 on its bench: the model behind it resonates at 93.9 Hz with 5 kg; a log sweep of 40 s, notched there."""
    path = recorded_units.folder("A-01") / "frf_sweep.mat"
    raw = {k: np.ravel(v).astype(float) for k, v in loadmat(path).items() if not k.startswith("_")}
    frf = lpm(raw["Va"], {k: raw[k] for k in ("de", "da", "Vs")}, 10_000.0, f_lo=85.0, f_hi=105.0)
    peaks = frf.f[np.argmax(np.abs(frf.H), axis=0)]
    assert peaks == pytest.approx(93.9, rel=0.002)
    assert (frf.coherence > 0.99).all()
    windowed = h1(raw["Va"], raw["da"], 10_000.0, 5000).band(85.0, 105.0)
    assert np.abs(windowed.H).max() < 0.5 * np.abs(frf.H[:, 1]).max()


def solved_alone(near: np.ndarray, order: int, half: int) -> tuple[np.ndarray, np.ndarray]:
    """H (C,) and noise (C, C) of one bin by numpy's orthogonal factors of all regressors at once: near (1 + C, 2 half +
    1). Another way than the code: response and transient together, the constant of the response last."""
    powers = np.vander(np.arange(-half, half + 1) / half, order + 1)
    A = np.concatenate([powers, powers * near[0][:, None]], axis=1)
    q, r = np.linalg.qr(A)
    H = (q.conj().T @ near[1:].T)[-1] / r[-1, -1]
    rest = near[1:].T - q @ (q.conj().T @ near[1:].T)
    return H, (rest.T @ rest.conj()) / (len(A) - A.shape[1])


DRIVES = {
    "white": lambda rng, k: rng.standard_normal(k.size) + 1j * rng.standard_normal(k.size),
    "nearly constant": lambda rng, k: np.exp(-2j * np.pi * 0.13 * k) * (1 + 0.01 * rng.standard_normal(k.size)),
    "one line": lambda rng, k: 1e-4 * rng.standard_normal(k.size) + 1j * (k % 40 == 7),
    "gaps": lambda rng, k: (rng.standard_normal(k.size) + 0j) * np.where(k % 40 < 15, 1e-5, 1.0),
}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize(("order", "half", "step"), [(4, 8, 1), (2, 10, 3)])
def test_every_bin_is_the_least_squares_of_its_neighbours(drive: str, order: int, half: int, step: int) -> None:
    """Against one bin at a time, over more than one batch. Both ways are backward stable: H differs by rounding times
    the condition, which is what the noise is multiplied by, too. With noise of 1e-3 of the output that is 1e-12 of the
    stated deviation, and 1e-10 where the drive leaves 1e-4 of itself; squared conditions would lose 1e-6 there."""
    rng = np.random.default_rng(11)
    n = 2 * (BATCH_BINS * step + 400)
    k = np.arange(n // 2 + 1)
    U = DRIVES[drive](rng, k)
    U[[0, -1]] = 0.0
    e = rng.standard_normal((2, k.size)) + 1j * rng.standard_normal((2, k.size))
    Y = np.stack([(1 + 1e-3 * k) * U, np.exp(0.02j * k) * U]) + 1e-3 * np.stack([e[0], e[0] + e[1]])
    Y[:, [0, -1]] = 0.0
    u, *y = np.fft.irfft(np.stack([U, *Y]), n)
    frf = lpm(u, np.stack(y, axis=1), 1.0, step=step, order=order, half=half)
    spectra = np.fft.rfft(np.stack([u, *y]) - np.mean([u, *y], axis=1, keepdims=True))
    assert frf.f.size > BATCH_BINS
    for i in (*range(0, BATCH_BINS - 3, 37), *range(BATCH_BINS - 3, frf.f.size, 5)):
        at = round(frf.f[i] * n)
        near = spectra[:, at - half : at + half + 1]
        H, noise = solved_alone(near, order, half)
        sd = np.sqrt(frf.var[i])
        assert (np.abs(frf.H[i] - H) < 1e-10 * (sd + np.abs(H))).all(), (i, frf.H[i], H)
        shape = frf.cov[i] * noise[0, 0].real / frf.cov[i, 0, 0].real
        assert np.abs(shape - noise).max() < 1e-9 * np.abs(noise).max()
        signal = np.abs(H) ** 2 * np.mean(np.abs(near[0]) ** 2)
        assert frf.coherence[i] == pytest.approx(signal / (signal + noise.diagonal().real), rel=1e-9)


@pytest.mark.parametrize("bins", [1, 7, 16, 389])
def test_a_bin_is_the_same_to_the_last_digit_in_any_band(
    smooth: tuple[np.ndarray, np.ndarray, float], bins: int
) -> None:
    """Vector instructions take the last few of a row in another way: a batch has none."""
    u, y, fs = smooth
    df = fs / u.size
    every = lpm(u, y, fs, f_lo=100.0, f_hi=100.0 + 1000 * df)
    some = lpm(u, y, fs, f_lo=100.0, f_hi=100.0 + (bins - 1) * df)
    assert some.f.size == bins
    np.testing.assert_array_equal(some.H, every.H[:bins])
    np.testing.assert_array_equal(some.cov, every.cov[:bins])


@pytest.mark.parametrize("n", [64, 1001, 4096])
def test_a_transform_is_that_of_numpy_and_kept_with_a_fixed_array(n: int) -> None:
    x = np.random.default_rng(n).standard_normal(n) + 3.0
    once = transform.transform(x)
    np.testing.assert_allclose(once, np.fft.rfft(x - x.mean()), rtol=0, atol=1e-12 * n)  # rounding of n sums
    assert id(x) not in {channel for channel, _ in transform._KEPT}
    x[0] += 1.0
    assert not np.array_equal(transform.transform(x), once)
    x.flags.writeable = False
    kept = transform.transform(x)
    assert transform.transform(x) is kept
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 0.0
    np.testing.assert_array_equal(transform.transform(x, n - 2), transform.transform(x[: n - 2].copy()))
    known = id(x)
    del x
    assert known not in {channel for channel, _ in transform._KEPT}


@pytest.mark.parametrize("drive", ["noise", "sweep", "step"])
def test_the_part_that_the_drive_explains_is_that_of_least_squares(drive: str) -> None:
    n, rng = 2 * BINS * LEAST_BLOCKS + 2, np.random.default_rng(5)
    at = np.arange(n) / n
    u = {"noise": rng.standard_normal(n), "sweep": np.sin(300.0 * at + 900.0 * at**2), "step": 1.0 * (at > 0.5)}[drive]
    part = DrivePart.of(u)
    assert part is not None
    U = blocks(u, part.n)
    X = rng.standard_normal((*U.shape, 2)) @ [1.0, 1j]
    powers = np.vander(np.linspace(-1.0, 1.0, BINS), ORDER + 1)
    for one, block, rest in zip(U, X, part.off(X), strict=True):
        columns = np.concatenate([one[:, None] * powers, powers], axis=1)
        Q, R = np.linalg.qr(columns / np.linalg.norm(columns, axis=0))
        wanted = block - Q @ (Q.conj().T @ block)
        size = np.linalg.norm(block)
        assert np.abs(powers.T @ rest).max() < 1e-13 * BINS * size  # rounding of a sum
        assert np.linalg.norm(rest) <= size
        # Rounding turns the columns' span by its size times their condition.
        np.testing.assert_allclose(rest, wanted, rtol=0, atol=min(1e-14 * np.linalg.cond(R), 1.0) * size)
