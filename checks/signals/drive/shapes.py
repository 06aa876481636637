"""Amplitude over frequency: how strongly an excitation drives each frequency, relative to its nominal amplitude."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from checks.arrays import Array
from checks.record import Record
from checks.signals.spectral.frf import Frf, h1_record

_COHERENCE_MIN = 0.5  # leakage lowers it at the peak of a lightly damped mode, so no more is required
_RESONANCE_FROM_Hz = 20.0  # below is the static response, whose noise has peaks of its own
_DEPTH_MIN = 0.05


class AmplitudeShape(Protocol):
    """Relative amplitude (N,), positive, at frequencies f (N,) [Hz]."""

    def gain(self, f: Array) -> Array: ...


@dataclass(frozen=True)
class Flat:
    """The same amplitude at every frequency."""

    def gain(self, f: Array) -> Array:
        return np.ones_like(f)

    def __str__(self) -> str:
        return "flat"


@dataclass(frozen=True)
class Notch:
    """Amplitude lowered about a resonance: |(s^2 + 2 depth d w0 s + w0^2) / (s^2 + 2 d w0 s + w0^2)|, 2 d f0 = width.

    At f0 it is exactly `depth`; half way down in power about width/2 to either side. Raises ValueError unless f0 and
    the width are positive and the depth is in 0..1, zero excluded."""

    f0_Hz: float
    width_Hz: float
    depth: float = 0.1

    @classmethod
    def of_record(cls, record: Record) -> "Notch":
        """Return a notch for the largest peak of de over Va in a first record. Raises ValueError."""
        return notch_at_resonance(h1_record(record, "Va", ["de"]), "de")

    def __post_init__(self) -> None:
        if not (self.f0_Hz > 0 and self.width_Hz > 0 and np.isfinite([self.f0_Hz, self.width_Hz]).all()):
            raise ValueError(f"notch at {self.f0_Hz:g} Hz, {self.width_Hz:g} Hz wide: both must be positive")
        if not 0.0 < self.depth <= 1.0:
            raise ValueError(f"notch depth {self.depth:g} is outside 0..1 (it is the amplitude left at the notch)")

    def gain(self, f: Array) -> Array:
        real, imaginary = self.f0_Hz**2 - f**2, self.width_Hz * f
        return np.asarray(np.hypot(real, self.depth * imaginary) / np.hypot(real, imaginary))

    def __str__(self) -> str:
        return f"notch at {self.f0_Hz:.4g} Hz, {self.width_Hz:.3g} Hz wide, down to {self.depth:.3g}"


@dataclass(frozen=True)
class LowPass:
    """Amplitude that falls beyond a corner like a Butterworth filter of this order."""

    corner_Hz: float
    order: int = 1

    def __post_init__(self) -> None:
        if not (self.corner_Hz > 0 and np.isfinite(self.corner_Hz) and self.order >= 1):
            raise ValueError(f"low-pass at {self.corner_Hz:g} Hz of order {self.order}: both must be positive")

    def gain(self, f: Array) -> Array:
        return np.asarray(1.0 / np.sqrt(1.0 + (f / self.corner_Hz) ** (2 * self.order)))

    def __str__(self) -> str:
        return f"low-pass at {self.corner_Hz:.4g} Hz of order {self.order}"


@dataclass(frozen=True)
class ShapeProduct:
    """One shape times another."""

    one: AmplitudeShape
    other: AmplitudeShape

    def gain(self, f: Array) -> Array:
        return self.one.gain(f) * self.other.gain(f)

    def __str__(self) -> str:
        return f"{self.one}; {self.other}"


def amplitude_shape(notch: Notch | None = None, low_pass_Hz: float | None = None) -> AmplitudeShape:
    """Return the shape with a notch, a low-pass, both or neither."""
    low_pass = None if low_pass_Hz is None else LowPass(low_pass_Hz)
    if notch is not None and low_pass is not None:
        return ShapeProduct(notch, low_pass)
    return notch or low_pass or Flat()


def notch_at_resonance(frf: Frf, channel: str) -> Notch:
    """Return a notch for the largest peak of a first record's FRF, which keeps the response there about as small as at
    low frequency ([STB] 3.1.1). Raises ValueError if no coherent peak stands out by a factor of two."""
    c = frf.index(channel)
    use = (frf.f >= _RESONANCE_FROM_Hz) & frf.usable & (frf.coherence[:, c] >= _COHERENCE_MIN)
    if np.count_nonzero(use) < 8:
        raise ValueError(f"{channel}: only {np.count_nonzero(use)} bins with coherence above {_COHERENCE_MIN:g}")
    f, magnitude = frf.f[use], np.abs(frf.H[use, c])
    k = int(np.argmax(magnitude))
    below = float(np.median(magnitude[: max(k // 2, 1)]))
    if magnitude[k] < 2.0 * below or k in (0, f.size - 1):
        raise ValueError(f"{channel}: no resonance stands out (largest at {f[k]:.4g} Hz); give the notch by hand")
    wide = np.flatnonzero(magnitude < magnitude[k] / np.sqrt(2.0))
    left, right = wide[wide < k], wide[wide > k]
    half_power = f[right[0] if right.size else -1] - f[left[-1] if left.size else 0]
    depth = float(np.clip(below / magnitude[k], _DEPTH_MIN, 1.0))
    # The notch's own poles are depth times wider than its zeros, so that zeros on the resonance's poles flatten it.
    return Notch(float(f[k]), float(half_power / depth), depth)
