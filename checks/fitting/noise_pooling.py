"""Noise that neighbouring windows share: an estimate of few degrees of freedom made one of many."""

import numpy as np
from numpy.typing import NDArray

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.signals.spectral.frf import Frf

NEIGHBOURS = 2  # windows on either side that share one estimate
ALONE = 1e-4  # chance that a window's noise exceeds that about it so much, if it is the same noise


def pool_noise(frf: Frf, input_power: Array) -> tuple[Complex, Array]:
    """Return the covariance cov (U, C, C) and the degrees of freedom nu (U,) of the usable bins of a local fit,
    averaged over neighbours.

    frf: independent bins; input_power (F,): of the input about each bin, in any unit. The noise on the outputs is
    averaged, because it is smooth; cov is that noise over the input power that determines H. A window with far more
    noise than its neighbours (a line of the mains, a resonance too sharp for its polynomial) keeps its own, which is
    not used for them."""
    good = frf.usable
    own, power = frf.nu[good], (_power(frf) * input_power)[good]
    noise: Complex = frf.cov[good] * power[:, None, None]
    alone = _is_outlier(np.einsum("fcc->fc", noise).real, own)
    lend = np.where(alone, 0.0, own)
    lent: Complex = noise * lend[:, None, None]
    total, nu = _moving(lent), _moving(lend.astype(np.complex128)).real
    keep = alone | (nu <= own)
    mean: Complex = total / np.where(nu > 0.0, nu, 1.0)[:, None, None]
    cov = np.asarray(np.where(keep[:, None, None], noise, mean) / power[:, None, None], dtype=np.complex128)
    return cov, np.where(keep, own, nu)


def _power(frf: Frf) -> Array:
    """Return the input power (F,) that determines H: var is noise / power, coherence gives noise / input power."""
    c = np.argmin(np.abs(frf.coherence - 0.5), axis=1)  # there neither 1 - coherence nor coherence is round-off
    at = np.arange(frf.f.size)
    coherence, var = frf.coherence[at, c], frf.var[at, c]
    ratio = np.abs(frf.H[at, c]) ** 2 * (1.0 - coherence) / np.maximum(coherence, 1e-300)
    valid = (ratio > 0.0) & (var > 0.0) & np.isfinite(var)
    return np.where(valid, ratio / np.where(valid, var, 1.0), 1.0)


def _is_outlier(noise: Array, nu: Array) -> NDArray[np.bool_]:
    """Return whether the noise (F, C) of each window (F,) exceeds the local median in a channel by more than chance
    allows."""
    wide = 2 * NEIGHBOURS + 1
    padded = np.pad(noise, ((wide, wide), (0, 0)), mode="reflect" if len(noise) > wide else "edge")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * wide + 1, axis=0), axis=-1)
    limit = stats.chi2.isf(ALONE, 2.0 * nu) / stats.chi2.median(2.0 * nu)
    return np.asarray((noise > limit[:, None] * median).any(axis=1))


def _moving(x: Complex) -> Complex:
    """Return the sums over the neighbours on both sides along the first axis; fewer at the ends."""
    padded = np.pad(x, ((NEIGHBOURS, NEIGHBOURS), *((0, 0),) * (x.ndim - 1)))
    sums: Complex = np.sum([padded[k : k + len(x)] for k in range(2 * NEIGHBOURS + 1)], axis=0)
    return sums
