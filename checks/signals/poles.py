"""Poles that several channels share, from their responses in a band: rational locally, polynomial elsewhere.

H_c(f) = sum_k R_ck/(z - q_k) + P_c(z) with z = (f - centre)/half: every pole by itself, all else a polynomial per
channel (local rational method: McKelvey & Guerin 2012; Pintelon & Schoukens, System Identification, 2nd ed., 7.3). Only
the poles are unknowns of the iteration: residues and polynomials are eliminated (variable projection: Golub & Pereyra
1973; the Jacobian in Kaufman's form, 1975). The model is analytic in its complex unknowns, so complex least squares is
all of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from checks.signals.frf import Frf

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SMOOTH_BINS = 35  # variances are averaged over about two neighbourhoods: 7 degrees of freedom each are too rough
_ITERATIONS = 40
_CONVERGED = 1e-9
_FLOOR = 1e-9  # smallest standard deviation over the largest response: numbers without noise still need a weight


@dataclass(frozen=True, eq=False)
class Window:
    """Responses of a band: f (B,) [Hz], z (B,) in -1..1, H (B, C), sd (B, C) standard deviation of the complex error,
    correlation of errors 1, 2, ... bins apart."""

    f: Array
    z: Array
    H: Complex
    sd: Array
    correlation: tuple[float, ...]
    channels: tuple[str, ...]

    @property
    def centre(self) -> float:
        return float(self.f[0] + self.f[-1]) / 2

    @property
    def half(self) -> float:
        return float(self.f[-1] - self.f[0]) / 2

    def scaled(self, f_Hz: complex) -> complex:
        return (f_Hz - self.centre) / self.half

    def frequency(self, q: complex) -> complex:
        """Complex frequency [Hz]: the root s = 2 pi j f. Im f is the decay over 2 pi, positive when it decays."""
        return self.centre + self.half * complex(q)


@dataclass(frozen=True, eq=False)
class PoleFit:
    """q (K,) scaled poles; residues (K, C); polynomials (order + 1, C); influence (K, B, C): dq_k per error of H.

    misfit : mean of the squared residual over its expected variance, 1 where the model holds.
    """

    window: Window
    q: Complex
    residues: Complex
    polynomials: Complex
    influence: Complex
    misfit: float

    @property
    def order(self) -> int:
        return len(self.polynomials) - 1

    def frequencies(self) -> Complex:
        """(K,) complex frequencies [Hz] of the poles."""
        return np.array([self.window.frequency(q) for q in self.q])

    def response(self) -> Complex:
        """(B, C) fitted responses."""
        return _basis(self.window.z, self.q, self.order) @ np.vstack([self.residues, self.polynomials])

    def u(self, k: int) -> float:
        """Standard uncertainty [Hz] of each of the real and the imaginary part of the k-th complex frequency.

        Scatter of the responses, correlated between bins; the misfit widens it where the model leaves more (Birge).
        """
        return self.window.half * float(np.sqrt(max(self.misfit, 1.0) * spread(self.window, self.influence[k]) / 2))

    def amplitude(self, k: int) -> Array:
        """(C,) height of the k-th resonance by itself, in the channels' units: |residue| over the decay."""
        return np.abs(self.residues[k]) / abs(self.q[k].imag)


def window(frf: Frf, f_lo: float, f_hi: float, *channels: str) -> Window:
    """The bins of a band with a known variance. Raises ValueError when fewer than 12 are left."""
    part = frf.select(*channels).band(f_lo, f_hi)
    good = part.usable
    if np.count_nonzero(good) < 12:
        raise ValueError(f"{np.count_nonzero(good)} usable bins in {f_lo:.4g}..{f_hi:.4g} Hz; 12 or more are needed")
    f, H = part.f[good], part.H[good]
    sd = np.sqrt(uniform_filter1d(part.var[good], min(_SMOOTH_BINS, f.size), axis=0, mode="nearest"))
    sd = np.maximum(sd, _FLOOR * np.abs(H).max(axis=0))
    z = (2 * f - f[0] - f[-1]) / (f[-1] - f[0])
    return Window(f, z, H, sd, part.correlation, part.channels)


def thinned(w: Window) -> Window:
    """Bins so far apart that their errors are independent."""
    stride = len(w.correlation) + 1
    part = slice(stride // 2, None, stride)
    return Window(w.f[part], w.z[part], w.H[part], w.sd[part], (), w.channels)


def _basis(z: Array, q: Complex, order: int) -> Complex:
    return np.column_stack([1.0 / (z[:, None] - q), z[:, None] ** np.arange(order + 1)])


def fit_poles(w: Window, start: Sequence[complex], order: int) -> PoleFit | None:
    """Fit with as many poles as `start` (scaled) names; None when an iterate leaves the band or does not decay."""
    q = np.array(start, dtype=complex)
    state = _eliminate(w, q, order)
    for _ in range(_ITERATIONS):
        step = _step(state)
        factor = 1.0
        while factor > 1e-3:
            tried = q + factor * step
            if _inside(tried) and (new := _eliminate(w, tried, order)).cost <= state.cost:
                break
            factor *= 0.5
        else:
            break
        q, state = tried, new
        if np.abs(factor * step).max() < _CONVERGED:
            break
    return _result(w, q, order, state) if _inside(q) and np.isfinite(state.cost) else None


def _inside(q: Complex) -> bool:
    return bool((np.abs(q.real) < 1.2).all() and (q.imag > 1e-7).all() and (q.imag < 1.0).all())


@dataclass(frozen=True, eq=False)
class _State:
    """coefficients (K + order + 1, C); residual (C, B) weighted; tangent (C, B, K): its change with the poles."""

    coefficients: Complex
    residual: Complex
    tangent: Complex
    cost: float


def _eliminate(w: Window, q: Complex, order: int) -> _State:
    """Least squares for everything but the poles, which stay."""
    weight = 1.0 / w.sd.T  # (C, B)
    A = weight[:, :, None] * _basis(w.z, q, order)
    Q, R = np.linalg.qr(A)
    y = weight * w.H.T
    inner = np.einsum("cbp,cb->cp", Q.conj(), y)
    coefficients = np.linalg.solve(R, inner[..., None])[..., 0]
    residual = y - np.einsum("cbp,cp->cb", Q, inner)
    moved = weight[:, :, None] * (coefficients[:, None, : q.size] / (w.z[:, None] - q) ** 2)
    tangent = moved - Q @ (Q.conj().transpose(0, 2, 1) @ moved)
    return _State(coefficients.T, residual, tangent, float(np.sum(np.abs(residual) ** 2)))


def _step(state: _State) -> Complex:
    J = state.tangent.reshape(-1, state.tangent.shape[-1])
    return np.asarray(np.linalg.lstsq(J, state.residual.ravel(), rcond=None)[0])


def _result(w: Window, q: Complex, order: int, state: _State) -> PoleFit:
    K, (C, B) = q.size, state.residual.shape
    J = state.tangent.reshape(-1, K)
    gain: Complex = np.asarray(np.linalg.pinv(J), dtype=np.complex128).reshape(K, C, B) / w.sd.T
    freedom = max(1, C * B - K - C * (K + order + 1))
    return PoleFit(
        window=w,
        q=q,
        residues=state.coefficients[:K],
        polynomials=state.coefficients[K:],
        influence=gain.transpose(0, 2, 1),
        misfit=state.cost / freedom,
    )


def spread(w: Window, influence: Complex) -> float:
    """E|sum of influence (B, C) times the errors|^2: variances and the correlation of neighbouring bins.

    Channels that share the noise of the drive err alike: their standard deviations add up, which is the worst case.
    """
    a = influence * w.sd
    total = 0.0
    for lag, rho in enumerate((1.0, *w.correlation)):
        twice = 2.0 if lag else 1.0
        total += twice * rho * float(np.sum((a[lag:] * a[: a.shape[0] - lag].conj()).real))
    return max(total, 0.0)
