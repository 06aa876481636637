"""Least squares about many bins at once: responses and transients as polynomials of the bin, and their residuals."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.signals.spectral.frf import guarded_covariance

MIN_DOF = 7  # with fewer, F(2, 2 nu) has tails so heavy that a variance is of little use
BATCH_BINS = 768  # bins solved at once: fewer cost more in calls, more in memory far from the core
WHOLE_BINS = 16  # batches are filled up to a multiple: the last digit of a bin must not depend on where its batch ends
SAMPLED_BINS = 256  # of the first ones the correlation of neighbours is taken
DEPENDENT = 1e-20  # share of a regressor's power left by the others, below which it is one of them but for rounding


@dataclass(frozen=True, eq=False)
class LocalRegression:
    """Regressors of a fit about one bin, the same for every bin.

    off_transient : (2 half + 1, m) orthonormal; its columns are blind to every transient of the order.
    regressors : (order + 1, 2 half + 1) powers of r / half, the constant last, projected by off_transient afterwards.
    """

    off_transient: Array
    regressors: Array
    half: int
    dof: int

    @classmethod
    def of(cls, order: int, half: int) -> "LocalRegression":
        dof = 2 * half + 1 - 2 * (order + 1)
        if order < 0 or dof < MIN_DOF:
            raise ValueError(f"order {order} over +-{half} bins leaves {dof} degrees of freedom; needed: {MIN_DOF}")
        powers = np.vander(np.arange(-half, half + 1) / half, order + 1)
        complement = np.linalg.qr(powers, mode="complete")[0][:, order + 1 :]
        return cls(complement, powers.T, half, dof)


@dataclass(frozen=True, eq=False)
class LocalPolynomialFit:
    """Fits about B bins: H (B, C), its covariance (B, C, C), infinite if H is not determined, coherence (B, C), and of
    the first ones the weights (b, 2 half + 1) of their neighbours' Y in H. own (B,): share of the input's power about
    each bin that neither a transient nor the other regressors can have, which determines H; its inverse square root is
    the condition number."""

    H: Complex
    cov: Complex
    coherence: Array
    weights: Complex
    own: Array

    @classmethod
    def empty(cls, bins: int, channels: int, neighbours: int) -> "LocalPolynomialFit":
        """Return an empty fit, to be filled batch by batch; channel by channel in memory, in the order of use."""
        return cls(
            H=np.empty((channels, bins), dtype=complex).T,
            cov=np.empty((channels, channels, bins), dtype=complex).transpose(2, 0, 1),
            coherence=np.empty((channels, bins)).T,
            weights=np.empty((min(bins, SAMPLED_BINS), neighbours), dtype=complex),
            own=np.empty(bins),
        )

    def batch(self, bins: slice) -> "LocalPolynomialFit":
        return LocalPolynomialFit(
            self.H[bins], self.cov[bins], self.coherence[bins], self.weights[bins], self.own[bins]
        )


def fitted(near: Complex, local: LocalRegression, floor: float) -> LocalPolynomialFit:
    """Return the fit about every bin: near (1 + C, 2 half + 1, B) has the transforms of input and outputs there.

    floor : power of the input over a neighbourhood below which it does not determine the response."""
    channels, points, B = len(near) - 1, near.shape[1], near.shape[2]
    found = LocalPolynomialFit.empty(B, channels, points)
    work = _work_space(local, channels, min(_filled(B), BATCH_BINS))
    for first in range(0, B, BATCH_BINS):
        batch = slice(first, first + BATCH_BINS)
        _solve(near[:, :, batch], local, floor, work, found.batch(batch))
    return found


def _filled(bins: int) -> int:
    return -(-bins // WHOLE_BINS) * WHOLE_BINS


def _work_space(local: LocalRegression, channels: int, bins: int) -> tuple[Complex, ...]:
    """Return arrays for regressors, then for outputs: whole (order + 1 + C, 2 half + 1, B), off the transient (order +
    1 + C, m, B), products of that shape, a conjugate (m, B). They serve every batch: fresh pages cost as much as the
    computation."""
    points, m = local.off_transient.shape
    number = len(local.regressors) + channels
    shapes = ((number, points, bins), (number, m, bins), (number, m, bins), (m, bins))
    return tuple(np.zeros(shape, dtype=complex) for shape in shapes)


def _solve(
    near: Complex, local: LocalRegression, floor: float, work: tuple[Complex, ...], found: LocalPolynomialFit
) -> None:
    """Solve least squares about each bin by modified Gram-Schmidt, vectorised over the bins; fills `found`.

    near : (1 + C, 2 half + 1, B) transforms about each bin. The constant of G is the last regressor, so that its
    coefficient is H at once, and its remainder after the others is the power that determines H. With the outputs as
    further columns the solution is backward stable ([BJORCK67])."""
    B, order = near.shape[2], len(local.regressors) - 1
    whole, columns, products, conjugate = (x[..., : _filled(B)] for x in work)
    whole[order + 1 :, :, :B] = near[1:]
    np.multiply(local.regressors[:, :, None], near[0], out=whole[: order + 1, :, :B])
    whole[:, :, B:] = 0.0
    np.matmul(local.off_transient.T, whole.view(float), out=columns.view(float))
    powered = np.ones(whole.shape[2], dtype=bool)
    for s in range(order + 1):
        q, rest, product = columns[s], columns[s + 1 :], products[s + 1 :]
        power, undiminished = _power(q), _power(whole[s])
        powered &= (power > DEPENDENT * undiminished) & (undiminished > floor)
        reciprocal = 1.0 / np.where(powered, power, 1.0)
        coefficient = _sum(np.multiply(rest, np.conjugate(q, out=conjugate), out=product)) * reciprocal
        rest -= np.multiply(coefficient[:, None], q, out=product)
    noise = _covariance(columns[order + 1 :], products, conjugate) / local.dof
    H = np.where(powered, coefficient, 0.0).T
    found.H[:] = H[:B]
    found.cov[:] = guarded_covariance((noise * reciprocal).transpose(2, 0, 1), powered)[:B]
    found.coherence[:] = _quality(H, noise, np.where(powered, undiminished / near.shape[1], 0.0))[:B]
    found.own[:] = np.divide(power, undiminished, out=np.zeros_like(power), where=undiminished > 0.0)[:B]
    b = len(found.weights)
    weights = (local.off_transient @ columns[order, :, :b].conj()) * reciprocal[:b]
    found.weights[:] = np.where(powered[:b], weights, 0.0).T


def _covariance(E: Complex, products: Complex, conjugate: Complex) -> Complex:
    """Return the sums (C, C, B) of E_c conj(E_d) over the rows of E (C, m, B); the rest is work space."""
    sums = np.empty((len(E), len(E), E.shape[2]), dtype=complex)
    for d in range(len(E)):
        sums[: d + 1, d] = _sum(np.multiply(E[: d + 1], np.conjugate(E[d], out=conjugate), out=products[: d + 1]))
        sums[d, : d + 1] = sums[: d + 1, d].conj()
    return sums


def _sum(x: Complex) -> Complex:
    """Return the sums (..., B) over the rows of x (..., m, B)."""
    ones = np.ones((1, x.shape[-2]))
    sums: Complex = np.matmul(ones, x.view(float)).view(complex)
    return sums[..., 0, :]


def _power(x: Complex) -> Array:
    """Return the sum (B,) of |x|^2 over the rows of x (m, B)."""
    power: Array = np.einsum("mb,mb->b", x.real, x.real) + np.einsum("mb,mb->b", x.imag, x.imag)
    return power


def _quality(H: Complex, noise: Complex, Suu: Array) -> Array:
    """Return the share (B, C) of the outputs' power that H (B, C) explains beside noise (C, C, B), with the input's
    power (B,)."""
    signal = (H.real**2 + H.imag**2) * Suu[:, None]
    total = signal + np.einsum("ccb->bc", noise).real
    return np.where(total > 0.0, signal / np.where(total > 0.0, total, 1.0), 0.0)
