"""Timoshenko beams of rectangular section in space: element matrices, rigid end offsets, assembly."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.errors import ModelError
from checks.model.structure.rigid_motion import lever
from checks.model.structure.superelement import DOFS

SHEAR_FACTOR = 5.0 / 6.0  # rectangle (Cowper 1966, without the small influence of Poisson's ratio)
_GAUSS_X, _GAUSS_W = (0.5 * (np.polynomial.legendre.leggauss(4)[0] + 1.0), 0.5 * np.polynomial.legendre.leggauss(4)[1])


@dataclass(frozen=True)
class Material:
    """Isotropic: Young's modulus E [Pa], Poisson's ratio nu, density rho [kg/m3]."""

    E: float
    nu: float
    rho: float

    @property
    def G(self) -> float:
        """Return the shear modulus [Pa]."""
        return self.E / (2.0 * (1.0 + self.nu))


@dataclass(frozen=True, eq=False)
class Beams:
    """n straight elements of one material in the x-z plane. A section is `width` along y and `height` across it.

    ends (n, 2) node numbers; axis (n, 3) from the first elastic end to the second [m]; width, height (n,) [m];
    offset (n, 2, 3) from each node to the elastic end, rigid [m]."""

    material: Material
    ends: NDArray[np.int64]
    axis: Array
    width: Array
    height: Array
    offset: Array


def torsion_constant(width: Array, height: Array) -> Array:
    """Return St Venant's torsion constant [m4] of a rectangle ([ROARK02] table 10.1, case 4; within 0.5 %)."""
    a, b = np.maximum(width, height), np.minimum(width, height)
    constant: Array = a * b**3 * (1.0 / 3.0 - 0.21 * (b / a) * (1.0 - (b / a) ** 4 / 12.0))
    return constant


def _shapes(length: Array, phi: Array) -> tuple[Array, Array, Array]:
    """Return deflection N, rotation T and slope dT/dx at the Gauss points, for (w1, t1, w2, t2): (n, 4, points) each.

    Exact static shapes of the Timoshenko beam; phi = 12 EI / (GA' L^2) ([FK93] eq. 14-17)."""
    s, L, p = _GAUSS_X[None, :], length[:, None], phi[:, None]
    c = 1.0 / (1.0 + p)
    one = np.ones_like(s)
    N = (
        c * (1 - 3 * s**2 + 2 * s**3 + p * (1 - s)),
        c * L * (s - 2 * s**2 + s**3 + 0.5 * p * (s - s**2)),
        c * (3 * s**2 - 2 * s**3 + p * s),
        c * L * (-(s**2) + s**3 - 0.5 * p * (s - s**2)),
    )
    T = (
        6 * c / L * (s**2 - s),
        c * (1 - 4 * s + 3 * s**2 + p * (1 - s)),
        6 * c / L * (s - s**2),
        c * (3 * s**2 - 2 * s + p * s),
    )
    slope = (
        6 * c / L**2 * (2 * s - 1),
        c / L * (6 * s - 4 - p),
        6 * c / L**2 * (1 - 2 * s),
        c / L * (6 * s - 2 + p) * one,
    )
    return np.stack(N, 1), np.stack(T, 1), np.stack(slope, 1)


def bending(length: Array, EI: Array, GA: Array, rho_A: Array, rho_I: Array) -> tuple[Array, Array]:
    """Return the stiffness and consistent mass (n, 4, 4) of bending in one plane.

    The dofs are (w1, t1, w2, t2), deflection and rotation; t is dw/dx if there is no shear.
    EI [N m2], GA = kappa G A [N], rho_A [kg/m], rho_I [kg m] rotary inertia per length."""
    phi = 12.0 * EI / (GA * length**2)
    N, T, slope = _shapes(length, phi)
    # The shear strain dw/dx - t of these shapes is constant along the element: phi / (1 + phi) times the chord's share.
    shear = (phi / (1.0 + phi))[:, None] * np.stack(
        [-1 / length, -0.5 * np.ones_like(length), 1 / length, -0.5 * np.ones_like(length)], 1
    )
    weight = _GAUSS_W * length[:, None]
    K = np.einsum("n,ng,nig,njg->nij", EI, weight, slope, slope)
    K += (GA * length)[:, None, None] * shear[:, :, None] * shear[:, None, :]
    M = np.einsum("n,ng,nig,njg->nij", rho_A, weight, N, N) + np.einsum("n,ng,nig,njg->nij", rho_I, weight, T, T)
    return K, M


def _put(target: Array, block: Array, dofs: tuple[int, ...], signs: tuple[float, ...]) -> None:
    sign = np.asarray(signs)
    target[:, np.asarray(dofs)[:, None], np.asarray(dofs)] += block * sign[:, None] * sign


def local_matrices(beams: Beams) -> tuple[Array, Array]:
    """Return K, M (n, 12, 12) along each element's own axes: x along it, y the frame's y, z across both."""
    mat, b, h = beams.material, beams.width, beams.height
    L, A = np.linalg.norm(beams.axis, axis=1), b * h
    if not (np.isfinite(L).all() and (L > 0).all() and (A > 0).all()):
        raise ModelError(f"a beam needs positive length and section, got lengths {L} m and areas {A} m2")
    Iy, Iz, GA = b * h**3 / 12, h * b**3 / 12, SHEAR_FACTOR * mat.G * A
    K, M = np.zeros((len(L), 12, 12)), np.zeros((len(L), 12, 12))
    pull, drag = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    for dofs, stiffness, mass in (
        ((0, 6), mat.E * A / L, mat.rho * A * L),
        ((3, 9), mat.G * torsion_constant(b, h) / L, mat.rho * (Iy + Iz) * L),
    ):
        _put(K, stiffness[:, None, None] * pull, dofs, (1, 1))
        _put(M, mass[:, None, None] * drag, dofs, (1, 1))
    for plane, signs, inertia in (((1, 5, 7, 11), (1, 1, 1, 1), Iz), ((2, 4, 8, 10), (1, -1, 1, -1), Iy)):
        k, m = bending(L, mat.E * inertia, GA, mat.rho * A, mat.rho * inertia)  # in the x-z plane dw/dx is -ry
        _put(K, k, plane, signs)
        _put(M, m, plane, signs)
    return K, M


def _to_local(beams: Beams) -> Array:
    """Return the matrices (n, 12, 12) from the motion of the two nodes to that of the elastic ends in local axes."""
    ex = beams.axis / np.linalg.norm(beams.axis, axis=1)[:, None]
    if np.abs(ex[:, 1]).max() > 1e-9:
        raise ModelError("a beam of the frame must lie in the x-z plane, as its section is given along y")
    ey = np.broadcast_to([0.0, 1.0, 0.0], ex.shape)
    turn = np.stack([ex, ey, np.cross(ex, ey)], 1)
    T = np.zeros((len(ex), 12, 12))
    for end in (0, 1):
        arm = np.array([lever(r) for r in beams.offset[:, end]])
        for half in (0, 3):
            row = 6 * end + half
            T[:, row : row + 3, 6 * end : 6 * end + 6] = turn @ arm[:, half : half + 3, :]
    return T


def add_beams(K: Array, M: Array, beams: Beams) -> None:
    """Add the elements to the global K, M (6 dofs per node), in place."""
    k, m = local_matrices(beams)
    T = _to_local(beams)
    dofs = (DOFS * beams.ends[:, :, None] + np.arange(DOFS)).reshape(len(T), 12)
    where = (dofs[:, :, None], dofs[:, None, :])
    np.add.at(K, where, np.swapaxes(T, 1, 2) @ k @ T)
    np.add.at(M, where, np.swapaxes(T, 1, 2) @ m @ T)


def add_body(M: Array, node: int, mass: float, inertia: Array, offset: Array) -> None:
    """Add a rigid body held by a node to the global M, in place.

    mass [kg]; inertia (3,) [kg m2] about its centre; offset (3,) [m] of the centre from the node."""
    T = lever(offset)
    body = np.diag(np.concatenate([np.full(3, mass), np.asarray(inertia, dtype=float)]))
    here = slice(DOFS * node, DOFS * node + DOFS)
    M[here, here] += T.T @ body @ T
