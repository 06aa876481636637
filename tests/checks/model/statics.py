"""Figures of a superelement that can be compared with a data sheet: modes, stiffnesses, amplification."""

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from checks.arrays import Array
from checks.model.structure.superelement import Superelement


def clamped_modes_Hz(s: Superelement, node: int) -> Array:
    """Natural frequencies [Hz], rising, with one interface node held."""
    free = _free(s, node)
    return np.sqrt(linalg.eigvalsh(s.K[np.ix_(free, free)], s.M[np.ix_(free, free)])) / (2 * np.pi)


def end_stiffness(s: Superelement, held: int, moved: int) -> Array:
    """(6, 6) static stiffness [N/m, N, N m/rad] of one interface node with another held, the rest following freely."""
    inside = np.setdiff1d(_free(s, held), np.arange(s.size)[s.dofs(moved)])
    K = s.K[s.dofs(moved), s.dofs(moved)]
    if not inside.size:
        return K
    coupling = s.K[s.dofs(moved)][:, inside]
    return K - coupling @ linalg.solve(s.K[np.ix_(inside, inside)], coupling.T, assume_a="sym")


def end_compliance(s: Superelement, held: int, moved: int) -> Array:
    """(6, 6) static motion of one interface node per force and moment on it, with another held."""
    return np.asarray(np.linalg.inv(end_stiffness(s, held, moved)), dtype=np.float64)


def amplification(s: Superelement, stack: tuple[int, int]) -> float:
    """Motion of the top along z per elongation of a stack, when that stack pushes and the bottom is held."""
    free, pair = _free(s, s.nodes.bottom), s.elongation(stack)
    u = np.zeros(s.size)
    u[free] = linalg.solve(s.K[np.ix_(free, free)], pair[free], assume_a="sym")
    return float(u[s.dofs(s.nodes.top)][2] / (pair @ u))


def _free(s: Superelement, held: int) -> NDArray[np.intp]:
    """Dofs that are left when a node is held."""
    return np.setdiff1d(np.arange(s.size), np.arange(s.size)[s.dofs(held)])
