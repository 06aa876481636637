"""Check that a pair of matrices is the mass and stiffness of a free body; the error names the value."""

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError
from checks.model.structure.rigid_motion import rigid_motions
from checks.model.structure.superelement import DOFS, Superelement

ASYMMETRY = 1e-6  # of the largest entry; Ansys prints 8 digits or more
INDEFINITE = 1e-6  # most negative eigenvalue of the unit-diagonal matrix; Ansys exports leave some 1e-9
SAME_MASS = 1e-6  # a body has one mass, whatever the direction it is pushed in
RIGID = 1e-4  # of the highest frequency: modes below are rigid (the APA300ML: 3e-6, and 6e-3 elastic)
FREE = 1e-3  # force left by a rigid motion, of the sum of the forces that cancel; rounded exports leave 1e-4


def check_superelement(s: Superelement) -> Superelement:
    """Return the same superelement if it is sound: finite, symmetric, M > 0, K >= 0 with exactly the six rigid motions
    free. Raises ModelError naming the file, the matrix and the value."""
    _shapes(s)
    for label, matrix in (("K", s.K), ("M", s.M)):
        _symmetric(s.name, label, matrix)
    _definite(s.name, "M", s.M, floor=0.0)
    _definite(s.name, "K", s.K, floor=-INDEFINITE)
    _six_rigid_modes(s)
    _check_equal_mass(s)
    return s


def mass(s: Superelement) -> float:
    """Return the mass of the body [kg]."""
    return float(rigid_motions(s.xyz, s.size)[:, 2] @ s.M @ rigid_motions(s.xyz, s.size)[:, 2])


def _shapes(s: Superelement) -> None:
    n, p = s.size, len(s.xyz)
    if s.K.shape != (n, n) or s.M.shape != (n, n):
        raise ModelError(f"{s.name}: K is {s.K.shape} and M is {s.M.shape}; expected two square matrices of one size")
    if s.xyz.shape != (p, 3) or n < DOFS * p:
        raise ModelError(f"{s.name}: {s.xyz.shape} node coordinates ask for {DOFS * p} dofs or more, K has {n}")
    used = (s.nodes.bottom, s.nodes.top, *s.nodes.sensor, *s.nodes.actuator)
    if min(used) < 0 or max(used) >= p:
        raise ModelError(f"{s.name}: node {max(used) + 1} is named but there are {p} (counted from 1)")
    for label, (a, b) in (
        ("bottom and top", (s.nodes.bottom, s.nodes.top)),
        ("the sensor stack's", s.nodes.sensor),
        ("the actuator stack's", s.nodes.actuator),
    ):
        if np.array_equal(s.xyz[a], s.xyz[b]):
            raise ModelError(f"{s.name}: {label} nodes {a + 1} and {b + 1} are at the same place {s.xyz[a]}")


def _symmetric(name: str, label: str, matrix: Array) -> None:
    if not np.isfinite(matrix).all():
        i, j = np.argwhere(~np.isfinite(matrix))[0]
        raise ModelError(f"{name}: {label}[{i}, {j}] is {matrix[i, j]}")
    gap = np.abs(matrix - matrix.T)
    i, j = np.unravel_index(np.argmax(gap), gap.shape)
    if gap[i, j] > ASYMMETRY * np.abs(matrix).max():
        a, b = matrix[i, j], matrix[j, i]
        raise ModelError(
            f"{name}: {label} is not symmetric: {label}[{i}, {j}] is {a:.6g}, {label}[{j}, {i}] is {b:.6g}"
        )


def _definite(name: str, label: str, matrix: Array, floor: float) -> None:
    """Raise ModelError if a matrix is not positive (semi-)definite, scaled to a unit diagonal: newtons per metre and
    newton metres per radian must not be compared."""
    diagonal = np.diag(matrix)
    if diagonal.min() <= 0:
        i = int(np.argmin(diagonal))
        raise ModelError(f"{name}: {label}[{i}, {i}] is {diagonal[i]:.6g}, expected a positive value")
    scale = 1.0 / np.sqrt(diagonal)
    lowest = float(linalg.eigvalsh(matrix * np.outer(scale, scale), subset_by_index=[0, 0])[0])
    if lowest <= floor:
        kind = "positive definite" if floor == 0.0 else "positive semi-definite"
        raise ModelError(f"{name}: {label} is not {kind}: lowest eigenvalue {lowest:.3g} (unit diagonal)")


def _six_rigid_modes(s: Superelement) -> None:
    f = np.sqrt(np.abs(linalg.eigvalsh(s.K, s.M))) / (2 * np.pi)
    f.sort()
    rigid = int(np.sum(f < RIGID * f[-1]))
    if rigid != DOFS:
        shown = ", ".join(f"{x:.4g}" for x in f[:8])
        raise ModelError(f"{s.name}: {rigid} rigid modes, expected six; lowest frequencies {shown} Hz")
    R = rigid_motions(s.xyz, s.size)
    left = np.abs(s.K @ R).max(axis=0) / (np.abs(s.K) @ np.abs(R)).max(axis=0)
    if left.max() > FREE:
        motion = ("x", "y", "z", "rx", "ry", "rz")[int(np.argmax(left))]
        raise ModelError(
            f"{s.name}: a rigid motion in {motion} leaves {left.max():.3g} of the elastic force, expected 0"
        )


def _check_equal_mass(s: Superelement) -> None:
    R = rigid_motions(s.xyz, s.size)[:, :3]
    m = np.einsum("ni,nm,mi->i", R, s.M, R)
    if np.ptp(m) > SAME_MASS * m.max():
        raise ModelError(f"{s.name}: mass along x y z is {m[0]:.6g} {m[1]:.6g} {m[2]:.6g} kg, expected one value")
