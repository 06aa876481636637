"""What a bench adds to every record: hum of the mains, and the error of an encoder's interpolation.

Neither is a matter of the strut, and neither is in the model; but whoever reads that a response is noisier than it
should be wants to know where to look. Hum is a line that the drive does not explain; the error of an interpolation
repeats with the signal period of the scale, so it is found over position and not over time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.slow.cycles import last_cycles
from checks.signals.spectral.segments import hann

MAINS_HZ = (50.0, 60.0)
LEAST_LINES = 20  # of a band: with fewer a line is not told from its neighbours
BESIDE_HZ = 3.0  # half a band in which the response to the drive is a parabola
STANDS_OUT = 8.0  # times the median of what the drive does not explain: chance makes it once in 1e18 lines
# Harmonics of a slow sine below which a loop, and what its steps make ring, hide everything; both are tried, for the
# long periods of a scale lie low and the short ones high.
OWN = (40, 100)
PERIODS_UM = (0.3, 6.0)  # of scales
FINE = 0.2  # of the resolution over 1 / period
ABOVE = 4.0  # times the median of the spectrum over position, in each of two amplitudes: what rings moves with them


@dataclass(frozen=True)
class Hum:
    """Frequency of a line [Hz], and its amplitude in the channel's unit."""

    f_Hz: float
    amplitude: float


@dataclass(frozen=True)
class InterpolationError:
    """An encoder's error that repeats with its signal period: period and amplitude [m]."""

    period_m: float
    amplitude_m: float


def hum(record: Record, channels: Sequence[str]) -> dict[str, Hum]:
    """Channel -> the strongest line about the frequencies of the mains that the drive Va does not explain; without the
    channels in which none stands out."""
    window = hann(record.t.size)
    f: Array = np.fft.rfftfreq(record.t.size, 1.0 / record.fs).astype(float)
    near = (f >= MAINS_HZ[0] - BESIDE_HZ) & (f <= MAINS_HZ[1] + BESIDE_HZ)
    U = _lines(record["Va"], window)[near]
    found = {c: _strongest(f[near], U, _lines(record[c], window)[near]) for c in channels if c in record.channels}
    return {c: Hum(f_Hz, 2.0 * size / float(window.sum())) for c, (f_Hz, size) in found.items() if size > 0.0}


def _lines(x: Array, window: Array) -> Complex:
    return np.asarray(np.fft.rfft(window * (x - x.mean())))


def _strongest(f: Array, U: Complex, Y: Complex) -> tuple[float, float]:
    """Frequency and size of the line in Y at f (F,) that U does not explain; size 0 where none stands out."""
    best = (0.0, 0.0)
    for centre in MAINS_HZ:
        band = np.flatnonzero(np.abs(f - centre) <= BESIDE_HZ)
        if band.size < LEAST_LINES:
            return 0.0, 0.0
        left = np.abs(_unexplained(f[band] - centre, U[band], Y[band]))
        k = int(np.argmax(left))
        if left[k] > max(STANDS_OUT * float(np.median(left)), best[1]):
            best = float(f[band[k]] + _between(left, k) * (f[1] - f[0])), float(left[k])
    return best


def _between(left: Array, k: int) -> float:
    """How far a sine lies from the largest bin k of a spectrum with Hann's window, in bins ([GRANDKE83])."""
    if not 0 < k < left.size - 1:
        return 0.0
    side = 1 if left[k + 1] > left[k - 1] else -1
    r = float(left[k + side] / left[k])
    return side * float(np.clip((2.0 * r - 1.0) / (r + 1.0), 0.0, 0.5))


def _unexplained(x: Array, U: Complex, Y: Complex) -> Complex:
    """(B,) Y less the best parabola of U over x (B,), found without the lines that stand out of it."""
    base = U[:, None] * np.column_stack([np.ones_like(x), x, x * x])
    use = np.ones(x.size, dtype=bool)
    for _ in range(3):
        H, *_ = np.linalg.lstsq(base[use], Y[use], rcond=None)
        left = Y - base @ H
        use = np.abs(left) < 4.0 * np.median(np.abs(left))
    return np.asarray(left)


def interpolation_error(record: Record, channel: str = "de") -> InterpolationError | None:
    """What repeats over position, from slow sines of two amplitudes or more. None where nothing stands out."""
    largest: dict[float, Array] = {}
    for cycle in last_cycles(record["Va"]):
        largest[round(cycle.amplitude, 3)] = record[channel][cycle.samples]
    two = [largest[a] for a in sorted(largest)[-2:]]
    if len(two) < 2 or min(map(np.ptp, two)) == 0.0:
        return None
    k = np.arange(1e6 / PERIODS_UM[1], 1e6 / PERIODS_UM[0], FINE / np.ptp(two[1]))
    best, stands = None, ABOVE
    for own in OWN:
        spectra = [_over_position(x, k, own) for x in two]
        ratio = np.min([s / np.median(s) for s in spectra], axis=0)
        at = int(np.argmax(ratio))
        if ratio[at] > stands:
            stands = float(ratio[at])
            near = range(max(at - 1, 0), min(at + 2, k.size))
            peak = max(near, key=lambda i: spectra[1][i])  # of the larger amplitude, whose lines are narrower
            best = InterpolationError(1.0 / float(k[peak]), float(spectra[1][peak]))
    return best


def _over_position(x: Array, k: Array, own: int) -> Array:
    """(K,) amplitude over position at k (K,) [1/m] of one cycle x (n,) [m], without its first harmonics."""
    X = np.fft.rfft(x - x.mean())
    X[: own + 1] = 0.0
    left = np.fft.irfft(X, x.size)
    return np.asarray(np.abs(np.exp(-2j * np.pi * np.outer(k, x)) @ left) * 2.0 / x.size)
