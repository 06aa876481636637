"""Offsets, signs, dead and exchanged channels: known ones put in, and recorded units."""

from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from scipy.io import loadmat

from checks.cause import Cause
from checks.signals.record_checks import ExpectedSignal, dead, delay, finest_step, mismatches
from checks.signals.spectral.frf import Frf, h1
from tests.shared.recorded_units import RecordedUnits

FS = 10_000.0
LOOKS = {
    "Va": ExpectedSignal(1e-2, 10.0, 20 / 2**16),
    "Vs": ExpectedSignal(1e-2, 10.0, 20 / 2**16),
    "de": ExpectedSignal(1e-8, 1e-3, 2.5e-9),
    "da": ExpectedSignal(1e-8, 1e-3, 1e-10),
}


def late(x: np.ndarray, samples: float) -> np.ndarray:
    """x later by any number of samples, exactly, as if it were periodic."""
    k = np.arange(x.size // 2 + 1)
    return np.fft.irfft(np.fft.rfft(x) * np.exp(-2j * np.pi * k * samples / x.size), x.size)


def mode(u: np.ndarray, f: float, damping: float, sign: float = 1.0) -> np.ndarray:
    """Response of a mode to u, with the phase of the continuous mode (of the spectrum, as if u were periodic)."""
    w = 2 * np.pi * np.fft.rfftfreq(u.size, 1 / FS)
    w0 = 2 * np.pi * f
    return np.fft.irfft(sign * np.fft.rfft(u) * w0**2 / (w0**2 - w**2 + 2j * damping * w * w0), u.size)


@pytest.fixture(scope="module")
def drive() -> np.ndarray:
    return signal.lfilter(*signal.butter(2, 1500.0, fs=FS), np.random.default_rng(1).standard_normal(200_000))


@pytest.mark.parametrize("samples", [0.0, 1.0, -2.0, 0.37, 12.4])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_delay_through_a_resonance(drive: np.ndarray, samples: float, sign: float) -> None:
    noise = np.random.default_rng(2).standard_normal(drive.size)
    y = late(mode(drive, 95.0, 0.01, sign), samples)
    found = delay(h1(drive, y + 0.003 * y.std() * noise, FS, 5000, input="Va"), "y0", FS, 200.0, 1000.0)
    assert found.seen
    assert found.samples == pytest.approx(samples, abs=0.03)  # 1 % damping turns the phase by 0.3 degrees at 200 Hz
    assert found.sd < 0.02
    assert found.polarity == -sign  # above its resonance a mass moves against the force
    assert ("before its cause" in found.words) == (samples < -1)


def test_sign_changes_in_the_band_and_delay_is_still_seen(drive: np.ndarray) -> None:
    y = late(mode(drive, 95.0, 0.01), 3.0)
    found = delay(h1(drive, y, FS, 5000), "y0", FS, 20.0, 400.0)
    assert found.samples == pytest.approx(3.0, abs=0.15)
    assert found.polarity == 0
    below = delay(h1(drive, y, FS, 5000), "y0", FS, 10.0, 60.0)
    assert below.polarity == 1


def test_delay_between_two_outputs(drive: np.ndarray) -> None:
    columns = {"da": mode(drive, 95.0, 0.01), "de": late(mode(drive, 95.0, 0.01, -1.0), 2.0)}
    found = delay(h1(columns["da"], {"de": columns["de"]}, FS, 4096, input="da"), "de", FS, 20.0, 600.0)
    assert found.samples == pytest.approx(2.0, abs=0.02)
    assert found.polarity == -1
    assert found.reference == "da"


def test_stated_spread_of_the_delay() -> None:
    """A pure delay in noise: 100 repeats lie within two stated standard deviations nearly always. The floor on the
    phase of a structure makes them wide, never narrow."""
    late_by = []
    for seed in range(100):
        u, e = np.random.default_rng(seed).standard_normal((2, 20_000))
        found = delay(h1(u, late(u, 1.3) + 0.5 * e, FS, 1000), "y0", FS, 100.0, 2000.0)
        late_by.append(abs(found.samples - 1.3) / found.sd)
    assert np.mean(np.array(late_by) < 2.0) > 0.9
    assert np.median(late_by) > 0.2


def test_unrelated_channels_show_no_delay(drive: np.ndarray) -> None:
    noise = np.random.default_rng(3).standard_normal(drive.size)
    found = delay(h1(drive, noise, FS, 5000), "y0", FS, 100.0, 1000.0)
    assert not found.seen
    assert np.isnan(found.samples)
    assert found.polarity == 0


def test_dead_channels(drive: np.ndarray) -> None:
    rng = np.random.default_rng(4)
    columns = {
        "works": 0.1 * drive + rng.standard_normal(drive.size),
        "constant": np.full(drive.size, 0.25),
        "flickers": np.round(rng.standard_normal(drive.size) * 0.2),
        "noise": rng.standard_normal(drive.size),
    }
    frf = h1(drive, columns, FS, 5000, input="Va")
    found = {name: [r.cause for r in dead(name, x, frf)] for name, x in columns.items()}
    assert found == {
        "works": [],
        "constant": [Cause.CHANNEL_CONSTANT],
        "flickers": [Cause.CHANNEL_DEAD],
        "noise": [Cause.CHANNEL_NOT_DRIVEN],
    }
    assert not dead("noise", columns["noise"])
    assert dead("x", np.array([]))
    assert dead("x", np.array([1.0, np.nan, 2.0, 3.0, 4.0]))


def test_chance_does_not_make_a_channel_alive() -> None:
    """200 unrelated records: none with 1e-3 each is what 4 of 5 such sets show; more than two would be wrong."""
    called = 0
    for seed in range(200):
        u, y = np.random.default_rng(seed).standard_normal((2, 10_000))
        called += not dead("y0", y, h1(u, y, FS, 500))
    assert called <= 2


@pytest.mark.parametrize("step", [2.5e-9, 20 / 2**16, 1e-10, 3.0])
def test_finest_step(step: float) -> None:
    x = np.random.default_rng(5).standard_normal(20_000) * 70 * step
    assert finest_step(np.round(x / step) * step) == pytest.approx(step, rel=1e-6)
    assert finest_step(x) is None
    assert finest_step(np.full(100, step)) is None


def test_exchanged_channels_are_told_by_size_and_step(drive: np.ndarray) -> None:
    x = drive / np.abs(drive).max()
    volt = 20 / 2**16
    true = {
        "Va": np.round(x / volt) * volt,
        "Vs": np.round(3 * x / volt) * volt,
        "de": np.round(5e-6 * x / 2.5e-9) * 2.5e-9,
        "da": np.round(5e-6 * x / 1e-10) * 1e-10,
    }
    assert mismatches(true, LOOKS) == ()
    for a, b in (("Vs", "de"), ("de", "da"), ("Va", "da")):
        (found,) = mismatches({**true, a: true[b], b: true[a]}, LOOKS)
        assert found.cause is Cause.CHANNELS_EXCHANGED
        assert {found.parameters["channel"], found.parameters["other"]} == {a, b}
    (found,) = mismatches({**true, "de": 1e6 * true["de"]}, LOOKS)
    assert (found.cause, found.parameters["channel"]) == (Cause.CHANNEL_SIZE, "de")
    # Same size, same step: honest silence.
    assert mismatches({**true, "Va": true["Vs"], "Vs": true["Va"]}, LOOKS) == ()


def recorded(path: Path) -> dict[str, np.ndarray]:
    raw = loadmat(path)
    return {k: np.ravel(raw[k]).astype(float) for k in ("Va", "Vs", "de", "da")}


def response(columns: dict[str, np.ndarray]) -> Frf:
    return h1(columns["Va"], {k: columns[k] for k in ("Vs", "de", "da")}, FS, 5000, input="Va")


@pytest.mark.parametrize(("unit", "samples"), [pytest.param("A-01", 1.0, marks=pytest.mark.needs_data), ("S-01", 0.0)])
def test_recorded_units(unit: str, samples: float, recorded_units: RecordedUnits) -> None:
    """The bench of the APAs stores one sample late (the phase falls by 36 degrees at 1 kHz), that of S-01 does not."""
    columns = recorded(recorded_units.folder(unit) / "frf_noise_hf.mat")
    frf = response(columns)
    for channel in ("Vs", "da"):
        found = delay(frf, channel, FS, 300.0, 2000.0)
        assert found.samples == pytest.approx(samples, abs=0.05)
        assert found.polarity == -1
        assert not dead(channel, columns[channel], frf)
    assert mismatches(columns, LOOKS) == ()
    pair = h1(columns["da"], {"Vs": columns["Vs"]}, FS, 4096, input="da")
    assert delay(pair, "Vs", FS, 300.0, 2000.0).samples == pytest.approx(0.0, abs=0.05)
