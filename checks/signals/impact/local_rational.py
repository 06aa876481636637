"""Local rational fit: one pole and a polynomial on the bins around a peak of an impact FRF.

H(f) = r/(z - q) + c0 + c1 z + c2 z^2, z = (f - centre)/half: the pole by itself, everything else as a local polynomial
(local rational method: [MG12]; [PS12] 7.3). Started by the linear iteration of [SK63], finished by Gauss-Newton."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.signals.impact.hammer import ImpactFrf

_HALF_BINS = 8  # at least, each side of the peak: 17 complex bins for 5 complex unknowns
_HALF_WIDTHS = 6.0  # half-power half-widths each side: beyond, a bin carries little information on the pole
_SMOOTH_BINS = 11  # with fewer, bins that happen to scatter little get the weight, and the interval comes out short


@dataclass(frozen=True, eq=False)
class LocalBins:
    """Bins of a fit: z (B,) scaled frequency, H (B,), weight (B,) inverse variance, and the impacts' contributions."""

    f: Array
    z: Array
    centre: float
    half: float
    H: Complex
    weight: Array
    parts: Complex  # (K, B): (Y_k - H F_k) conj(F_k)/S, summing to zero over k
    share: Array  # (K,): of the force's energy in the band


def neighbourhood(frf: ImpactFrf, centre: float, half_width: float) -> LocalBins:
    """Return the bins around a peak at centre [Hz] with this half-power half-width [Hz] that determine its pole."""
    half = max(_HALF_WIDTHS * half_width, _HALF_BINS * frf.df)
    half = min(half, max(0.15 * centre, _HALF_BINS * frf.df))
    return bins_about(frf, centre, min(half, max(_to_neighbour(frf, centre, half), _HALF_BINS * frf.df)))


def bins_about(frf: ImpactFrf, centre: float, half: float) -> LocalBins:
    """Return the bins within half [Hz] of a centre."""
    s = (np.abs(frf.f - centre) <= half) & (frf.f > 0)
    F, Y, H = frf.F[:, s], frf.Y[:, s], frf.H[s]
    power = np.abs(F) ** 2
    S = power.sum(axis=0)
    residual = Y - H * F
    noise = smooth(np.sum(np.abs(_without_gain(residual, H * F)) ** 2, axis=0))
    floor = 1e-12 * np.max(np.abs(Y) ** 2)
    weight = S / np.maximum(noise, floor)
    share = power.sum(axis=1) / power.sum()
    return LocalBins(frf.f[s], (frf.f[s] - centre) / half, centre, half, H, weight, residual * F.conj() / S, share)


def _to_neighbour(frf: ImpactFrf, centre: float, half: float) -> float:
    """Return the distance to the deepest point before a higher peak inside the band; that peak dominates beyond it."""
    near = np.flatnonzero(np.abs(frf.f - centre) <= half)
    k = round(centre / frf.df)
    top = np.max(np.abs(frf.H[max(k - 2, 0) : k + 3]))
    higher = near[(np.abs(near - k) > 2) & (np.abs(frf.H[near]) > 1.2 * top)]
    if higher.size == 0:
        return half
    other = int(higher[np.argmin(np.abs(higher - k))])
    lo, hi = sorted((k, other))
    valley = lo + int(np.argmin(np.abs(frf.H[lo : hi + 1])))
    return abs(valley - k) * frf.df


def _without_gain(residual: Complex, predicted: Complex) -> Complex:
    """Return the residuals (K, B) without the part that is a gain of the impact: a gain moves no pole."""
    power = np.maximum(np.sum(np.abs(predicted) ** 2, axis=1), np.finfo(float).tiny)
    gain = np.sum(residual * predicted.conj(), axis=1) / power
    rest: Complex = residual - gain[:, None] * predicted
    return rest


def smooth(x: Array) -> Array:
    """Return the running mean over a few bins: a variance from few impacts is too rough for weights."""
    kernel = np.ones(_SMOOTH_BINS)
    return np.convolve(x, kernel, "same") / np.convolve(np.ones(x.size), kernel, "same")


def solve_pole(local: LocalBins, order: int) -> Complex | None:
    """Return the unknowns (q, r, c0, c1, ...) of the local model, or None if the pole does not decay."""
    q = _start(local, order)
    q = complex(q.real, abs(q.imag) or 1e-6)
    basis = np.column_stack([1.0 / (local.z - q), local.z[:, None] ** np.arange(order + 1)])
    theta = _gauss_newton(local, np.concatenate([[q], weighted_inverse(basis, local.weight) @ local.H]))
    return theta if np.isfinite(theta).all() and theta[0].imag > 0 else None


def _start(local: LocalBins, order: int) -> complex:
    """Return the pole by the linear iteration: (z - q) H = polynomial of order + 1, divided by the last |z - q|."""
    q = 0j
    root = np.sqrt(local.weight)
    for step in range(4):
        scale = root / np.abs(local.z - q) if step and abs(q.imag) > 1e-9 else root
        A = np.column_stack([local.H, local.z[:, None] ** np.arange(order + 2)])
        q = complex(np.linalg.lstsq(A * scale[:, None], local.z * local.H * scale, rcond=None)[0][0])
    return q


def model(z: Array, theta: Complex) -> Complex:
    """Return the response H (B,) of the unknowns (q, r, c0, c1, ...)."""
    powers = z[:, None] ** np.arange(theta.size - 2)
    H: Complex = theta[1] / (z - theta[0]) + powers @ theta[2:]
    return H


def jacobian(z: Array, theta: Complex) -> Complex:
    """Return (B, P) derivatives of `model` by its unknowns."""
    away = z - theta[0]
    return np.column_stack([theta[1] / away**2, 1.0 / away, z[:, None] ** np.arange(theta.size - 2)])


def weighted_inverse(A: Complex, weight: Array) -> Complex:
    """Return the (P, B) matrix that maps data to weighted least-squares unknowns."""
    root = np.sqrt(weight)
    inverse: Complex = np.asarray(np.linalg.pinv(A * root[:, None]) * root, dtype=np.complex128)
    return inverse


def _gauss_newton(local: LocalBins, theta: Complex) -> Complex:
    """Return the unknowns by Gauss-Newton: the model is analytic in them, so complex least squares suffices."""
    cost = cost_of(local, theta)
    for _ in range(30):
        solve = weighted_inverse(jacobian(local.z, theta), local.weight)
        step = solve @ (local.H - model(local.z, theta))
        factor = 1.0
        while factor > 1e-3 and cost_of(local, theta + factor * step) > cost:
            factor *= 0.5
        if factor <= 1e-3:
            return theta
        theta = theta + factor * step
        cost = cost_of(local, theta)
        if abs(factor * step[0]) < 1e-10:
            return theta
    return theta


def cost_of(local: LocalBins, theta: Complex) -> float:
    """Return the weighted sum of squared residuals."""
    return float(np.sum(local.weight * np.abs(local.H - model(local.z, theta)) ** 2))


def frequency(local: LocalBins, theta: Complex) -> complex:
    """Return the complex frequency p/2 pi j of the pole: real part the damped frequency [Hz], imaginary decay/2 pi."""
    return local.centre + local.half * complex(theta[0])


def scatter(local: LocalBins, influence: Array) -> float:
    """Return the standard error of an estimate from the influence (K,) of each impact on it.

    Each impact's own estimate differs from the mean by influence/share and deserves the weight share, the noise of the
    response being the same for all: exact for normal noise, with K - 1 degrees of freedom."""
    return float(np.sqrt(np.sum(influence**2 / local.share) / (local.share.size - 1)))
