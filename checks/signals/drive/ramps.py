"""Smooth ways to the mean voltage and back."""

import numpy as np

from checks.arrays import Array

_FAST, _SLOW, _REST = 0.2, 0.7, 0.9  # velocity is up at, falls from, and is zero again at these shares of the ramp
_AREA = 0.7  # under a trapezoid of height one


def trapezoid(s: Array) -> Array:
    """Return the share 0..1 of the way at the share s (N,) of the time: the integral of a trapezoid of velocity, which
    rises until 0.2, is constant until 0.7, falls until 0.9 and rests ([STB] 7.4). Value and velocity are continuous."""
    s = np.clip(s, 0.0, 1.0)
    rising = np.minimum(s, _FAST) ** 2 / (2 * _FAST)
    steady = np.clip(s - _FAST, 0.0, _SLOW - _FAST)
    left = np.clip(_REST - s, 0.0, _REST - _SLOW)
    falling = ((_REST - _SLOW) ** 2 - left**2) / (2 * (_REST - _SLOW))
    return np.asarray((rising + steady + falling) / _AREA)


def ramp(start: float, end: float, duration_s: float, fs: float) -> Array:
    """Return a ramp (N,) from start to end in duration_s [s] at fs [Hz]; the last sample is exactly the end."""
    n = round(duration_s * fs)
    if n < 2:
        return np.empty(0)
    share = trapezoid(np.arange(n) / (n - 1))
    return np.asarray(np.where(share >= 1.0, end, start + (end - start) * share))


def fade(n: int, samples: int) -> Array:
    """Return a window (n,): ones, with a half cosine from 0 over the first samples and back to 0 over the last."""
    if samples < 1:
        return np.ones(n)
    k = np.arange(n)
    edge = np.minimum(np.minimum(k, n - 1 - k) / samples, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * edge))
