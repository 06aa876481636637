"""Responses of a hammer test as every other estimate gives them, and the modes that they show."""

from collections.abc import Sequence

import numpy as np

from checks.arrays import Array
from checks.signals.impact.hammer import HammerTests, ImpactFrf
from checks.signals.impact.impacts import Impact, tally
from checks.signals.impact.modal_fit import Mode, find_modes
from checks.signals.spectral.frf import Frf

SEPARATION_Hz, SEPARATION_BINS, SEPARATION_SHARE = 8.0, 8.0, 0.01  # of two modes: of these at most the first
BINS_ABOVE_0 = 8.0  # below, a mode has less than a side of bins
LEAST_CORRELATION = 0.05  # of the errors of two bins: below, they count as independent


def impact_frf(found: HammerTests, channels: Sequence[str], input: str, estimator: str = "h1") -> Frf:
    """Return the responses of a hammer test with coherence over the hits and covariance from their scatter.

    estimator: "h1", "h2", "hv". Degrees of freedom are those of the hits, K - 1. The exponential window correlates the
    errors of neighbouring bins: see `correlation`. Raises ValueError if fewer than two impacts are good."""
    if not found.frfs:
        raise ValueError(f"{tally(found.all_impacts)}; two are needed, because U comes from what they differ by")
    first, K = found.frfs[0], found.frfs[0].count
    estimates = [frf.estimate(estimator) for frf in found.frfs]
    errors = np.stack([e for _, e in estimates])  # (C, K, M)
    if estimator == "h1":  # the hits leave noise of one size on every response, however hard the hit
        residual = np.stack([frf.Y - frf.H * frf.F for frf in found.frfs])
        power = np.maximum(np.sum(np.abs(first.F) ** 2, axis=0), np.finfo(float).tiny)
        cov = np.einsum("ckm,dkm->mcd", residual, residual.conj()) / (K - 1) / power[:, None, None]
    else:
        cov = np.einsum("ckm,dkm->mcd", errors, errors.conj()) * K / (K - 1)
    return Frf(
        f=first.f,
        H=np.stack([H for H, _ in estimates], axis=1),
        channels=tuple(channels),
        input=input,
        coherence=np.stack([frf.coherence for frf in found.frfs], axis=1),
        cov=cov,
        nu=np.full(first.f.size, float(K - 1)),
        correlation=window_correlation(first),
        estimator=f"hammer {estimator}",
        segments=K,
        notes=window_note(first),
    )


def window_correlation(frf: ImpactFrf) -> tuple[float, ...]:
    """Return the correlation of the errors of bins 1, 2, ... apart that the exponential window makes."""
    depth = 2.0 * frf.added_decay / frf.df  # the power of the noise falls by exp(-depth) over the block
    if depth == 0.0:
        return ()
    at = depth + 2j * np.pi * np.arange(1, 60)
    size = np.abs((1.0 - np.exp(-at)) / at) * depth / (1.0 - np.exp(-depth))
    return tuple(float(x) for x in size[: int(np.sum(size > LEAST_CORRELATION))])


def window_note(frf: ImpactFrf) -> tuple[str, ...]:
    """Return a note on the decay that the exponential window adds to every mode, nothing without a window."""
    if frf.added_decay == 0.0:
        return ()
    return (
        f"exponential window over blocks of {1.0 / frf.df:.4g} s: it adds {frf.added_decay:.4g} 1/s to every decay in "
        "the response; it is subtracted from the modes",
    )


def impact_modes(found: HammerTests, channels: Sequence[str], f_lo: float, f_hi: float) -> dict[str, tuple[Mode, ...]]:
    """Return the modes of each response from f_lo to f_hi [Hz], by frequency; the window's damping is taken out."""
    if not found.frfs:
        return {}
    df = found.frfs[0].df
    band = max(f_lo, BINS_ABOVE_0 * df), f_hi
    apart = min(SEPARATION_Hz, max(SEPARATION_BINS * df, SEPARATION_SHARE * f_hi))
    return {c: find_modes(frf, band, separation_Hz=apart) for c, frf in zip(channels, found.frfs, strict=True)}


def fates(impacts: Sequence[Impact], t: Array) -> str:
    """Return how many impacts were good and, per fault, the times [s] and the detail of the first; t (N,) [s]."""
    bad = [i for i in impacts if not i.good]
    first = {i.fault: i for i in reversed(bad)}
    times = {f: ", ".join(f"{t[i.peak]:.2f}" for i in bad if i.fault == f) for f in first}
    words = "; ".join(f"{f} at {times[f]} s ({i.detail})" for f, i in reversed(first.items()))
    return f"{tally(impacts)}; {words}" if words else tally(impacts)
