"""Excitation signals against closed forms; limits refused; what the command writes reads back."""

from functools import partial

import numpy as np
import pytest
from scipy import fft
from scipy.io import loadmat
from scipy.signal import lfilter, welch

from accept.base.exit_codes import Exit
from accept.commands.physics import excite
from accept.commands.physics.excite import Playing, Shaping, SweepOptions
from checks.declare import Series
from checks.signals.drive import excitation as ms
from checks.signals.drive.excitation import ExcitationError, Rig, fade, ramp, trapezoid
from checks.signals.drive.excitation_panels import excitation_panels
from checks.signals.drive.shapes import Flat, LowPass, Notch, ShapeProduct, notch_at_resonance
from checks.signals.spectral.frf import h1
from hw.records import read
from tests.shared.record_files import write_mat

BENCH = Rig()
QUICK = Rig(ramp_s=0.5)
KINDS = {
    "log": lambda rig: rig.sweep(10.0, 400.0, 5.0, 1.0),
    "lin": lambda rig: rig.sweep(10.0, 400.0, 5.0, 1.0, "lin"),
    "noise": lambda rig: rig.noise(300.0, 2000.0, 5.0, 0.3, seed=3),
    "sines": lambda rig: rig.sines(1.0, [0.1, 0.4, 1.6]),
    "multisine": lambda rig: rig.multisine(10.0, 2000.0, 1.0, 0.3, periods=3, seed=3),
}


def test_the_spectrum_of_a_slow_sine_shows_its_line():
    """0.1 Hz lies below the lowest frequency of segments of a second."""
    (line,) = excitation_panels(Rig(fs=1000.0).sines(0.1, (1.0, 2.0), cycles=3))["spectrum"].items
    assert line.x[np.nanargmax(line.y)] == pytest.approx(0.1, abs=0.02)  # a bin of 60 s is 0.017 Hz


@pytest.mark.parametrize("kind", KINDS)
def test_starts_and_ends_at_zero_and_runs_about_the_mean(kind):
    e = KINDS[kind](BENCH)
    assert e.Va[0] == 0.0
    assert e.Va[-1] == 0.0
    assert e.Va[e.start - 1] == pytest.approx(3.25, abs=1e-3 if kind != "multisine" else 1.0)
    np.testing.assert_allclose(np.diff(e.t), 1e-4, rtol=1e-6)
    assert e.t[0] == 0.0
    # A log sweep spends its time at low frequency; what is left of its mean is a part of one period.
    assert abs(np.mean(e.proper)) < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_no_step_where_the_parts_meet(kind):
    """At the seams the signal moves no faster than it does elsewhere: no step excites what the band spares."""
    e = KINDS[kind](BENCH)
    steps = np.abs(np.diff(e.Va))
    inside = np.max(np.abs(np.diff(e.proper)))
    first, last = round(BENCH.ramp_s * BENCH.fs), e.stop
    for seam in (first, last):
        assert steps[seam - 3 : seam + 2].max() <= inside * 1.001
    assert steps[: first - 2].max() < 3.25 / (0.7 * 5.0 * 1e4) * 1.001


@pytest.mark.parametrize("kind", ["noise", "multisine"])
def test_same_seed_same_samples(kind):
    assert np.array_equal(KINDS[kind](QUICK).Va, KINDS[kind](QUICK).Va)
    other = {"noise": QUICK.noise(300.0, 2000.0, 5.0, 0.3, seed=4)}.get(
        kind, QUICK.multisine(10.0, 2000.0, 1.0, 0.3, periods=3, seed=4)
    )
    assert not np.allclose(other.proper, KINDS[kind](QUICK).proper)


def test_trapezoid_is_the_seeds():
    """Closed form against the cumulative trapezoids of [STB] 7.4, which err by the step: 1/n."""
    n = 20_000
    s = np.arange(1, n + 1) / n
    v = np.where(s < 0.2, s / 0.2, 1.0)
    v = np.where(s > 0.7, 1.0 - (s - 0.7) / 0.2, v)
    v = np.where(s > 0.9, 0.0, v) / 0.7
    seed = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2)]) / n
    np.testing.assert_allclose(trapezoid(s), seed, atol=1e-4)
    assert trapezoid(np.array([0.0, 0.2, 0.7, 0.9, 1.0])) == pytest.approx([0, 0.1 / 0.7, 0.6 / 0.7, 1, 1], abs=1e-15)


def test_ramp_has_continuous_velocity():
    """The largest change of velocity per sample is the trapezoid's slope: V/(0.7 T 0.2 T fs^2)."""
    V, T, fs = 3.25, 2.0, 1000.0
    x = ramp(0.0, V, T, fs)
    n = round(T * fs)
    assert (x[0], x[-1], x.size) == (0.0, V, n)
    assert np.abs(np.diff(x, 2)).max() <= V / (0.7 * 0.2 * (n - 1) ** 2) * (1 + 1e-9)
    assert np.all(np.diff(x) >= 0)
    assert np.array_equal(ramp(V, 0.0, T, fs)[[0, -1]], [V, 0.0])
    assert ramp(0.0, V, 0.0, fs).size == 0


def test_fade_ends():
    window = fade(1001, 100)
    assert window[0] == window[-1] == 0.0
    assert window[500] == 1.0
    assert window[50] == pytest.approx(0.5)
    assert np.array_equal(fade(10, 0), np.ones(10))


@pytest.mark.parametrize("law", ["log", "lin"])
def test_momentary_frequency_of_a_sweep(law):
    """From the phase of the signal itself: zero crossings, and the closed form of their times."""
    f0, f1, T = 10.0, 400.0, 10.0
    e = Rig(ramp_s=0.0, fs=50_000.0).sweep(f0, f1, T, 1.0, law, fade_s=0.0)
    t = np.arange(e.proper.size) / e.fs
    x = e.proper
    k = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    crossing = t[k] - x[k] / (x[k + 1] - x[k]) / e.fs
    turns = np.arange(1, crossing.size + 1)
    if law == "log":
        expected = T / np.log(f1 / f0) * np.log1p(turns * np.log(f1 / f0) / (f0 * T))
    else:
        rate = (f1 - f0) / T
        expected = (np.sqrt(f0**2 + 2 * rate * turns) - f0) / rate
    # A straight line through a sine between two samples errs by less than 1 % of a sample.
    assert np.abs(crossing - expected).max() < 0.02 / e.fs
    whole = f0 * T / np.log(f1 / f0) * (f1 / f0 - 1) if law == "log" else (f0 + f1) / 2 * T
    assert whole - 1 <= turns[-1] <= whole


def test_sweep_of_one_frequency_is_a_sine():
    e = QUICK.sweep(50.0, 50.0, 1.0, 0.5, fade_s=0.0)
    np.testing.assert_allclose(e.proper, 0.5 * np.sin(2 * np.pi * 50 * np.arange(10_001) / 1e4), atol=1e-10)


def test_sweep_amplitude_follows_the_shape():
    notch = Notch(95.0, 20.0, 0.2)
    e = QUICK.sweep(10.0, 400.0, 60.0, 1.5, "lin", notch)
    t = np.arange(e.proper.size) / e.fs
    f = 10.0 + 390.0 * t / 60.0
    for centre in (20.0, 85.0, 95.0, 105.0, 300.0):
        near = np.abs(f - centre) < 0.3
        expected = 1.5 * notch.gain(np.array([centre]))[0]
        # Within 0.3 Hz the notch's flank, of 20 Hz, changes by less than 2 %.
        assert np.abs(e.proper[near]).max() == pytest.approx(expected, rel=0.03)


def test_notch_closed_form():
    notch = Notch(95.0, 10.0, 0.1)
    assert notch.gain(np.array([95.0]))[0] == pytest.approx(0.1, rel=1e-12)
    assert notch.gain(np.array([1.0, 1e5])) == pytest.approx([1.0, 1.0], abs=1e-4)
    # |f0^2 - f^2| = width f where numerator and denominator differ by the depth alone.
    f = 5.0 + np.sqrt(25.0 + 95.0**2)
    assert notch.gain(np.array([f]))[0] == pytest.approx(np.sqrt((1 + 0.01) / 2), rel=1e-12)
    assert ShapeProduct(notch, LowPass(95.0)).gain(np.array([95.0]))[0] == pytest.approx(0.1 / np.sqrt(2))


def test_notch_found_in_a_first_record_flattens_the_response():
    """A mode of 2 % damping: behind the notch the response stays within a factor two of its static value."""
    fs, f0, zeta = 10_000.0, 95.0, 0.02
    p = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * 2 * np.pi * f0 / fs)
    a = [1.0, -2 * p.real, abs(p) ** 2]
    u = QUICK.noise(1.0, 2000.0, 60.0, 0.1).proper
    y = lfilter([sum(a)], a, u)
    f, found = None, notch_at_resonance(h1(u, {"de": y}, fs, round(2 * fs)), "de")
    f = np.linspace(20.0, 150.0, 400)
    mode = 1.0 / np.abs(1 - (f / f0) ** 2 + 2j * zeta * f / f0)
    assert found.f0_Hz == pytest.approx(f0, abs=0.5)
    assert (mode * found.gain(f)).max() < 2.0
    assert mode.max() > 20.0


def test_no_resonance_is_said():
    u = np.random.default_rng(0).standard_normal(100_000)
    with pytest.raises(ValueError, match="no resonance stands out"):
        notch_at_resonance(h1(u, {"de": 2.0 * u}, 1e4, 2000), "de")


def test_noise_band_and_rms():
    e = QUICK.noise(300.0, 2000.0, 40.0, 0.3, seed=5, fade_s=0.0)
    assert np.sqrt(np.mean(e.proper**2)) == pytest.approx(0.3, rel=1e-9)
    power = np.abs(fft.rfft(e.proper)) ** 2
    f = fft.rfftfreq(e.proper.size, 1 / e.fs)
    outside = (f < 299.99) | (f > 2000.01)
    assert power[outside].max() < 1e-20 * power.max()
    band, density = welch(e.proper, e.fs, nperseg=1000)
    flat = density[(band > 330) & (band < 1970)]
    # 79 averages: 11 % per bin, 160 bins: within 4.5 of them.
    assert np.abs(flat / (0.3**2 / 1700.0) - 1).max() < 0.5
    assert np.mean(flat) == pytest.approx(0.3**2 / 1700.0, rel=0.02)


def test_shaped_and_low_passed_noise():
    shape = LowPass(100.0, 2)
    e = QUICK.noise(0.0, 1000.0, 200.0, 0.1, seed=6, shape=shape, fade_s=0.0)
    assert abs(np.mean(e.proper)) < 1e-12
    band, density = welch(e.proper, e.fs, nperseg=5000)
    at = {f: density[np.argmin(np.abs(band - f))] for f in (20, 100, 200)}
    # 800 averages: 3.5 % each.
    assert at[100] / at[20] == pytest.approx(shape.gain(np.array([100.0]))[0] ** 2, rel=0.2)
    assert at[200] / at[20] == pytest.approx(shape.gain(np.array([200.0]))[0] ** 2, rel=0.2)


def test_noise_is_normal():
    x = QUICK.noise(10.0, 4000.0, 20.0, 0.5, fade_s=0.0, seed=8).proper / 0.5
    # Kurtosis of 200,000 nearly independent values: 3 within 5 of sqrt(24/n).
    assert np.mean(x**4) == pytest.approx(3.0, abs=5 * np.sqrt(24 / 160_000))


def test_sines_grow():
    e = QUICK.sines(2.0, [0.1, 0.3, 1.0], cycles=3)
    turns = np.arange(e.proper.size) * 2.0 / e.fs
    assert e.proper.size == 45_001
    for k, a in enumerate((0.1, 0.3, 1.0)):
        block = (turns > 3 * k) & (turns < 3 * (k + 1))
        np.testing.assert_allclose(e.proper[block], a * np.sin(2 * np.pi * turns[block]), atol=1e-10)


@pytest.mark.parametrize("lines", ["all", "odd"])
def test_multisine_lines_and_periodicity(lines):
    e = QUICK.multisine(10.0, 400.0, 0.5, 0.2, periods=4, seed=2, lines=lines)
    n = e.period
    assert (n, e.stop - e.start) == (20_000, 80_000)
    periods = e.Va[e.start - n : e.stop].reshape(5, n)  # the lead-in too
    assert all(np.array_equal(periods[0], p) for p in periods)
    amplitude = np.abs(fft.rfft(e.proper[:n])) * 2 / n
    driven = np.zeros(amplitude.size, dtype=bool)
    driven[np.arange(20, 801)] = True
    if lines == "odd":
        driven[::2] = False
    assert amplitude[~driven].max() < 1e-12
    np.testing.assert_allclose(amplitude[driven], 0.2 * np.sqrt(2 / driven.sum()), rtol=1e-9)
    assert np.sqrt(np.mean(e.proper**2)) == pytest.approx(0.2, rel=1e-9)


def test_multisine_shape_and_phases():
    shape = Notch(95.0, 20.0, 0.1)
    n, fs = 20_000, 1e4
    lines = ms.harmonics(n, fs, (10.0, 400.0), "all")
    period = ms.random_phase(n, fs, lines, shape, np.random.default_rng(1))
    spectrum = fft.rfft(period.x)[lines]
    ratio = np.abs(spectrum) / shape.gain(lines * fs / n)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    # Mean direction of 781 uniform phases: below 3 / sqrt(781).
    assert abs(np.mean(np.exp(1j * np.angle(spectrum)))) < 3 / np.sqrt(lines.size)


def test_crest_factor_is_lowered_and_the_amplitudes_stay():
    n, fs = 10_000, 1e4
    lines = ms.harmonics(n, fs, (10.0, 400.0), "all")
    plain = ms.random_phase(n, fs, lines, Flat(), np.random.default_rng(1))
    lower = ms.compress_crest(plain, 100)
    assert lower.crest < 2.0 < 2.8 < plain.crest
    np.testing.assert_allclose(np.abs(fft.rfft(lower.x)), np.abs(fft.rfft(plain.x)), atol=1e-9 * n)
    assert ms.compress_crest(plain, 0) is plain


def test_multisine_response_has_no_leakage():
    """A lightly damped mode in steady state: the ratio of two periods' spectra is its response to 1e-9."""
    fs, f0, zeta = 10_000.0, 95.0, 0.01
    p = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * 2 * np.pi * f0 / fs)
    b, a = [abs(1 - p) ** 2], [1.0, -2 * p.real, abs(p) ** 2]
    e = QUICK.multisine(10.0, 400.0, 0.5, 0.2, periods=2, seed=2)
    y = lfilter(b, a, e.Va)[e.start : e.stop]
    u, last = fft.rfft(e.proper[e.period :]), fft.rfft(y[e.period :])
    k = np.arange(20, 801)
    z = np.exp(2j * np.pi * k / e.period)
    truth = b[0] / (a[0] + a[1] / z + a[2] / z**2)
    # The transient has decayed for two periods of 2 s: exp(-0.01 2 pi 95 4) = 4e-11.
    assert np.abs(last[k] / u[k] / truth - 1).max() < 1e-9


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: BENCH.sweep(10, 400, 5, 4.3), r"at t = 5\.\d+ s the stack would see 15\d.\d+ V, above 150 V"),
        (lambda: Rig(mean_V=0.0).sweep(10, 400, 5, 1.1), r"stack would see -20\.\d+ V, below -20 V"),
        (lambda: Rig(gain=1.0).sweep(10, 400, 5, 7.0), r"the DAC would see 10\.\d+ V, above 10 V"),
        (lambda: BENCH.sines(1.0, [1.0, 5.0]), r"1\d+ of \d+ samples leave -20..150 V, the worst 165.000 V"),
        (lambda: BENCH.noise(300, 2000, 5, 2.0), "leave -20..150 V"),
        (lambda: BENCH.multisine(10, 2000, 1.0, 2.0), "leave -20..150 V"),
        (lambda: Rig(mean_V=8.0).sweep(10, 400, 5, 0.1), r"at t = \d\.\d+ s the stack would see 150.0"),
        (lambda: BENCH.sweep(10, 5000, 5, 1.0), "5000 Hz is not below half the sampling frequency, 5000 Hz"),
        (lambda: BENCH.sweep(0, 400, 5, 1.0), "f_start_Hz is 0"),
        (lambda: BENCH.sweep(10, 400, 5, np.nan), "amplitude_V is nan"),
        (lambda: BENCH.sweep(10, 400, 5, 1.0, "cubic"), "'cubic' is not known"),
        (lambda: BENCH.sweep(10, 400, 1e9, 1.0), "samples, expected 2.."),
        (lambda: Rig(ramp_s=-1.0).sweep(10, 400, 5, 1.0), "no negative ramp"),
        (lambda: Rig(mean_V=np.nan).sweep(10, 400, 5, 1.0), "mean nan V"),
        (lambda: BENCH.noise(300, 200, 5, 0.1), "expected 0 <= start < end"),
        (lambda: BENCH.noise(300.01, 300.02, 1, 0.1), "hold no frequency"),
        (lambda: Rig(ramp_s=1e9).sweep(10, 400, 5, 1.0), "at most 20000000"),
        (lambda: BENCH.noise(300, 2000, 5, 0.1, seed=-1), "seed is -1"),
        (lambda: BENCH.multisine(10, 400, 0.5, 0.1, crest_iterations=-1), "crest_iterations is -1"),
        (lambda: BENCH.multisine(10, 400, 0.5, 0.1, crest_iterations=10**8), "expected 0 to 10000"),
        (lambda: BENCH.sines(1.0, []), "positive values that grow"),
        (lambda: BENCH.sines(1.0, [0.2, 0.1]), "positive values that grow"),
        (lambda: BENCH.multisine(10.1, 10.4, 0.5, 0.1), "no all line of 0.5 Hz"),
        (lambda: BENCH.multisine(10, 400, 0.5, 0.1, lines="even"), "'even' are not known"),
        (lambda: Notch(95.0, 10.0, 0.0), "notch depth 0"),
        (lambda: Notch(-1.0, 10.0), "must be positive"),
        (lambda: LowPass(0.0), "must be positive"),
    ],
)
def test_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_the_limits_themselves_are_allowed():
    """Full range: 3.25 V +- 4.25 V is exactly -20..150 V on the stacks."""
    e = Rig(ramp_s=0.1).sines(1.0, [4.25])
    assert (20 * e.Va.min(), 20 * e.Va.max()) == pytest.approx((-20.0, 150.0))
    with pytest.raises(ExcitationError):
        Rig(ramp_s=0.1).sines(1.0, [4.2501])


@pytest.mark.parametrize("kind", KINDS)
def test_pictures(kind):
    drawn = excitation_panels(KINDS[kind](QUICK))
    assert set(drawn) == {"time", "spectrum"}
    assert KINDS[kind](QUICK).meaning.startswith(drawn["time"].title)


@pytest.mark.parametrize("command", ["sweep", "noise", "sine", "multisine"])
def test_command_writes_what_reads_back(command, tmp_path, capsys):
    short = {"sine": {"f": 5.0}, "multisine": {}}.get(command, {"duration": 2.0})
    options = partial(getattr(excite, f"{command.title()}Options"), **short)
    out, plot = tmp_path / f"{command}.mat", tmp_path / f"{command}.png"
    write = partial(getattr(excite, command), playing=Playing(ramp=0.2, plot=plot))
    assert write(options(out)) == Exit.ACCEPTED
    record = read(out, Series("x", "x", {"t": "s", "Va": "V"}))
    assert record.fs == pytest.approx(1e4)
    assert record["Va"][[0, -1]] == pytest.approx([0, 0])
    stored = loadmat(out, squeeze_me=True)
    assert stored["V_mean"] == 3.25
    assert plot.stat().st_size > 1000
    said = capsys.readouterr()
    assert said.out == ""
    assert "V at the DAC" in said.err
    assert write(options(tmp_path / f"{command}.csv")) == Exit.ACCEPTED
    np.testing.assert_array_equal(
        read(tmp_path / f"{command}.csv", Series("x", "x", {"t": "s", "Va": "V"}))["Va"], record["Va"]
    )


def test_command_refuses_in_words(tmp_path, capsys):
    assert excite.sweep(SweepOptions(tmp_path / "a.mat", amplitude=5.0, duration=5.0)) == Exit.BAD_INPUT
    assert "the stack would see" in capsys.readouterr().err
    assert excite.sweep(SweepOptions(tmp_path / "a.wav", duration=1.0)) == Exit.BAD_INPUT
    assert "as .mat or .csv" in capsys.readouterr().err
    short = SweepOptions(tmp_path / "a.mat", duration=1.0)
    assert excite.sweep(short, Shaping(notch_depth=0.1)) == Exit.BAD_INPUT
    assert "needs its frequency" in capsys.readouterr().err
    missing = Shaping(notch_from=tmp_path / "none.mat")
    assert excite.sweep(short, missing) == Exit.BAD_INPUT
    assert not (tmp_path / "a.mat").exists()


def test_command_notches_a_first_record(tmp_path, capsys):
    fs, f0, zeta = 1e4, 95.0, 0.02
    p = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * 2 * np.pi * f0 / fs)
    u = QUICK.noise(1.0, 2000.0, 20.0, 0.1).proper
    y = lfilter([1e-6], [1.0, -2 * p.real, abs(p) ** 2], u)
    write_mat(tmp_path / "first.mat", {"t": np.arange(u.size) / fs, "Va": u, "de": y})
    shaping = Shaping(notch_from=tmp_path / "first.mat", low_pass=1000.0)
    assert excite.sweep(SweepOptions(tmp_path / "a.mat", duration=2.0), shaping) == Exit.ACCEPTED
    said = capsys.readouterr().err
    assert "notch at 9" in said
    assert "low-pass at 1000 Hz" in said
