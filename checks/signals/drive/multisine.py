"""Random-phase multisine: one period, its lines, and a phase iteration that lowers its crest factor."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy import fft

from checks.arrays import Array, Complex
from checks.signals.drive.shapes import AmplitudeShape

LINES = ("all", "odd")


@dataclass(frozen=True, eq=False)
class MultisinePeriod:
    """Period of a multisine. x (N,) one period, of rms one; lines (L,) its harmonics of 1/N."""

    x: Array
    lines: NDArray[np.intp]

    @property
    def crest(self) -> float:
        """Return the crest factor: peak over rms."""
        return float(np.max(np.abs(self.x)) / np.sqrt(np.mean(self.x**2)))


def harmonics(n: int, fs: float, band_Hz: tuple[float, float], lines: str) -> NDArray[np.intp]:
    """Return the lines of a period of n samples inside the band; "odd" leaves the even ones free to show even
    distortion ([PS12] 4.3). Raises ValueError if no line is left."""
    if lines not in LINES:
        raise ValueError(f"lines '{lines}' are not known (known: {', '.join(LINES)})")
    first, last = int(np.ceil(band_Hz[0] * n / fs - 1e-9)), int(np.floor(band_Hz[1] * n / fs + 1e-9))
    found = np.arange(max(first, 1), min(last, (n - 1) // 2) + 1)
    found = found[found % 2 == 1] if lines == "odd" else found
    if found.size == 0:
        raise ValueError(f"no {lines} line of {fs / n:.4g} Hz lies between {band_Hz[0]:g} and {band_Hz[1]:g} Hz")
    return found


def random_phase(n: int, fs: float, lines: NDArray[np.intp], shape: AmplitudeShape, rng: Generator) -> MultisinePeriod:
    """Return one period of n samples: amplitudes by the shape, phases uniform and independent, rms one."""
    amplitude = shape.gain(lines * fs / n)
    return _period(n, lines, amplitude * np.exp(2j * np.pi * rng.random(lines.size)))


def compress_crest(period: MultisinePeriod, iterations: int) -> MultisinePeriod:
    """Return the same amplitudes with phases of a lower crest factor, by clipping and taking back the amplitudes
    ([OSR88]). The best of all iterations; never worse than the start."""
    n, lines = period.x.size, period.lines
    amplitude = np.abs(fft.rfft(period.x)[lines])
    best = current = period
    for k in range(iterations):
        peak = np.max(np.abs(current.x))
        clipped = np.clip(current.x, *(np.array([-1, 1]) * peak * (0.75 + 0.2 * k / max(iterations - 1, 1))))
        phase = np.angle(fft.rfft(clipped)[lines])
        current = _period(n, lines, amplitude * np.exp(1j * phase))
        best = min(best, current, key=lambda p: p.crest)
    return best


def from_zero(period: MultisinePeriod) -> MultisinePeriod:
    """Return the same period from its gentlest rise through zero, so that it follows a constant without a step."""
    x, following = period.x, np.roll(period.x, -1)
    rising = np.flatnonzero((x <= 0) & (following > 0))
    cost = np.abs(x[rising]) + np.abs(following[rising] - x[rising])
    start = int(rising[np.argmin(cost)]) if rising.size else 0
    return MultisinePeriod(np.roll(x, -start), period.lines)


def _period(n: int, lines: NDArray[np.intp], amplitude: Complex) -> MultisinePeriod:
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[lines] = amplitude
    x = fft.irfft(spectrum, n)
    return MultisinePeriod(x / np.sqrt(np.mean(x**2)), lines)
