"""Poles that several outputs share, from the transforms of one record: rational locally, polynomial elsewhere.

Over a band every transform obeys Y_c = H_c U + T_c + noise: H_c the response, T_c the transient of the record's ends.
Both have the poles of the structure, H_c = sum_k R_ck/(z - q_k) + P_c(z), T_c likewise, z = (f - centre)/half: the
poles of the band by themselves, all else a polynomial. Nothing leaks, and the errors of the bins are independent
([PS12] 6.3 and 7.3; [MG12] for the local form).

Only the poles are unknowns of the iteration: residues and polynomials are eliminated (variable projection: [GP73]; the
Jacobian in the form of [KAUFMAN75]). The model is analytic in its complex unknowns, so complex least squares
suffices."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from checks.arrays import Array, Complex
from checks.record import Record
from checks.rounding import with_U
from checks.signals.spectral.recursion import moving_mean
from checks.signals.spectral.transform import transform

ROUNDS = 2  # noise from the residual, fit again
NOISE_BINS = 41  # the noise is taken to be even over this many
MIN_BINS_PER_UNKNOWN = 3  # below, the noise cannot be estimated from the residual
ENOUGH_BINS = 700  # of a long record evenly so many bins are used, up to twice: time grows with them, precision little
_ITERATIONS = 30
_CONVERGED = 1e-4  # of the noise of one bin: a hundredth of a standard error
_DEPENDENT = 1e-4  # remainder of a column of length 1 after the others
_FLOOR = 1e-10  # smallest noise over the largest transform: numbers without noise still need a weight


U_CLOCK = 2e-4  # relative, k = 2, as the specs state it: the converters' clock has not been compared with another


@dataclass(frozen=True, eq=False)
class FittedRoot:
    """A pole or zero s from a fit. f_Hz: undamped natural frequency |s|/2 pi; damping_ratio: -Re s/|s|. u_*: standard
    uncertainties from the scatter, u_*_model from one order more of the polynomials."""

    f_Hz: float
    damping_ratio: float
    u_Hz: float
    u_Hz_model: float
    u_damping: float
    u_damping_model: float

    def __repr__(self) -> str:
        f, damping = with_U(self.f_Hz, 2.0 * math.hypot(self.u_Hz, self.u_Hz_model)), self.damping_ratio
        return f"{type(self).__name__}({f} Hz, damping ratio {with_U(damping, self.U_damping)}; k = 2)"

    @property
    def U_Hz(self) -> float:
        """Return U of the frequency [Hz] (k = 2) from scatter, model, and the clock by which the record was sampled."""
        return math.hypot(2.0 * math.hypot(self.u_Hz, self.u_Hz_model), U_CLOCK * self.f_Hz)

    @property
    def U_damping(self) -> float:
        """Return U of the damping ratio (k = 2) from scatter and model."""
        return 2.0 * math.hypot(self.u_damping, self.u_damping_model)


def root_numbers(f: complex, u: float, finer: complex | None) -> dict[str, float]:
    """Return the numbers of a `FittedRoot`. f: its complex frequency [Hz], u: standard uncertainty of the real and of
    the imaginary part; finer: the frequency with one order more, None if that fit failed."""
    size = abs(f)
    return {
        "f_Hz": size,
        "damping_ratio": f.imag / size,
        "u_Hz": u,
        "u_Hz_model": math.inf if finer is None else abs(abs(finer) - size),
        "u_damping": u / size,
        "u_damping_model": math.inf if finer is None else abs(finer.imag / abs(finer) - f.imag / size),
    }


@dataclass(frozen=True, eq=False)
class Transforms:
    """Transforms of a whole record without its mean: f (F,) [Hz], U (F,), Y (F, C)."""

    f: Array
    U: Complex
    Y: Complex
    channels: tuple[str, ...]

    @classmethod
    def of(cls, record: Record, input: str, outputs: Sequence[str]) -> "Transforms":
        """Return the transforms of channels of a record. Raises RecordError if a channel is missing."""
        U, *Y = (transform(record[name]) for name in (input, *outputs))
        return cls(
            np.arange(U.size, dtype=float) * (record.fs / len(record[input])), U, np.stack(Y, axis=1), tuple(outputs)
        )

    def window(self, f_lo: float, f_hi: float, *channels: str) -> "PoleWindow":
        """Return the bins of a band and some channels (default: all), scaled for a fit. Raises ValueError if it holds
        too few bins, or the input has no power there."""
        first, last = int(np.searchsorted(self.f, f_lo)), int(np.searchsorted(self.f, f_hi, side="right"))
        s = slice(first, last, max(1, (last - first) // ENOUGH_BINS))
        names = channels or self.channels
        f, U, Y = self.f[s], self.U[s], self.Y[s][:, [self.channels.index(c) for c in names]]
        if f.size < 12:
            raise ValueError(f"{f.size} bins in {f_lo:.4g}..{f_hi:.4g} Hz; 12 or more are needed")
        drive, size = (np.sqrt(np.mean(np.abs(x) ** 2, axis=0)) for x in (U, Y))
        if not (drive > 0 and (size > 0).all() and np.isfinite(drive) and np.isfinite(size).all()):
            raise ValueError(f"input or output is zero, or not finite, in {f_lo:.4g}..{f_hi:.4g} Hz")
        z = (2 * f - f[0] - f[-1]) / (f[-1] - f[0])
        return PoleWindow(f, z, U / drive, Y / size, size / drive, np.ones(Y.shape), names)


@dataclass(frozen=True, eq=False)
class PoleWindow:
    """Bins of a fit: f (B,) [Hz], z (B,) in -1..1, U (B,), Y (B, C) of rms 1, scale (C,) to undo that on a response,
    sd (B, C) noise of Y, in its scale."""

    f: Array
    z: Array
    U: Complex
    Y: Complex
    scale: Array
    sd: Array
    channels: tuple[str, ...]

    def thinned(self, bins: int) -> "PoleWindow":
        """Return the window with at most about the given number of its bins, evenly spread."""
        s = slice(None, None, max(1, self.f.size // bins))
        return replace(self, f=self.f[s], z=self.z[s], U=self.U[s], Y=self.Y[s], sd=self.sd[s])

    @property
    def half(self) -> float:
        return float(self.f[-1] - self.f[0]) / 2

    def scaled(self, f_Hz: complex) -> complex:
        """Return the scaled value z of a complex frequency."""
        return (f_Hz - float(self.f[0] + self.f[-1]) / 2) / self.half

    def frequency(self, q: complex) -> complex:
        """Return the complex frequency f [Hz]: the root s = 2 pi j f. Im f is the decay over 2 pi, positive if it
        decays."""
        return float(self.f[0] + self.f[-1]) / 2 + self.half * complex(q)


@dataclass(frozen=True, eq=False)
class PoleFit:
    """Fit of poles to a window. q (K,) scaled poles; residues (K, C) and polynomials (order + 1, C) of the response;
    covariance (K,) E|dq|^2; residual (B, C) of Y over its noise."""

    window: PoleWindow
    q: Complex
    residues: Complex
    polynomials: Complex
    variance: Array
    residual: Complex

    @property
    def order(self) -> int:
        return len(self.polynomials) - 1

    @property
    def cost(self) -> float:
        return float(np.sum(np.abs(self.residual) ** 2))

    def frequencies(self) -> Complex:
        """Return the (K,) complex frequencies [Hz] of the poles."""
        return np.array([self.window.frequency(q) for q in self.q])

    def response(self) -> Complex:
        """Return the (B, C) fitted responses in the channels' units per unit of the input."""
        terms = local_basis(self.window.z, self.q, self.order)
        return (terms @ np.vstack([self.residues, self.polynomials])) * self.window.scale

    def u(self, k: int) -> float:
        """Return the standard uncertainty [Hz] of the real and of the imaginary part of the k-th complex frequency."""
        return self.window.half * float(np.sqrt(self.variance[k] / 2))

    def amplitude(self, k: int) -> Array:
        """Return the (C,) height of the k-th resonance by itself, in the channels' units: |residue| over the decay."""
        return np.asarray(np.abs(self.residues[k]) / abs(self.q[k].imag) * self.window.scale)


def local_basis(z: Array, q: Complex, order: int) -> Complex:
    """Return the basis (B, K + order + 1): a column per pole, then the powers of z."""
    terms = np.empty((z.size, q.size + order + 1), dtype=complex)
    terms[:, : q.size] = 1.0 / (z[:, None] - q)
    terms[:, q.size :] = np.vander(z, order + 1, increasing=True)
    return terms


def basis(w: PoleWindow, q: Complex, order: int) -> Complex:
    """Return the basis (B, 2 (K + order + 1)): the local terms driven by U, then those of the transient."""
    terms = local_basis(w.z, q, order)
    return np.concatenate([w.U[:, None] * terms, terms], axis=1)


def enough_bins(w: PoleWindow, poles: int, order: int) -> bool:
    """Return whether a window holds more data than the fit has unknowns."""
    return w.f.size >= MIN_BINS_PER_UNKNOWN * 2 * (poles + order + 1)


def fit_poles(w: PoleWindow, start: Sequence[complex], order: int, rounds: int = ROUNDS) -> PoleFit | None:
    """Fit with as many poles as `start` (scaled) names; None if one leaves the band or does not decay, or the band has
    too few bins. The window's noise is used first, then in each round that of the residual."""
    q = np.array(start, dtype=complex)
    if not enough_bins(w, q.size, order) or not _inside(q):
        return None
    q, state = _iterate(w, q, order)
    for _ in range(rounds):
        w = with_noise_of(w, state.residual.T * w.sd)
        q, state = _iterate(w, q, order)
    return _result(w, q, order, state) if np.isfinite(state.cost) else None


def with_noise_of(w: PoleWindow, residual: Complex) -> PoleWindow:
    """Return the window with the noise that a residual (B, C) of Y shows, even over NOISE_BINS."""
    power = moving_mean(np.abs(residual) ** 2, min(NOISE_BINS, w.f.size))
    return replace(w, sd=np.sqrt(np.maximum(power, _FLOOR**2 * np.max(np.abs(w.Y) ** 2, axis=0))))


def _inside(q: Complex) -> bool:
    return bool((np.abs(q.real) < 1.2).all() and (q.imag > 1e-7).all() and (q.imag < 1.0).all())


@dataclass(frozen=True, eq=False)
class _Elimination:
    """Least squares on the columns of given poles. coefficients (C, P); residual (C, B) weighted; tangent (C, B, K):
    its derivatives by the poles."""

    coefficients: Complex
    residual: Complex
    tangent: Complex
    cost: float


def _iterate(w: PoleWindow, q: Complex, order: int) -> tuple[Complex, _Elimination]:
    """Return the poles and their elimination by Gauss-Newton with halved steps."""
    state = _eliminate(w, q, order)
    for _ in range(_ITERATIONS):
        step, gain = _step(state)
        if gain < _CONVERGED * state.cost / state.residual.size:
            break
        factor = 1.0
        while factor > 1e-3:
            tried = q + factor * step
            if _inside(tried) and (new := _eliminate(w, tried, order)).cost <= state.cost:
                break
            factor *= 0.5
        else:
            return q, state
        q, state = tried, new
    return q, state


def eliminate(w: PoleWindow, A: Complex) -> tuple[Complex, Complex, Complex, Complex]:
    """Return the weighted least squares of every channel on the same columns A (B, P): the weighted columns (C, B, P)
    and X (C, P, P) of `_to_orthonormal`, coefficients (C, P), residual (C, B)."""
    weight = 1.0 / w.sd.T
    columns = weight[:, :, None] * A
    X = _to_orthonormal(columns)
    y = (weight * w.Y.T)[:, :, None]
    coefficients = X @ _within(columns, X, y)
    return columns, X, coefficients[..., 0], (y - columns @ coefficients)[..., 0]


def _within(A: Complex, X: Complex, y: Complex) -> Complex:
    """Return the (..., P, K) components of y (..., B, K) along the orthonormal A X."""
    return _adjoint(_adjoint(y) @ A @ X)


def _to_orthonormal(A: Complex) -> Complex:
    """Return X (C, P, P) such that A X (C, B, P) has orthonormal columns. A X is not made: a fit needs products.

    By the Cholesky factor of A^H A, its columns scaled to one: ten times faster than Householder's for tall A; if the
    columns of A are too close to dependent for that (a condition above about 1e4), by Householder's."""
    gram = _adjoint(A) @ A
    length = np.sqrt(np.einsum("cpp->cp", gram).real)
    shorter = 1.0 / np.where(length > 0.0, length, 1.0)
    L = _cholesky(shorter[:, :, None] * gram * shorter[:, None])
    if L is None:
        R = np.linalg.qr(A * shorter[:, None], mode="r")
        return np.asarray(shorter[:, :, None] * np.linalg.pinv(R), dtype=np.complex128)
    return np.asarray(shorter[:, :, None] * _adjoint(np.asarray(np.linalg.inv(L), dtype=np.complex128)))


def _adjoint(A: Complex) -> Complex:
    return A.conj().swapaxes(-1, -2)


def _cholesky(gram: Complex) -> Complex | None:
    try:
        L = np.asarray(np.linalg.cholesky(gram), dtype=np.complex128)
    except np.linalg.LinAlgError:
        return None
    return L if np.abs(np.einsum("cpp->cp", L)).min() > _DEPENDENT else None


def _eliminate(w: PoleWindow, q: Complex, order: int) -> _Elimination:
    A = basis(w, q, order)
    columns, X, coefficients, residual = eliminate(w, A)
    K, half = q.size, coefficients.shape[1] // 2
    squared = A[:, half : half + K] ** 2  # the transient's terms of the poles stand there undriven
    by_pole = w.U[:, None] * coefficients[:, None, :K] + coefficients[:, None, half : half + K]
    moved = squared * (by_pole / w.sd.T[:, :, None])
    tangent = moved - columns @ (X @ _within(columns, X, moved))
    return _Elimination(coefficients, residual, tangent, float(np.sum(np.abs(residual) ** 2)))


def _step(state: _Elimination) -> tuple[Complex, float]:
    """Return the Gauss-Newton step of the poles and the expected reduction of the cost."""
    J = state.tangent.reshape(-1, state.tangent.shape[-1])
    Q, R = np.linalg.qr(J)
    step = np.linalg.pinv(R) @ (Q.conj().T @ state.residual.ravel())
    return step, float(np.sum(np.abs(J @ step) ** 2))


def _result(w: PoleWindow, q: Complex, order: int, state: _Elimination) -> PoleFit:
    K, (C, B) = q.size, state.residual.shape
    gain: Complex = np.asarray(np.linalg.pinv(state.tangent.reshape(-1, K)), dtype=np.complex128).reshape(K, C, B)
    half = K + order + 1
    freedom = B - 2 * half - K / C
    return PoleFit(
        window=w,
        q=q,
        residues=state.coefficients[:, :K].T,
        polynomials=state.coefficients[:, K:half].T,
        variance=scatter(gain, state.residual) * B / freedom,
        residual=state.residual.T,
    )


def scatter(gain: Complex, residual: Complex) -> Array:
    """Return E|dq|^2 (K,) of estimates that are gain (K, C, B) times the errors. Size and correlation of the errors
    between channels come from the residual (C, B)."""
    alike = residual @ residual.conj().T / residual.shape[1]
    return np.asarray(np.einsum("kcb,cd,kdb->k", gain, alike, gain.conj()).real)
