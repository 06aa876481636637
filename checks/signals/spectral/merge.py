"""One response from two records that drive different bands."""

import numpy as np

from checks.signals.spectral.frf import Frf, guarded_covariance


def merge(low: Frf, high: Frf, merge_Hz: float) -> Frf:
    """Return the response low up to merge_Hz [Hz] and high above it; in bins that this one lacks the variance is
    infinite.

    Grid: both equally spaced by the same step, on multiples of that step (for lpm of records of different length:
    choose `step` so that the steps agree), and without a gap between them. Same input and channels in the same order.
    `correlation` is the longer reaching of the two. Raises ValueError if the two do not fit together, with the
    difference."""
    step, offset = _common_grid(low, high)
    if not (low.f[0] <= merge_Hz <= low.f[-1] + step and high.f[0] - step <= merge_Hz <= high.f[-1]):
        raise ValueError(
            f"cannot merge at {merge_Hz:g} Hz: the records give {low.f[0]:g}..{low.f[-1]:g} and "
            f"{high.f[0]:g}..{high.f[-1]:g} Hz"
        )
    place = np.arange(min(0, offset), max(low.f.size, offset + high.f.size))  # 0: the first bin of low
    f, C = low.f[0] + step * place, len(low.channels)
    H, coherence, cov = np.zeros((f.size, C), complex), np.zeros((f.size, C)), np.zeros((f.size, C, C), complex)
    nu, usable = np.ones(f.size), np.zeros(f.size, dtype=bool)
    for frf, first, mine in ((low, 0, f <= merge_Hz), (high, offset, f > merge_Hz)):
        there = np.flatnonzero(mine & (place >= first) & (place < first + frf.f.size))
        there = there[frf.usable[place[there] - first]]
        bins = place[there] - first
        H[there], coherence[there], cov[there] = frf.H[bins], frf.coherence[bins], frf.cov[bins]
        nu[there], usable[there] = frf.nu[bins], True
    longer = max((low, high), key=lambda frf: len(frf.correlation))
    return Frf(
        f=f,
        H=H,
        channels=low.channels,
        input=low.input,
        coherence=coherence,
        cov=guarded_covariance(cov, usable),
        nu=nu,
        correlation=longer.correlation,
        estimator=low.estimator,
        segments=min(low.segments, high.segments),
        notes=(*low.notes, *(note for note in high.notes if note not in low.notes), f"merged at {merge_Hz:g} Hz"),
    )


def _common_grid(low: Frf, high: Frf) -> tuple[float, int]:
    """Return (step [Hz], bins from the first of low to the first of high)."""
    for what in ("channels", "input", "estimator"):
        if getattr(low, what) != getattr(high, what):
            raise ValueError(f"cannot merge: {what} {getattr(low, what)} and {getattr(high, what)} differ")
    if min(low.f.size, high.f.size) < 2:
        raise ValueError(f"cannot merge {low.f.size} and {high.f.size} bin(s); each side needs two or more")
    steps = [np.diff(frf.f) for frf in (low, high)]
    step = float(np.mean(steps[0]))
    if any(np.abs(s / step - 1.0).max() > 1e-6 for s in steps):
        raise ValueError(
            f"cannot merge: bins are {steps[0].mean():.6g} and {steps[1].mean():.6g} Hz apart (or not equally); "
            "estimate both with the same spacing"
        )
    offset = (high.f[0] - low.f[0]) / step
    if abs(offset - round(offset)) > 1e-3:
        raise ValueError(f"cannot merge: bins every {step:.6g} Hz start at {low.f[0]:.6g} and {high.f[0]:.6g} Hz")
    if round(offset) > low.f.size or round(offset) + high.f.size < 0:
        raise ValueError(
            f"cannot merge: a gap lies between {low.f[0]:g}..{low.f[-1]:g} and {high.f[0]:g}..{high.f[-1]:g} Hz"
        )
    return step, round(offset)
