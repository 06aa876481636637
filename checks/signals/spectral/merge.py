"""One response from two records that drive different bands."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.signals.spectral.frf import Frf, Mask, guarded_covariance


@dataclass(frozen=True, eq=False)
class _Spread:
    """A response on the common grid of n bins; var (n, C) is infinite in bins that the response lacks."""

    H: Complex
    cov: Complex
    var: Array
    coherence: Array
    nu: Array

    @property
    def usable(self) -> Mask:
        return np.asarray(np.isfinite(self.var).all(axis=1))

    @classmethod
    def of(cls, frf: Frf, first: int, n: int) -> "_Spread":
        at = slice(first, first + frf.f.size)
        C = len(frf.channels)
        H, cov, var = np.zeros((n, C), complex), np.zeros((n, C, C), complex), np.full((n, C), np.inf)
        coherence, nu = np.zeros((n, C)), np.ones(n)
        H[at], var[at], coherence[at], nu[at] = frf.H, frf.var, frf.coherence, frf.nu
        cov[at] = np.where(np.isfinite(frf.cov), frf.cov, 0.0)
        return cls(H, cov, var, coherence, nu)


def merge(low: Frf, high: Frf, merge_Hz: float | None = None) -> Frf:
    """Return the response low up to merge_Hz [Hz] and high above it; without merge_Hz both, by inverse variance.

    Grid: both equally spaced by the same step, on multiples of that step (for lpm of records of different length:
    choose `step` so that the steps agree), and without a gap between them. Same input and channels in the same order.
    The variance of a weighted mean is raised for the weights being estimates ([MEIER53]), its degrees of freedom are
    Welch-Satterthwaite's, of the channel that has the fewest. `correlation` is the longer reaching of the two. Raises
    ValueError if the two do not fit together, with the difference."""
    step, offset = _common_grid(low, high)
    first = min(0, offset)
    n = max(low.f.size, offset + high.f.size) - first
    a, b = _Spread.of(low, -first, n), _Spread.of(high, offset - first, n)
    f = low.f[0] + step * np.arange(first, first + n)
    weight = _inverse_variance(a, b) if merge_Hz is None else _split(low, high, f, merge_Hz, step)
    return _combine(low, high, f, a, b, weight, merge_Hz)


def _combine(low: Frf, high: Frf, f: Array, a: _Spread, b: _Spread, w: Array, merge_Hz: float | None) -> Frf:
    """Return the mean of a and b; w (n, C): weight of a in 0..1."""
    v = 1.0 - w
    # Weights taken from the data are right on average only: the variance of the mean grows (none where w is 0 or 1).
    raised = np.sqrt(1.0 + 2.0 * w * v * (1.0 / a.nu + 1.0 / b.nu)[:, None]) if merge_Hz is None else np.ones(w.shape)
    wa, wb = w * raised, v * raised
    cov = a.cov * wa[:, :, None] * wa[:, None, :] + b.cov * wb[:, :, None] * wb[:, None, :]
    usable = (a.usable | (w == 0.0).all(axis=1)) & (b.usable | (w == 1.0).all(axis=1))
    how = "weighted by inverse variance" if merge_Hz is None else f"merged at {merge_Hz:g} Hz"
    longer = max((low, high), key=lambda frf: len(frf.correlation))
    return Frf(
        f=f,
        H=np.where(usable[:, None], w * a.H + v * b.H, 0.0),
        channels=low.channels,
        input=low.input,
        coherence=np.where(usable[:, None], w * a.coherence + v * b.coherence, 0.0),
        cov=guarded_covariance(cov, usable),
        nu=_effective_nu(a, b, w),
        correlation=longer.correlation,
        estimator=low.estimator,
        segments=min(low.segments, high.segments),
        notes=(*low.notes, *(note for note in high.notes if note not in low.notes), how),
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


def _split(low: Frf, high: Frf, f: Array, merge_Hz: float, step: float) -> Array:
    if not (low.f[0] <= merge_Hz <= low.f[-1] + step and high.f[0] - step <= merge_Hz <= high.f[-1]):
        raise ValueError(
            f"cannot merge at {merge_Hz:g} Hz: the records give {low.f[0]:g}..{low.f[-1]:g} and "
            f"{high.f[0]:g}..{high.f[-1]:g} Hz"
        )
    w = np.zeros((f.size, len(low.channels)))
    w[f <= merge_Hz] = 1.0
    return w


def _inverse_variance(a: _Spread, b: _Spread) -> Array:
    """Return the (n, C) weight of a; a bin that is unusable in one response is taken from the other."""
    only_a, only_b = a.usable & ~b.usable, b.usable & ~a.usable
    va, vb = (np.where(np.isfinite(x.var), x.var, 1.0) for x in (a, b))
    total = va + vb
    w = np.where(total > 0.0, vb / np.where(total > 0.0, total, 1.0), 0.5)
    return np.where(only_a[:, None], 1.0, np.where(only_b[:, None], 0.0, w))


def _effective_nu(a: _Spread, b: _Spread, w: Array) -> Array:
    """Return the (n,) Welch-Satterthwaite degrees of freedom of w a + (1 - w) b."""
    pa = w**2 * np.where(np.isfinite(a.var), a.var, 0.0)
    pb = (1.0 - w) ** 2 * np.where(np.isfinite(b.var), b.var, 0.0)
    spread = pa**2 / a.nu[:, None] + pb**2 / b.nu[:, None]
    nu = np.where(spread > 0.0, (pa + pb) ** 2 / np.where(spread > 0.0, spread, 1.0), np.minimum(a.nu, b.nu)[:, None])
    fewest: Array = nu.min(axis=1)
    return fewest
