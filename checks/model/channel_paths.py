"""The path of each channel to its converter: a low-pass against aliasing, and a latency."""

from collections.abc import Mapping

import numpy as np

from checks.arrays import Array, Complex
from specs.models.parameters import CHANNELS as CHANNELS

LATENCIES = {c: f"bench.latency_{c}_us" for c in CHANNELS}


def channel_path(f: Array, values: Mapping[str, float], channel: str) -> Complex | float:
    """Return the factor (F,) of a channel's path at f (F,) [Hz]; 1 if the path is empty."""
    tau_us, corner_Hz = values[LATENCIES[channel]], values[f"bench.lowpass_{channel}_Hz"]
    factor: Complex | float = 1.0
    if tau_us != 0.0:
        factor = np.exp(-2e-6j * np.pi * f * tau_us)
    if np.isfinite(corner_Hz):
        factor = factor * lowpass(f, corner_Hz, values[f"bench.lowpass_{channel}_order"])
    return factor


def lowpass(f: Array, corner_Hz: float, order: float) -> Complex:
    """Return the response (F,) of a Butterworth low-pass ([OPPENHEIM10] 7.2).

    The magnitude is defined for any order; the phase lies between those of whole ones, so that a fit can move."""
    whole = int(np.floor(order))
    share = order - whole
    phase = _phase(f / corner_Hz, whole)
    if share > 0.0:
        phase = (1.0 - share) * phase + share * _phase(f / corner_Hz, whole + 1)
    return np.asarray(np.exp(1j * phase) / np.sqrt(1.0 + (f / corner_Hz) ** (2.0 * order)))


def _phase(x: Array, order: int) -> Array:
    """Return the phase (F,) [rad] at x (F,), frequency over corner, without jumps: the sum over the poles."""
    poles = lowpass_poles(order)[:, None]
    return np.asarray(np.sum(np.angle(-poles) - np.angle(1j * x - poles), axis=0))


def lowpass_poles(order: int) -> Complex:
    """Return the poles (order,) of a Butterworth low-pass in units of its corner's angular frequency."""
    return np.asarray(np.exp(1j * np.pi * (2 * np.arange(order) + order + 1) / (2 * order)))
