"""Hum of the mains in the records: a line that the drive does not explain.

It does not belong to the strut or the model, but it explains a response that is noisier than it should be."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.spectral.segments import hann

MAINS_HZ = (50.0, 60.0)
LEAST_LINES = 20  # of a band: with fewer a line does not stand out of its neighbours
BESIDE_HZ = 3.0  # half a band in which the response to the drive is a parabola
STANDS_OUT = 8.0  # times the median of what the drive does not explain: chance makes it once in 1e18 lines


@dataclass(frozen=True)
class Hum:
    """Line of the mains: frequency [Hz], and amplitude in the channel's unit."""

    f_Hz: float
    amplitude: float


def hum(record: Record, channels: Sequence[str]) -> dict[str, Hum]:
    """Return, by channel, the strongest line about the frequencies of the mains that the drive Va does not explain;
    channels in which no line stands out are left out."""
    window = hann(record.t.size)
    f: Array = np.fft.rfftfreq(record.t.size, 1.0 / record.fs).astype(float)
    near = (f >= MAINS_HZ[0] - BESIDE_HZ) & (f <= MAINS_HZ[1] + BESIDE_HZ)
    U = _lines(record["Va"], window)[near]
    found = {c: _strongest(f[near], U, _lines(record[c], window)[near]) for c in channels if c in record.channels}
    return {c: Hum(f_Hz, 2.0 * size / float(window.sum())) for c, (f_Hz, size) in found.items() if size > 0.0}


def _lines(x: Array, window: Array) -> Complex:
    return np.asarray(np.fft.rfft(window * (x - x.mean())))


def _strongest(f: Array, U: Complex, Y: Complex) -> tuple[float, float]:
    """Return the frequency and size of the line in Y at f (F,) that U does not explain; size 0 if no line stands
    out."""
    best = (0.0, 0.0)
    for centre in MAINS_HZ:
        band = np.flatnonzero(np.abs(f - centre) <= BESIDE_HZ)
        if band.size < LEAST_LINES:
            return 0.0, 0.0
        left = np.abs(_remainder(f[band] - centre, U[band], Y[band]))
        k = int(np.argmax(left))
        if left[k] > max(STANDS_OUT * float(np.median(left)), best[1]):
            best = float(f[band[k]] + _between(left, k) * (f[1] - f[0])), float(left[k])
    return best


def _between(left: Array, k: int) -> float:
    """Return the distance of a sine from the largest bin k of a spectrum with a Hann window, in bins ([GRANDKE83])."""
    if not 0 < k < left.size - 1:
        return 0.0
    side = 1 if left[k + 1] > left[k - 1] else -1
    r = float(left[k + side] / left[k])
    return side * float(np.clip((2.0 * r - 1.0) / (r + 1.0), 0.0, 0.5))


def _remainder(x: Array, U: Complex, Y: Complex) -> Complex:
    """Return Y (B,) minus the best parabola of U over x (B,), fitted without the lines that stand out."""
    base = U[:, None] * np.column_stack([np.ones_like(x), x, x * x])
    use = np.ones(x.size, dtype=bool)
    for _ in range(3):
        H, *_ = np.linalg.lstsq(base[use], Y[use], rcond=None)
        left = Y - base @ H
        use = np.abs(left) < 4.0 * np.median(np.abs(left))
    return np.asarray(left)
