"""Errors of interpolation: made by an encoder that reads a place of which everything is known, found and taken out."""

import numpy as np
import pytest
from scipy import signal

from checks.fitting import Dataset
from checks.record import Record
from checks.signals.interpolation import error_notes, errors_of_other_record, interpolation_errors, remove_errors
from tests.soak import SOAK

FS, SECONDS = 10_000.0, 12.0
SEEDS = range(10 if SOAK else 3)
NOISE_M = 5e-9


def moved(seed: int, size_V: float = 1.0, band: tuple[float, float] = (0.1, 350.0)) -> tuple[np.ndarray, np.ndarray]:
    """A drive, and the place of what answers it: a resonance at 90 Hz of 2 um/V, one at 600 Hz."""
    rng = np.random.default_rng(seed)
    shape = signal.butter(4, band, "bandpass", fs=FS, output="sos")
    drive = size_V * signal.sosfilt(shape, rng.standard_normal(int(FS * SECONDS)))
    place = np.zeros_like(drive)
    for f_Hz, gain in ((90.0, 2e-6), (600.0, 0.5e-6)):
        w = 2 * np.pi * f_Hz
        b, a = signal.bilinear([gain * w**2], [1.0, 2 * 0.01 * w, w**2], FS)
        place += signal.lfilter(b, a, drive)
    return drive, place


def read(place: np.ndarray, errors: dict[float, tuple[float, float]], seed: int) -> np.ndarray:
    """What the encoder says: period -> (cosine, sine) of its errors [m], noise on top."""
    off = sum(c * np.cos(2 * np.pi * place / p) + s * np.sin(2 * np.pi * place / p) for p, (c, s) in errors.items())
    return place + off + NOISE_M * np.random.default_rng([seed, 1]).standard_normal(place.size)


def record(drive: np.ndarray, reading: np.ndarray, name: str = "low") -> Record:
    t = np.arange(reading.size) / FS
    return Record(t, {"Va": drive, "de": reading}, {"Va": "V", "de": "m"}, name)


@pytest.mark.parametrize(
    ("period_m", "error"), [(0.6e-6, (3e-9, -5e-9)), (2.0e-6, (0.0, 8e-9)), (3.5e-6, (-4e-9, 1e-9))]
)
def test_period_and_size(period_m: float, error: tuple[float, float]) -> None:
    for seed in SEEDS:
        drive, place = moved(seed)
        (found,) = interpolation_errors(record(drive, read(place, {period_m: error}, seed)))
        # the residual is of the record's length, and so is what it tells: sd of a size is noise * sqrt(2 / samples),
        # 0.02 nm, and as much again for the places where the spectrum is not white
        assert found.period_m == pytest.approx(period_m, rel=2e-3)
        assert (found.cosine_m, found.sine_m) == pytest.approx(error, abs=0.03 * np.hypot(*error) + 0.1e-9)


def test_an_error_and_its_harmonic() -> None:
    drive, place = moved(1)
    found = interpolation_errors(record(drive, read(place, {2.0e-6: (0.0, 8e-9), 1.0e-6: (3e-9, 0.0)}, 1)))
    assert [e.period_m for e in found] == pytest.approx([2.0e-6, 1.0e-6], rel=2e-3)
    assert [e.amplitude_m for e in found] == pytest.approx([8e-9, 3e-9], rel=0.05)  # noise, and each bends the other
    (words,) = error_notes(found)
    assert "8 nm that repeats every 2 um and 3 nm that repeats every 1 um" in words


def test_none_where_there_is_none() -> None:
    """Nor where the strut itself is not linear: what bends over the whole motion has no period within it."""
    for seed in SEEDS:
        drive, place = moved(seed)
        assert interpolation_errors(record(drive, read(place, {}, seed))) == ()
        bent = place + 0.05 * place * np.tanh(place / np.std(place)) + 0.02 * np.abs(place)
        assert interpolation_errors(record(drive, read(bent, {}, seed))) == ()
        clipped = np.clip(place, *np.quantile(place, (0.02, 0.98)))
        assert interpolation_errors(record(drive, read(clipped, {}, seed))) == ()
    drive, place = moved(0)
    assert interpolation_errors(record(drive[:500], place[:500])) == ()  # too short to say anything
    assert interpolation_errors(record(drive, 1e6 * place)) == ()  # micrometres taken for metres: memory has an end
    assert interpolation_errors(record(drive, np.zeros_like(place))) == ()
    assert interpolation_errors(Record(np.arange(9) / FS, {"Va": np.zeros(9)}, {"Va": "V"})) == ()


def test_the_responses_are_those_of_the_place() -> None:
    """A motion of a tenth of the period sees the error as a gain of 1 + 2 pi s / p, here 1.05, which the records of
    large motion tell."""
    drive, place = moved(2)
    fast, small = moved(3, 0.1, (350.0, 1500.0))
    error = {1.0e-6: (0.0, 8e-9)}
    low, high = record(drive, read(place, error, 2)), record(fast, read(small, error, 3), "high")
    found = Dataset.from_records(low, high, 350.0, channels=("de",), f_hi=700.0)
    true = Dataset.from_records(
        record(drive, read(place, {}, 2)), record(fast, read(small, {}, 3), "high"), 350.0, channels=("de",), f_hi=700.0
    )
    near = (found.f > 590) & (found.f < 610)
    ratio = np.abs(np.vdot(true.H[near], found.H[near]) / np.vdot(true.H[near], true.H[near]))
    assert ratio == pytest.approx(1.0, abs=3e-3)  # of 0.05 that it would be without
    assert [e.period_m for e in found.taken_out] == pytest.approx([1.0e-6], rel=2e-3)
    assert true.taken_out == ()
    errors = interpolation_errors(low)
    assert errors_of_other_record(errors, high) is errors
    assert remove_errors(high, ()) is high


def test_a_counter_that_was_set_to_zero_in_between() -> None:
    drive, place = moved(4)
    again, elsewhere = moved(5)
    error = {1.0e-6: (0.0, 8e-9)}
    errors = interpolation_errors(record(drive, read(place, error, 4)))
    zeroed = record(again, read(elsewhere + 0.25e-6, error, 5) - 0.25e-6, "high")
    (own,) = errors_of_other_record(errors, zeroed)
    assert (own.cosine_m, own.sine_m) == pytest.approx((8e-9, 0.0), abs=0.5e-9)  # a quarter of the period on
