"""A hammer test as an analyser stores it: impacts of a hammer and the rotation that a vibrometer sees ([STB] 2.4)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from checks.arrays import Array

FS = 5120.0
DURATION_S, EVERY_S, FIRST_S = 24.0, 2.0, 1.0  # of a record; between two hits; until the first
WIDTH_S = 6e-4  # of the half sine of a hit
FORCE_N = (75.0, 130.0)  # peak of a hit, drawn between
FORCE_NOISE_N, FORCE_STEP_N = 0.03, 0.001  # rms noise and last digit of the force
LSB_OF_RANGE, NOISE_OF_RANGE = 2.0**-15, 4e-4
FINE = 16  # the force is drawn this much finer: a hit falls between samples


@dataclass(frozen=True)
class ShellMode:
    """One mode as the vibrometer sees it under one place of impact: gain [rad/N] at rest."""

    f_Hz: float
    damping_ratio: float
    gain: float


@dataclass(frozen=True)
class DoubleHits:
    """Hits that bounce: height of the second peak as a share of the first, and its delay [s]. hits: which, counted from
    0; None: all but the middle one."""

    share: float = 0.45
    late_s: float = 0.012
    hits: tuple[int, ...] | None = None

    def bounces(self, k: int, count: int) -> bool:
        return k != count // 2 if self.hits is None else k in self.hits


def hammer_record(
    modes: Sequence[ShellMode],
    rng: np.random.Generator,
    double: DoubleHits | None = None,
    duration_s: float = DURATION_S,
    fs: float = FS,
) -> tuple[Array, Array]:
    """Return force (N,) [N] and rotation (N,) [rad] at fs [Hz], a hit every 2 s; double: which bounce."""
    force = _hits(rng, double, duration_s, fs)
    size = fft.next_fast_len(force.size + round(4 * fs), real=True)
    f = fft.rfftfreq(size, 1.0 / fs)
    H = np.zeros(f.size, dtype=complex)
    for m in modes:
        x = 1j * f / m.f_Hz
        H += m.gain / (x * x + 2.0 * m.damping_ratio * x + 1.0)
    angle = fft.irfft(H * fft.rfft(force, size), size)[: force.size]
    span = float(np.abs(angle).max())
    angle = angle + NOISE_OF_RANGE * span * rng.standard_normal(force.size)
    force = force + FORCE_NOISE_N * rng.standard_normal(force.size)
    return np.round(force / FORCE_STEP_N) * FORCE_STEP_N, np.round(angle / (span * LSB_OF_RANGE)) * span * LSB_OF_RANGE


def _hits(rng: np.random.Generator, double: DoubleHits | None, duration_s: float, fs: float) -> Array:
    """Return (N,) half sines, seen through the analyser's filter: band-limited."""
    n = round(duration_s * fs)
    fine = np.zeros(n * FINE)
    count = int((duration_s - FIRST_S) / EVERY_S)
    forces, jitter = rng.uniform(*FORCE_N, count), rng.uniform(0.0, 5e-3, count)
    for k in range(count):
        at = FIRST_S + k * EVERY_S + jitter[k]
        _add_hit(fine, at, forces[k], fs)
        if double is not None and double.bounces(k, count):
            _add_hit(fine, at + double.late_s, double.share * forces[k], fs)
    spectrum = fft.rfft(fine)[: n // 2 + 1] / FINE
    spectrum *= 1.0 / np.sqrt(1.0 + (fft.rfftfreq(n, 1.0 / fs) / (0.4 * fs)) ** 16)
    return np.asarray(fft.irfft(spectrum, n))


def _add_hit(fine: Array, at: float, force_N: float, fs: float) -> None:
    width = round(WIDTH_S * fs * FINE)
    start = round(at * fs * FINE)
    fine[start : start + width] += force_N * np.sin(np.pi * (np.arange(width) + 0.5) / width)
