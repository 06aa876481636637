"""Prandtl-Ishlinskii model for tests: a straight line plus plays, whose loops have a closed form.

[BS96] 2.3.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Plays:
    """y = gain u + sum of weights[j] times the play of radius radii[j]; for loops up to the largest radius."""

    gain: float
    radii: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, gain: float, share: float, largest: float, count: int = 40) -> "Plays":
        """`share`: slope of all plays together relative to the line."""
        radii = largest * (np.arange(count) + 0.5) / count
        return cls(gain, radii, np.full(count, gain * share / count))

    def response(self, u: np.ndarray) -> np.ndarray:
        """y over u (N,), the plays centred on the first sample."""
        state = np.full(self.radii.size, u[0])
        y = np.empty(u.size)
        for i, x in enumerate(u):
            state = np.minimum(np.maximum(state, x - self.radii), x + self.radii)
            y[i] = self.gain * x + self.weights @ state
        return y

    def first_rise(self, swing: float) -> float:
        """Rise of y when u goes up by `swing` from the start."""
        return float(self.gain * swing + self.weights @ np.maximum(swing - self.radii, 0))

    def width(self, amplitude: float) -> float:
        """Opening of the settled loop at mid-drive."""
        return float(2 * self.weights @ np.maximum(np.minimum(self.radii, amplitude - self.radii), 0))

    def peak_to_peak(self, amplitude: float) -> float:
        return float(2 * (self.gain * amplitude + self.weights @ np.maximum(amplitude - self.radii, 0)))
