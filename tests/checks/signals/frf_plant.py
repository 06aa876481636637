"""A closed-form bench for frequency response tests: modes and a zero whose roots are known exactly.

Sampled by the bilinear rule; the poles and zeros of the sampled system are read from its own polynomials, so they are
what a transform of its records obeys exactly: s = fs log(z).
"""

from dataclasses import dataclass, field

import numpy as np
from scipy import signal

from checks.record import Record

UNITS = {"Va": "V", "Vs": "V", "de": "m", "da": "m"}
NOISE = {
    "Vs": 2e-3,
    "de": 2e-9,
    "da": 1e-9,
}  # rms: some steps of a 16-bit converter, of an encoder, of an interferometer


def mode(f_Hz, damping, gain=1.0):
    """Numerator and denominator of gain w^2/(s^2 + 2 z w s + w^2)."""
    w = 2 * np.pi * f_Hz
    return np.array([gain * w * w]), np.array([1.0, 2 * damping * w, w * w])


def added(*parts):
    """Sum of transfer functions."""
    num, den = parts[0]
    for n, d in parts[1:]:
        num, den = np.polyadd(np.polymul(num, d), np.polymul(n, den)), np.polymul(den, d)
    return num, den


@dataclass(frozen=True)
class Plant:
    """f_Hz, damping: of the axial mode; others: further modes (f, damping, gain on de over the static gain 2.6e-5)."""

    f_Hz: float = 93.9
    damping: float = 0.004
    others: tuple = ()
    zero_Hz: float = 39.0
    zero_damping: float = 0.01
    static: float = 2.6e-5
    noise: dict = field(default_factory=lambda: dict(NOISE))
    seen_by_da: bool = True

    def systems(self):
        first = mode(self.f_Hz, self.damping, self.static)
        rest = [mode(f, d, g * self.static) for f, d, g in self.others]
        moves = added(first, *rest)
        wz, (_, den) = 2 * np.pi * self.zero_Hz, mode(self.f_Hz, self.damping)
        sensed = (-5.0 * np.array([1.0, 2 * self.zero_damping * wz, wz * wz]), den)
        return {"Vs": sensed, "de": moves, "da": moves if self.seen_by_da else first}

    def discrete(self, fs):
        return {c: signal.bilinear(*s, fs) for c, s in self.systems().items()}

    def pole(self, fs, near_Hz=None):
        """Complex frequency [Hz] of the pole of de next to near_Hz: s = 2 pi j f."""
        return _nearest(self.discrete(fs)["de"][1], fs, near_Hz or self.f_Hz)

    def zero(self, fs):
        """Complex frequency [Hz] of the zero of Vs."""
        return _nearest(self.discrete(fs)["Vs"][0], fs, self.zero_Hz)


def _nearest(polynomial, fs, near_Hz):
    roots = np.log(np.roots(polynomial)) * fs / (2j * np.pi)
    return roots[np.argmin(np.abs(roots - near_Hz))]


def noise_drive(rng, n, fs, f_lo, f_hi, rms):
    """Gaussian noise between two frequencies."""
    sos = signal.butter(4, [f_lo, f_hi], "bandpass", fs=fs, output="sos")
    u = signal.sosfilt(sos, rng.standard_normal(n + n // 10))[n // 10 :]
    return rms * u / u.std()


def record(plant, u, fs, rng, name="low.mat", channels=("Vs", "de", "da")):
    """Record of a drive u (N,) with the plant's noise on every output; one sample of delay, as the bench has."""
    columns = {"Va": u}
    for c, (num, den) in plant.discrete(fs).items():
        if c in channels:
            columns[c] = signal.lfilter(num, den, u) + plant.noise[c] * rng.standard_normal(u.size)
    return Record(np.arange(u.size) / fs, columns, UNITS, name)


def unit(plant, seed, fs=5000.0, seconds=12.0, **more):
    """The two records of a unit, ready for the check."""
    rng = np.random.default_rng(seed)
    n = round(seconds * fs)
    low = record(plant, noise_drive(rng, n, fs, 4.0, 450.0, 0.04), fs, rng, "low.mat")
    high = record(plant, noise_drive(rng, n, fs, 250.0, 2100.0, 0.3), fs, rng, "high.mat")
    return {"low": low, "high": high, **more}
