"""Small rigid motions: what one point of a rigid body does when another point of it moves."""

import numpy as np
from numpy.typing import ArrayLike

from checks.arrays import Array


def lever(r: ArrayLike) -> Array:
    """(6, 6) motion ux uy uz rx ry rz of the point at r (3,) [m] from a node, per motion of the node: u + theta x r."""
    x, y, z = np.asarray(r, dtype=float)
    T = np.eye(6)
    T[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return T


def rigid_motions(xyz: Array, size: int) -> Array:
    """(size, 6) the six rigid motions of a superelement about the origin; its internal modal dofs stay at rest."""
    R = np.zeros((size, 6))
    for i, r in enumerate(xyz):
        R[6 * i : 6 * i + 6] = lever(r)
    return R
