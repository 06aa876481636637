"""A hammer test simulated apart from the program: modes driven by half-sine pulses, 8 times oversampled, then filtered
and thinned like an analyser does."""

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import firwin, lfilter, upfirdn

FS = 5120.0
OVER = 8


@dataclass(frozen=True)
class Struck:
    """modes: (f Hz, damping ratio, static gain rad/N); hits: (time s, force N) of every pulse."""

    modes: tuple = ((280.0, 0.008, 1e-6), (840.0, 0.008, 1.2e-7), (1400.0, 0.008, 5e-8))
    hits: tuple = tuple((0.5 + 1.5 * k, 60.0 + 11.0 * (k % 4)) for k in range(5))
    duration: float = 8.0
    width: float = 0.9e-3
    fs: float = FS
    extra: dict = field(default_factory=dict)


def clean(s: Struck, filtered: bool = True):
    """Force [N] and rotation [rad], both (N,), without noise."""
    fine = s.fs * OVER
    n = round(s.duration * fine)
    t = np.arange(n) / fine
    force = np.zeros(n)
    for at, peak in s.hits:
        inside = (t >= at) & (t < at + s.width)
        force[inside] += peak * np.sin(np.pi * (t[inside] - at) / s.width)
    rotation = sum(modal(force, f, zeta, gain, fine) for f, zeta, gain in s.modes)
    if not filtered:
        return force[::OVER], rotation[::OVER]
    taps = firwin(40 * OVER + 1, 0.9 / OVER)
    delay = 20 * OVER
    thin = [upfirdn(taps, np.append(x, np.zeros(delay)), 1, OVER)[20 : 20 + n // OVER] for x in (force, rotation)]
    return thin[0], thin[1]


def modal(force, f, zeta, gain, fs):
    """Rotation of one mode, impulse-invariant: h(t) = gain w0^2/wd exp(-zeta w0 t) sin(wd t)."""
    w0 = 2 * np.pi * f
    wd = w0 * np.sqrt(1 - zeta**2)
    p = np.exp((-zeta * w0 + 1j * wd) / fs)
    b = [0.0, gain * w0**2 / wd / fs * p.imag]
    return lfilter(b, [1.0, -2 * p.real, abs(p) ** 2], force)


def noisy(tracks, rng, force_N=0.02, rotation=2e-8, hum=0.0, fs=FS):
    """The tracks with noise, and a hum of 50 Hz and its odd harmonics at a phase of its own."""
    force, y = tracks
    t = np.arange(force.size) / fs
    hums = sum(hum / k * np.sin(2 * np.pi * 50 * k * t + rng.uniform(0, 6.28)) for k in (1, 3, 5)) if hum else 0.0
    return force + force_N * rng.standard_normal(t.size), y + hums + rotation * rng.standard_normal(t.size)
