"""Kinds of inputs: hits, which are no lasting drive; and drives of many frequencies at once."""

import numpy as np
import scipy.fft

from checks.arrays import Array

ENERGY = 0.9  # share of the input's energy
CONCENTRATED = 0.03  # of the samples, which hold that share: 0.45 of those of noise, 0.8 of those of a sine or a sweep

BROAD = 0.003  # of the bins of its spectrum; 0.02 and more of noise and sweeps, below 0.001 of steady sines


def concentration(u: Array) -> float:
    """Return the share of the samples (N,) that holds 90 % of the energy of an input, its offset (median) taken off."""
    energy = np.sort((u - np.median(u)) ** 2)[::-1]
    total = float(energy.sum())
    if total == 0.0:
        return 1.0
    return float(np.searchsorted(np.cumsum(energy), ENERGY * total) + 1) / u.size


def is_transient(u: Array) -> bool:
    """Return whether an input (N,) is concentrated in time, as the force of a hammer is."""
    return concentration(u) < CONCENTRATED


def is_broadband(u: Array) -> bool:
    """Return whether an input (N,) drives many frequencies at once, as noise and sweeps do."""
    return concentration(np.abs(scipy.fft.rfft(u - np.mean(u)))) > BROAD
