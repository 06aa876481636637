"""Complex modes of a system with any damping, and its responses as a sum over them.

With K = L L^T, the energy of each coordinate is made one: q = L^-T y. Then K becomes the identity, M becomes
m = L^-1 M L^-T = U diag(1/w^2) U^T, C becomes c, and with E = diag(1/w) the states x = (y, E^-1 y' ...) obey

    (s W - I) x = -(L^-1 force, 0),      W = -[[U^T c U, E], [-E, 0]]

Eigenvalues of W are 1/pole. Written so, a coordinate without mass or without mass and damping is no exception (its
eigenvalue is zero: it follows statically), W is skew plus a negative semi-definite part, so no mode can gain energy
([TM01] on such linearisations), and the sum is exact at rest."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from checks.arrays import Array, Complex
from checks.errors import ModelError, NotHeld
from checks.model.dynamics.far_modes import is_far, sum_sections
from checks.model.structure.matrix_builder import System

FAST = 1e-9  # [s/rad] of 1/|pole|: faster than 100 MHz is at rest
AT_REST = 1e-30  # [s/rad] beside it no mode is slow; keeps immediate answers from a division by zero
NO_MASS = 1e-9  # of the largest 1/w^2: round-off of a coordinate without mass


@dataclass(frozen=True, eq=False)
class Sections:
    """H_c(s) = sum over p of residues[p, c] / (s mu[p] - 1). mu (p,) complex [s] is 1/pole, residues (p, c) in the
    channel's unit per unit of input. Of a conjugate pair only the member with Im mu < 0 (pole in the upper half) is
    kept; `paired` (p,) marks it."""

    mu: Complex
    residues: Complex
    paired: NDArray[np.bool_]

    def at(self, w: Array) -> Complex:
        """Return the response (c, F) at w (F,) [rad/s]. A pair is one real section of second order."""
        w2 = 1.0 / np.maximum(np.abs(self.mu), AT_REST) ** 2
        return sum_sections(self._numerators, self._basis, self.paired & is_far(w2, w2 * self._damping, w), w)

    def _basis(self, which: NDArray[np.bool_], w: Array) -> Complex:
        """Return the products (2, p, F) of 1, then of s, over each section: over 1 - damping s + (s / w)^2."""
        damping, inverse_w2 = self._damping[which], np.where(self.paired, np.abs(self.mu), 0.0)[which] ** 2
        real, imaginary = 1.0 - np.multiply.outer(inverse_w2, w * w), np.multiply.outer(damping, w)
        power = real**2 + imaginary**2
        basis = np.empty((2, *power.shape), dtype=complex)
        np.divide(real, power, out=basis[0].real)  # by real numbers, which is quicker than a complex division
        np.divide(imaginary, power, out=basis[0].imag)
        np.multiply(1j * w, basis[0], out=basis[1])
        return basis

    @property
    def _damping(self) -> Array:
        return np.where(self.paired, 2.0, 1.0) * self.mu.real

    @property
    def _numerators(self) -> Array:
        """Return the coefficients (c, 2, p) of 1 and s in each section's numerator."""
        weight = np.where(self.paired, 2.0, 1.0)[:, None]
        rate = np.where(self.paired, 2.0, 0.0)[:, None] * (self.residues * np.conj(self.mu)[:, None]).real
        return np.stack([-(weight * self.residues.real).T, rate.T], axis=1)


@dataclass(frozen=True, eq=False)
class Modal(Sections):
    """Responses of `channels` as such a sum."""

    channels: tuple[str, ...]
    _W: Array
    _g: Array
    _outputs: Array

    def frf(self, f: Array) -> Complex:
        """Return the response (F, c) at f (F,) [Hz]; in memory each channel lies in one piece."""
        return self.at(2.0 * np.pi * f).T

    def static(self) -> Array:
        """Return the response (c,) at rest."""
        at_rest: Array = -np.einsum("pc,p->c", self.residues.real, np.where(self.paired, 2.0, 1.0))
        return at_rest

    def poles(self) -> Complex:
        """Return the poles [rad/s], Im >= 0, by rising frequency; one per conjugate pair."""
        slow = np.abs(self.mu) > FAST
        poles = 1.0 / self.mu[slow]
        return poles[np.argsort(np.abs(poles))]

    def zeros(self, channel: str) -> Complex:
        """Return the zeros [rad/s], Im >= 0, by rising frequency, of one channel.

        With v = 1/s the response is d + c W (v - W)^-1 (-g), so the zeros in v are eigenvalues of W - g c W / (c g).
        Raises ModelError for a channel without static gain, or an unknown one."""
        c = self._outputs[self.index(channel)]
        static = float(c @ self._g)
        if static == 0.0:
            raise ModelError(f"channel '{channel}' has no static gain: its zeros are not computed")
        v = np.linalg.eigvals(self._W - np.outer(self._g, c @ self._W) / static)
        v = v[(np.abs(v) > FAST) & (v.imag <= 0.0)]
        zeros = 1.0 / v
        rising: Complex = zeros[np.argsort(np.abs(zeros))]
        return rising

    def index(self, channel: str) -> int:
        if channel not in self.channels:
            raise ModelError(f"no channel '{channel}' (has: {', '.join(self.channels)})")
        return self.channels.index(channel)


@dataclass(frozen=True, eq=False)
class Eigen:
    """Eigenvalues mu (2n,) and vectors V (2n, 2n) of W, shapes T (n, n) of q = T y; weights (2n, 1 + c): share of each
    vector in a force of one newton, and in a force along each row of the outputs."""

    W: Array
    T: Array
    mu: Complex
    V: Complex
    weights: Complex


@lru_cache(maxsize=8)
def eigen(system: System) -> Eigen:
    """Return the first-order form of a system, solved. Raises ModelError if its stiffness is not positive definite, or
    if values so large that the matrices overflow leave it without modes."""
    W, T = energy_form(system)
    try:
        mu, V = (np.asarray(x, dtype=complex) for x in np.linalg.eig(W))  # real if all of them are
    except np.linalg.LinAlgError as e:
        raise ModelError(f"no modes can be found with such values ({e}); expected values of a strut") from e
    pushed = np.zeros((len(W), 1 + len(system.outputs)), dtype=complex)
    pushed[: len(T)] = -T.T @ np.column_stack([system.force, system.outputs.T])
    return Eigen(W, T, mu, V, np.linalg.solve(V, pushed))


def modal(system: System) -> Modal:
    """Return the complex modes of a system. Raises ModelError if its stiffness is not positive definite."""
    form = eigen(system)
    n = len(form.T)
    g = np.concatenate([-form.T.T @ system.force, np.zeros(n)])
    outputs = np.hstack([system.outputs @ form.T, np.zeros((len(system.channels), n))])
    residues = form.weights[:, :1] * (outputs @ form.V).T
    kept = form.mu.imag <= 0.0
    mu = form.mu[kept]
    return Modal(mu, residues[kept], mu.imag < 0.0, system.channels, form.W, g, outputs)


def energy_form(system: System) -> tuple[Array, Array]:
    """Return W (2n, 2n) and the shapes T (n, n) of q = T y, with T^T K T = 1 and T^T M T = diag(1/w^2)."""
    try:
        m, T = linalg.eigh(system.M, system.K, driver="gvd", check_finite=False)
    except linalg.LinAlgError as e:
        raise NotHeld(float(np.linalg.eigvalsh(system.K)[0])) from e
    if m[0] < -NO_MASS * m[-1]:
        raise ModelError(f"the assembly's mass is not positive: {m[0]:.3g} s2 beside {m[-1]:.3g} s2 (1 / w^2)")
    root = np.sqrt(np.maximum(m, 0.0))  # round-off of a coordinate without mass
    n = len(root)
    W = np.zeros((2 * n, 2 * n))
    W[:n, :n] = -T.T @ system.C @ T
    W[np.arange(n), n + np.arange(n)] = -root
    W[n + np.arange(n), np.arange(n)] = root
    return W, T


def direct_frf(system: System, f: Array) -> Complex:
    """Return the response (F, c) at f (F,) [Hz] by solving the matrices at each frequency: slow, for tests."""
    H = np.empty((f.size, len(system.channels)), dtype=complex)
    for i, w in enumerate(2.0 * np.pi * f):
        H[i] = system.outputs @ np.linalg.solve(system.K + 1j * w * system.C - w * w * system.M, system.force)
    return H
