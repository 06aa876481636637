"""Derivatives of a system's responses by the parameters of its matrices, all at the cost of a single response.

Any damping, by the adjoint method: y = c Z^-1 b with Z = K + s C + s^2 M symmetric, so dy = dc x + y' db - y' dZ x, x =
Z^-1 b, y = Z^-1 c' ([HG92] 7.2); x and y are sums over the complex modes.

Damping of each mode by itself: the response is a sum of a b / (w^2 + c s + s^2) over real modes P of unit mass, and
dP_i = sum_j P_j (P_j' (dK - w_i^2 dM) P_i) / (w_i^2 - w_j^2) - P_i (P_i' dM P_i) / 2 ([FK68]) gives the derivative of
every part."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex, between_zeros
from checks.model.dynamics.complex_modes import Sections, eigen
from checks.model.dynamics.far_modes import is_far, product, sum_sections
from checks.model.dynamics.real_modes import real_modes
from checks.model.dynamics.receptances import receptances
from checks.model.structure.assemble import FastenedParts
from checks.model.structure.matrix_builder import System

ROUNDING = 1e-15  # of the largest entry of the matrix: smaller differences are rounding
SAME = 1e-11  # of w^2: modes no further apart are one, whose shapes do not turn into each other


@dataclass(frozen=True, eq=False)
class SymmetricBlock:
    """A symmetric matrix that is zero except in some rows and columns."""

    rows: NDArray[np.intp]
    entries: Array

    def congruent(self, P: Array) -> Array:
        """Return P' A P (p, p) for P (.., p)."""
        part = P[self.rows]
        return np.asarray(part.T @ self.entries @ part)


@dataclass(frozen=True, eq=False)
class Change:
    """The change of M, C, K (None if zero), force (r,) and outputs (c, r) per unit of a parameter, in the coordinates
    of `reached`: the motions that parts are fastened to, then the coordinates."""

    M: SymmetricBlock | None
    C: SymmetricBlock | None
    K: SymmetricBlock | None
    force: Array
    outputs: Array


Shapes = TypeVar("Shapes", Array, Complex)


def reached(system: System, P: Shapes) -> Shapes:
    """Return the motions that parts are fastened to in the shapes P (n, p), then the shapes themselves, (r, p)."""
    return P if system.motions is None else np.concatenate([system.motions @ P, P])


def change_of_system(above: System, below: System, h: float) -> Change:
    """Return the central difference of a system over -h..h, exact but for rounding if the matrices are proportional to
    the parameter or its square. Both systems must be in the same coordinates."""
    m = 0 if above.motions is None else len(above.motions)
    return _change(above, below, _slope(above.force, below.force, h), h, (m, 0))


def change_of_fastened(above: FastenedParts, below: FastenedParts, h: float, size: int) -> Change:
    """Return the same if only the parts fastened to the APA differ. size: number of coordinates of the system."""
    return _change(above, below, np.zeros(len(above.K)), h, (0, size))


def _change(
    above: System | FastenedParts, below: System | FastenedParts, force: Array, h: float, beside: tuple[int, int]
) -> Change:
    """Return the change of a system from that of its matrices; beside: numbers of the reached coordinates before and
    behind those that both read."""
    M, C, K = (_block(_slope(getattr(above, key), getattr(below, key), h), beside[0]) for key in "MCK")
    outputs = _slope(above.outputs, below.outputs, h)
    return Change(M, C, K, between_zeros(force, *beside), between_zeros(outputs, *beside))


def _slope(above: Array, below: Array, h: float) -> Array:
    significant = np.abs(above - below) > ROUNDING * np.abs(above).max()
    return np.where(significant, (above - below) / (2.0 * h), 0.0)


def _block(D: Array, first: int) -> SymmetricBlock | None:
    """Return the nonzero rows and columns of D, or None; first: place of its first row among those reached."""
    rows = np.flatnonzero(D.any(axis=0))
    return SymmetricBlock(first + rows, D[np.ix_(rows, rows)]) if rows.size else None


@dataclass(frozen=True, eq=False)
class Modes:
    """The effect of factors on a body's free modes: rows (m, n) read the motion of each mode; stiffness, damping (m,)
    of each, per unit of its factor. The change is of rank one."""

    rows: Array
    stiffness: Array
    damping: Array


NO_MODES = Modes(np.zeros((0, 0)), np.zeros(0), np.zeros(0))


def derivatives(
    system: System, changes: Sequence[Change], s: Complex, modes: Modes = NO_MODES, kept: Sequence[int] | None = None
) -> Complex:
    """Return the derivatives (P + 2 m, S, c) of the responses at s (S,) [rad/s], with damping of any form: by the
    changes, then by the factors on the modes' stiffness, then by those on their damping; kept: indices of the
    derivatives to return, in this order.

    In memory the channels come before the frequencies, along which later steps run."""
    x, y = _states(system, s)
    by_change = _by_changes(changes, s, x, y)
    first = len(x) - len(system.K)  # of the coordinates
    of_modes = (_by_modes(modes, s, x[first:], y[:, first:]),) if modes.stiffness.size else ()
    found = np.concatenate([by_change, *of_modes])
    return (found if kept is None else found[list(kept)]).swapaxes(1, 2)


def _states(system: System, s: Complex) -> tuple[Complex, Complex]:
    """Return `reached` (r, S) of the coordinates under a newton, and (c, r, S) under forces along each output row."""
    by_parts = receptances(system, s.imag[1:]) if s.size > 1 and s[0] == 0.0 else None
    if by_parts is not None:
        x, *y = by_parts.reached(s.imag)
        return x, np.array(y)
    form = eigen(system)
    kept = form.mu.imag <= 0.0
    shapes, mu = reached(system, form.T @ form.V[: len(form.T)]).T[kept], form.mu[kept]
    residues = (form.weights[kept][:, :, None] * shapes[:, None]).reshape(len(mu), -1)
    x, *y = Sections(mu, residues, mu.imag < 0.0).at(s.imag).reshape(-1, shapes.shape[1], s.size)
    return x, np.array(y)


def _by_modes(modes: Modes, s: Complex, x: Complex, y: Complex) -> Complex:
    """Return the derivatives (2 m, c, S) by the modes' factors: products of its motions under both forces."""
    both = -product(modes.rows, x)[:, None] * product(modes.rows, y).swapaxes(0, 1)
    return np.concatenate([both * modes.stiffness[:, None, None], both * np.multiply.outer(modes.damping, s)[:, None]])


def _by_changes(changes: Sequence[Change], s: Complex, x: Complex, y: Complex) -> Complex:
    """Return the derivatives (P, c, S) by the changes."""
    out = np.array([d.outputs @ x for d in changes]).reshape(len(changes), len(y), s.size)
    for each, d in zip(out, changes, strict=True):
        if d.force.any():
            each += d.force @ y
        for power, block in ((0, d.K), (1, d.C), (2, d.M)):
            if block is not None:
                load = product(block.entries, x[block.rows]) * s**power
                each -= np.einsum("rs,crs->cs", load, y[:, block.rows])
    return out


def modal_derivatives(
    system: System, changes: Sequence[Change], s: Complex, modes: Modes = NO_MODES, kept: Sequence[int] | None = None
) -> Complex:
    """Return the same derivatives if each real mode is damped by itself."""
    w2, P = real_modes(system)
    C, R = P.T @ system.C @ P, reached(system, P)
    force, outputs = P.T @ system.force, system.outputs @ P
    apart = w2 - w2[:, None]  # [j, i]: w_i^2 - w_j^2
    apart[np.abs(apart) <= SAME * w2] = np.inf
    residue = force * outputs  # (c, n)
    of_each = []
    for d in changes:
        turn, dw2 = _turn(d, R, w2, apart)
        rate = 2.0 * np.einsum("ji,ji->i", turn, C) + _diagonal(d.C, R)
        dforce = turn.T @ force + R.T @ d.force
        doutputs = outputs @ turn + d.outputs @ R
        of_each.append((dforce * outputs + force * doutputs, residue * dw2, residue * rate))
    A = np.array(of_each).reshape(-1, 3, *residue.shape)
    if modes.stiffness.size:
        A = np.concatenate([A, np.stack(_of_modes(modes, P, C, force, outputs, apart), axis=1)])
    A = np.swapaxes(A if kept is None else A[list(kept)], 1, 2)  # (P, c, 3, n)
    rate, A = np.diag(C), A.reshape(len(A) * len(outputs), 3, w2.size)

    def basis(which: NDArray[np.bool_], w: Array) -> Complex:
        """Return (3, n, S): p = 1 / (w2 + rate s + s^2) itself, -p^2 and -s p^2."""
        poles = 1.0 / (w2[which][:, None] + np.multiply.outer(rate[which], 1j * w) - w * w)
        squares = -poles * poles
        return np.array([poles, squares, 1j * w * squares])

    H = sum_sections(A, basis, is_far(w2, rate, s.imag), s.imag)
    return H.reshape(len(A) // len(outputs), len(outputs), s.size).swapaxes(1, 2)


def square_slopes(system: System, changes: Sequence[Change], modes: Modes = NO_MODES) -> tuple[Array, Array]:
    """Return the squared frequencies (n,) [rad2/s2] of the real modes, and their derivatives (P + 2 m, n) by the
    changes, by the factors on the modes' stiffness, and by those on their damping (none). Raises ModelError as
    `real_modes` does."""
    w2, P = real_modes(system)
    R = reached(system, P)
    own = [_diagonal(d.K, R) - w2 * _diagonal(d.M, R) for d in changes]
    of_factors = (modes.rows @ P) ** 2 * modes.stiffness[:, None] if modes.stiffness.size else np.zeros((0, w2.size))
    return w2, np.concatenate([np.reshape(own, (-1, w2.size)), of_factors, np.zeros_like(of_factors)])


def _of_modes(
    modes: Modes, P: Array, C: Array, force: Array, outputs: Array, apart: Array
) -> tuple[Array, Array, Array]:
    """Return the derivatives (2 m, c, n) of residues, of squared frequencies and of rates of damping."""
    p = modes.rows @ P  # (m, n)
    own, closeness = p * modes.stiffness[:, None], 1.0 / apart
    np.fill_diagonal(closeness, 0.0)
    dforce = own * ((p * force) @ closeness)
    doutputs = own[:, None] * ((p[:, None] * outputs) @ closeness)  # (m, c, n)
    residue = force * outputs
    stiffness = dforce[:, None] * outputs + force * doutputs
    rate = 2.0 * own * (p @ (closeness * C))
    nothing = np.zeros_like(stiffness)
    damped = residue * (p * p * modes.damping[:, None])[:, None]
    return (
        np.concatenate([stiffness, nothing]),
        np.concatenate([residue * (own * p)[:, None], nothing]),
        np.concatenate([residue * rate[:, None], damped]),
    )


def _turn(d: Change, R: Array, w2: Array, apart: Array) -> tuple[Array, Array]:
    """Return the share [j, i] (n, n) of shape j in the derivative of shape i, and (n,) derivatives of the squared
    frequencies. R (r, n): what is `reached` of the shapes."""
    nothing = np.zeros((w2.size, 1))
    K = d.K.congruent(R) if d.K else nothing
    M = d.M.congruent(R) if d.M else nothing
    both = K - w2 * M
    dw2 = np.diag(np.broadcast_to(both, apart.shape)).copy()
    turn = both / apart
    np.fill_diagonal(turn, -0.5 * np.diag(M) if d.M else 0.0)
    return turn, dw2


def _diagonal(block: SymmetricBlock | None, R: Array) -> Array:
    """Return the diagonal (n,) of R' A R."""
    if block is None:
        return np.zeros(R.shape[1])
    part = R[block.rows]
    diagonal: Array = np.einsum("ri,ri->i", part, block.entries @ part)
    return diagonal
