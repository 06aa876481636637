"""Integration of a vibration over time: from acceleration to velocity and displacement."""

import numpy as np

from checks.arrays import Array
from checks.signals.spectral.recursion import recursion, second_order

# Of the high-pass: far below a part's modes, and high enough that a sensor's slow noise does not hide its rest.
CORNER_Hz, DAMPING = 30.0, 0.7


def integrated(x: Array, fs: float, times: int) -> Array:
    """Return x (N,) at fs [Hz], integrated once or twice above 30 Hz: s^(2 - times) / (s^2 + 1.4 w0 s + w0^2).

    It is causal, so nothing rings before a hit, and adds one pole pair at 30 Hz; above 60 Hz its magnitude is that of
    an integration within 3 %, and a mode's frequency and damping stay as they are. Raises ValueError."""
    if times not in (1, 2):
        raise ValueError(f"integrated {times} times: expected 1 or 2")
    w, s = 2.0 * np.pi * CORNER_Hz, 2.0 * fs
    scale, a = second_order(w, 2.0 * DAMPING * w * s, s)
    b = [scale, 2.0 * scale, scale] if times == 2 else [s * scale, 0.0, -s * scale]
    return recursion(b, a, x - np.median(x))  # the offset of a sensor would begin as a step
