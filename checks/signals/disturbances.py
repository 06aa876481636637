"""What a bench adds to every record: hum of the mains, and the error of an encoder's interpolation.

Neither is a matter of the strut, and neither is in the model; but whoever reads that a response is noisier than it
should be wants to know where to look. Hum is a line that the drive does not explain; the error of an interpolation
repeats with the signal period of the scale, so it is found over position and not over time.
"""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.record import Record
from checks.signals.slow.cycles import last_cycles

MAINS_HZ = (48.0, 62.0)
BESIDE_HZ = 3.0  # half a band in which the response to the drive is a parabola
STANDS_OUT = 8.0  # times the median of what the drive does not explain: chance makes it once in 1e18 lines
SAME_HZ = 0.2
# Harmonics of a slow sine below which a loop, and what its steps make ring, hide everything; both are tried, for the
# long periods of a scale lie low and the short ones high.
OWN = (40, 100)
PERIODS_UM = (0.3, 6.0)  # of scales
FINE = 0.2  # of the resolution over 1 / period
ABOVE = 4.0  # times the median of the spectrum over position, in each of two amplitudes: what rings moves with them


@dataclass(frozen=True)
class Disturbance:
    """Frequency [Hz] and amplitude, in the channel's unit."""

    f_Hz: float
    amplitude: float


def hum(drive: Array, response: Array, fs: float) -> Disturbance | None:
    """The strongest line about the frequencies of the mains in a response (N,) that its drive (N,) does not explain;
    None where none stands out."""
    n = drive.size
    window = np.hanning(n)
    f = np.fft.rfftfreq(n, 1.0 / fs)
    U, Y = (np.fft.rfft(window * (x - x.mean())) for x in (drive, response))
    best: Disturbance | None = None
    for centre in np.arange(MAINS_HZ[0] + BESIDE_HZ, MAINS_HZ[1], 2.0 * BESIDE_HZ):
        band = np.flatnonzero(np.abs(f - centre) <= BESIDE_HZ)
        if band.size < 20:
            return None  # too short a record to tell a line from its neighbours
        left = np.abs(_unexplained(f[band] - centre, U[band], Y[band]))
        k = int(np.argmax(left))
        amplitude = 2.0 * float(left[k]) / float(window.sum())
        if left[k] > STANDS_OUT * np.median(left) and (best is None or amplitude > best.amplitude):
            best = Disturbance(float(f[band[k]] + _between(left, k) * (f[1] - f[0])), amplitude)
    return best


def _between(left: Array, k: int) -> float:
    """How far a sine lies from the largest bin k of a spectrum with Hann's window, in bins ([GRANDKE83])."""
    if not 0 < k < left.size - 1:
        return 0.0
    side = 1 if left[k + 1] > left[k - 1] else -1
    r = float(left[k + side] / left[k])
    return side * float(np.clip((2.0 * r - 1.0) / (r + 1.0), 0.0, 0.5))


def _about(k: int, size: int) -> slice:
    """A peak and its two neighbours."""
    return slice(max(k - 1, 0), min(k + 2, size))


def _unexplained(x: Array, U: Complex, Y: Complex) -> Complex:
    """(B,) Y less the best parabola of U over x (B,), found without the lines that stand out of it."""
    base = U[:, None] * np.column_stack([np.ones_like(x), x, x * x])
    use = np.ones(x.size, dtype=bool)
    for _ in range(3):
        H, *_ = np.linalg.lstsq(base[use], Y[use], rcond=None)
        left = Y - base @ H
        use = np.abs(left) < 4.0 * np.median(np.abs(left))
    return np.asarray(left)


def interpolation_error(record: Record, channel: str = "de") -> Disturbance | None:
    """The error of an encoder that repeats with its signal period, from slow sines of two amplitudes or more: f_Hz is
    1 / period [1/m] here. None where nothing over position stands out."""
    largest: dict[float, Array] = {}
    for cycle in last_cycles(record["Va"]):
        largest[round(cycle.amplitude, 3)] = record[channel][cycle.samples]
    two = [largest[a] for a in sorted(largest)[-2:]]
    if len(two) < 2 or min(map(np.ptp, two)) == 0.0:
        return None
    lo, hi = 1e6 / PERIODS_UM[1], 1e6 / PERIODS_UM[0]
    k = np.arange(lo, hi, FINE / np.ptp(two[1]))
    best, stands = None, ABOVE
    for own in OWN:
        spectra = [_over_position(x, k, own) for x in two]
        ratio = np.min([s / np.median(s) for s in spectra], axis=0)
        at = int(np.argmax(ratio))
        if ratio[at] > stands:
            stands = float(ratio[at])
            near = _about(at, k.size)
            at = near.start + int(np.argmax(spectra[1][near]))
            best = Disturbance(float(k[at]), float(spectra[1][at]))
    return best


def _over_position(x: Array, k: Array, own: int) -> Array:
    """(K,) amplitude over position at k (K,) [1/m] of one cycle x (n,) [m], without its first harmonics."""
    X = np.fft.rfft(x - x.mean())
    X[: own + 1] = 0.0
    left = np.fft.irfft(X, x.size)
    return np.asarray(np.abs(np.exp(-2j * np.pi * np.outer(k, x)) @ left) * 2.0 / x.size)
