"""Hum: added to records of which everything is known, at the size of rough benches."""

import numpy as np
import pytest
from scipy import signal

from checks.record import Record
from checks.signals.disturbances import hum
from tests.soak import SOAK

FS, SECONDS = 10_000.0, 12.0
SEEDS = range(10 if SOAK else 4)


def driven(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A drive, and a resonance at 90 Hz that answers it with 2 um/V and noise of 5 nm."""
    rng = np.random.default_rng(seed)
    drive = signal.sosfilt(signal.butter(4, 350.0, fs=FS, output="sos"), rng.standard_normal(int(FS * SECONDS)))
    w = 2 * np.pi * 90.0
    b, a = signal.bilinear([2e-6 * w**2], [1.0, 2 * 0.01 * w, w**2], FS)
    return drive, signal.lfilter(b, a, drive) + 5e-9 * rng.standard_normal(drive.size)


def record(drive: np.ndarray, y: np.ndarray) -> Record:
    return Record(np.arange(y.size) / FS, {"Va": drive, "de": y}, {"Va": "V", "de": "m"}, "low")


@pytest.mark.parametrize(("f_Hz", "amplitude"), [(49.96, 3e-9), (60.03, 8e-9), (60.3, 8e-9)])
def test_a_line_that_the_drive_does_not_explain(f_Hz: float, amplitude: float) -> None:
    for seed in range(4):
        drive, y = driven(seed)
        t = np.arange(y.size) / FS
        found = hum(record(drive, y + amplitude * np.sin(2 * np.pi * f_Hz * t + seed)), ["de"]).get("de")
        assert found is not None
        assert found.f_Hz == pytest.approx(f_Hz, abs=0.5 / SECONDS)  # half a line of the spectrum
        assert found.amplitude == pytest.approx(amplitude, rel=0.3)  # a line between two bins loses up to 15 %


def test_no_hum_where_there_is_none() -> None:
    assert [hum(record(*driven(seed)), ["de"]) for seed in SEEDS] == [{} for _ in SEEDS]
    drive, y = driven(0)
    assert hum(record(drive[:3000], y[:3000]), ["de"]) == {}  # 0.3 s: no line is told from its neighbours
