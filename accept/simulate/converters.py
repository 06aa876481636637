"""The bench's converters and sensors: their steps, ranges and noise."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from checks.arrays import Array

RANGE_V = 10.0  # of the rig's converters, to either side
LSB_V = 2.0 * RANGE_V / 2**16  # 16 bit
STEPS = {"de": 2.5e-9, "da": 1e-10}  # encoder (2.5 nm), interferometer [m]
NOISE = {"Vs": 1e-3, "de": 2e-9, "da": 2e-9}  # white, rms per sample at 10 kHz: as the recorded units show [V, m, m]


@dataclass(frozen=True)
class Converters:
    """Simulate converters and sensors. noise: rms of a sample by channel [V or m]; ideal: no steps, no ranges."""

    noise: Mapping[str, float] = field(default_factory=lambda: dict(NOISE))
    ideal: bool = False

    def noisier(self, factor: float) -> "Converters":
        return replace(self, noise={c: factor * rms for c, rms in self.noise.items()})

    def dac(self, V: Array) -> Array:
        """Return the output (N,) of the converter [V]."""
        return V if self.ideal else in_volts(V)

    def read(self, channel: str, y: Array, rng: np.random.Generator) -> Array:
        """Return a channel (N,) as stored: an encoder counts from zero, a voltage ends at the range."""
        noisy = y + self.noise.get(channel, 0.0) * rng.standard_normal(y.size)
        if self.ideal:
            return noisy
        return in_steps(noisy, STEPS[channel]) if channel in STEPS else in_volts(noisy)


def in_volts(V: Array) -> Array:
    """Round to 16 bit over +-10 V and clip at the ends."""
    return np.clip(in_steps(V, LSB_V), -RANGE_V, RANGE_V - LSB_V)


def in_steps(x: Array, step: float) -> Array:
    """Round to the nearest whole number of steps; zero is never negative."""
    return np.asarray(np.round(x / step) * step + 0.0)
