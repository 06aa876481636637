"""Beams for struts that are no frame: straight Timoshenko elements of two nodes with six motions each (u, theta), from
their section's stiffness. Cubic shapes for the mass, with the section's rotary inertia."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Section:
    """EA [N], EI [N m2], GJ [N m2], GA [N] (with its shear factor); mass per length [kg/m], and that of inertia against
    bending [kg m]. EI and inertia are those of bending in the beam's x-z plane; EI_y, inertia_y of bending in its y-z
    plane, if that differs."""

    EA: float
    EI: float
    GJ: float
    GA: float
    mass: float = 0.0
    inertia: float = 0.0
    EI_y: float | None = None
    inertia_y: float | None = None

    @classmethod
    def rectangle(cls, E: float, poisson: float, density: float, width: float, height: float) -> "Section":
        """Return the section of a bar of width along its y and height along its x [m], by Saint-Venant's torsion
        ([ROARK02] table 10.1) and the shear factor 5/6."""
        area, G = width * height, E / (2 * (1 + poisson))
        a, b = max(width, height), min(width, height)
        J = a * b**3 * (1 / 3 - 0.21 * (b / a) * (1 - (b / a) ** 4 / 12))
        second, second_y = width * height**3 / 12, height * width**3 / 12
        return cls(
            EA=E * area,
            EI=E * second,
            GJ=G * J,
            GA=G * area * 5 / 6,
            mass=density * area,
            inertia=density * second,
            EI_y=E * second_y,
            inertia_y=density * second_y,
        )


def element(section: Section, length: float) -> tuple[Array, Array]:
    """Return K, M (12, 12) of a beam along its own z; motions of each node: ux, uy, uz, thx, thy, thz."""
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    ends = np.array([[1.0, -1.0], [-1.0, 1.0]])
    shares = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
    K[np.ix_([2, 8], [2, 8])] += section.EA / length * ends
    M[np.ix_([2, 8], [2, 8])] += section.mass * length * shares
    K[np.ix_([5, 11], [5, 11])] += section.GJ / length * ends
    in_y = (_or(section.EI_y, section.EI), _or(section.inertia_y, section.inertia))
    M[np.ix_([5, 11], [5, 11])] += (section.inertia + in_y[1]) * length * shares
    planes = (((0, 4), 1.0, section), ((1, 3), -1.0, replace(section, EI=in_y[0], inertia=in_y[1])))
    for (u, theta), turn, bent in planes:  # dux/dz = thy, duy/dz = -thx
        bending, moving = _in_a_plane(bent, length)
        at, sign = [u, theta, u + 6, theta + 6], np.array([1.0, turn, 1.0, turn])
        K[np.ix_(at, at)] += bending * np.outer(sign, sign)
        M[np.ix_(at, at)] += moving * np.outer(sign, sign)
    return K, M


def _or(value: float | None, other: float) -> float:
    return other if value is None else value


def _in_a_plane(section: Section, L: float) -> tuple[Array, Array]:
    """Return K, M (4, 4) of bending: motion and slope at either end."""
    shear = 12 * section.EI / (section.GA * L**2)
    a, b = (4 + shear) * L**2, (2 - shear) * L**2
    K = np.array([[12, 6 * L, -12, 6 * L], [6 * L, a, -6 * L, b], [-12, -6 * L, 12, -6 * L], [6 * L, b, -6 * L, a]])
    M = np.array(
        [
            [156, 22 * L, 54, -13 * L],
            [22 * L, 4 * L**2, 13 * L, -3 * L**2],
            [54, 13 * L, 156, -22 * L],
            [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
        ]
    )
    R = np.array(
        [
            [36, 3 * L, -36, 3 * L],
            [3 * L, 4 * L**2, -3 * L, -(L**2)],
            [-36, -3 * L, 36, -3 * L],
            [3 * L, -(L**2), -3 * L, 4 * L**2],
        ]
    )
    bending = section.EI / ((1 + shear) * L**3) * K
    return bending, section.mass * L / 420 * M + section.inertia / (30 * L) * R


def between(section: Section, start: Array, end: Array) -> tuple[Array, Array]:
    """Return K, M (12, 12) of the beam from one point (3,) to another, in the axes of the points."""
    along = np.asarray(end, dtype=float) - start
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross([0.0, 1.0, 0.0], z) if abs(z[1]) < 0.9 else np.cross([1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    T = np.kron(np.eye(4), np.stack([x, np.cross(z, x), z]))
    K, M = element(section, length)
    return T.T @ K @ T, T.T @ M @ T


def chain(sections: Sequence[Section], points: Sequence[Array]) -> tuple[Array, Array]:
    """Return K, M of beams from point to point, six motions of each point in order; one section for each beam."""
    size = 6 * len(points)
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for k, section in enumerate(sections):
        at = slice(6 * k, 6 * k + 12)
        one = between(section, points[k], points[k + 1])
        K[at, at] += one[0]
        M[at, at] += one[1]
    return K, M
