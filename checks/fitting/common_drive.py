"""A model behind an actuator of unknown gain, delay and slow fall of gain, which cancel in the ratio of two channels.

All outputs share the factor exp(g - q (f / 1 kHz)^2 - 2 pi i f tau). Fitted without priors, the three absorb any
amplifier far above the band, a delay, and the actuator's constant; the ratio of the outputs remains."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.fitting.coordinates import Free
from checks.model.model import Model

Values = Mapping[str, float]

GAIN, FALL, DELAY = "drive.log_gain", "drive.fall_per_kHz2", "drive.delay_us"
SKEW_OF_DE, SKEW_OF_VS, GAIN_OF_DE = "drive.skew_de_us", "drive.skew_Vs_us", "drive.log_gain_de"
OF_ONE_CHANNEL = {SKEW_OF_DE: "de", SKEW_OF_VS: "Vs", GAIN_OF_DE: "de"}
# Beside da: benches sample their channels some microseconds apart, and filters add as many; scales differ by a percent.
# The gain of Vs is free in any case.
BESIDE_DA = (
    *(Free(name, 0.0, 10.0, lo=-100.0, hi=100.0) for name in (SKEW_OF_DE, SKEW_OF_VS)),
    Free(GAIN_OF_DE, 0.0, 0.01, lo=-0.1, hi=0.1),
)
DRIVE = (  # bounds: a tenth to ten times the gain, a drive that lasts to 1 kHz, 5 ms
    Free(GAIN, 0.0, lo=-2.3, hi=2.3, scale=0.1),
    Free(FALL, 0.0, lo=-1.0, hi=1.0, scale=0.02),
    Free(DELAY, 0.0, lo=-5000.0, hi=5000.0, scale=20.0),
)


@dataclass(frozen=True, eq=False)
class DrivenModel:
    """A `Response`: the model's parameters and those of `DRIVE`, by name."""

    model: Model

    def frf(self, f: Array, changes: Values, channels: tuple[str, ...]) -> Complex:
        """Return the response (F, C) at f (F,) [Hz]."""
        own, drive = _split(changes)
        return self.model.frf(f, own, channels) * _factor(f, drive, channels)

    def jacobian(self, f: Array, names: Sequence[str], changes: Values, channels: tuple[str, ...]) -> Complex:
        """Return the derivatives (P, F, C) per unit of each name."""
        own, drive = _split(changes)
        factor = _factor(f, drive, channels)
        moving = [n for n in names if n not in _LOGS]
        D = dict(zip(moving, self.model.jacobian(f, moving, own, channels) * factor, strict=True))
        H = self.model.frf(f, own, channels) * factor
        D |= {n: H * _log(n, f, channels) for n in names if n in _LOGS}
        return np.array([D[n] for n in names])


_LOGS: dict[str, Callable[[Array], NDArray[np.complexfloating]]] = {
    GAIN: lambda f: np.ones(f.shape, dtype=complex),
    FALL: lambda f: -((f / 1e3) ** 2) + 0j,
    DELAY: lambda f: -2e-6j * np.pi * f,
    SKEW_OF_DE: lambda f: -2e-6j * np.pi * f,
    SKEW_OF_VS: lambda f: -2e-6j * np.pi * f,
    GAIN_OF_DE: lambda f: np.ones(f.shape, dtype=complex),
}


def mechanics(changes: Values) -> dict[str, float]:
    """Return those of all values that are the model's own."""
    return {n: v for n, v in changes.items() if n not in _LOGS}


def _split(changes: Values) -> tuple[dict[str, float], dict[str, float]]:
    return mechanics(changes), {n: v for n, v in changes.items() if n in _LOGS}


def _factor(f: Array, drive: Values, channels: tuple[str, ...]) -> Complex:
    log = sum((v * _log(n, f, channels) for n, v in drive.items()), np.zeros((f.size, len(channels)), dtype=complex))
    return np.asarray(np.exp(log))


def _log(name: str, f: Array, channels: tuple[str, ...]) -> Complex:
    """Return the derivative (F, C) of the logarithm of the responses by a parameter."""
    there = np.array([OF_ONE_CHANNEL.get(name, c) == c for c in channels], dtype=float)
    return np.asarray(_LOGS[name](f)[:, None] * there)
