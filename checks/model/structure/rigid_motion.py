"""Small rigid motions: the motion of a point of a rigid body from that of another."""

import numpy as np
from numpy.typing import ArrayLike

from checks.arrays import Array


def lever(r: ArrayLike) -> Array:
    """Return the motion (6, 6) ux uy uz rx ry rz of a point at r (3,) [m] from a node, per its own: u + theta x r."""
    x, y, z = np.asarray(r, dtype=float)
    T = np.eye(6)
    T[0, 4], T[0, 5], T[1, 5] = z, -y, x
    T[1, 3], T[2, 3], T[2, 4] = -z, y, -x
    return T


def rigid_motions(xyz: Array, size: int) -> Array:
    """Return the six rigid motions (size, 6) of a superelement about the origin; its modal dofs rest."""
    R = np.zeros((size, 6))
    for i, r in enumerate(xyz):
        R[6 * i : 6 * i + 6] = lever(r)
    return R
