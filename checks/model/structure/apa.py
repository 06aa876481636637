"""The APA as a body that can be built in: its matrices and the rows that read its ends and its stacks."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.model.structure.superelement import Superelement

ELASTIC_FROM = 6  # a free body has six rigid modes; they are not damped


@dataclass(frozen=True, eq=False)
class ApaBody:
    """Matrices of the APA in its own n coordinates.

    K, M (n, n); C_ratio (n, n) damping per unit of modal damping ratio; C (n, n) viscous damping of its own. bottom,
    top : (6, n) rows that read the motion ux uy uz rx ry rz of the two interfaces. sensor, actuator : (n,) rows that
    read the elongation [m] of the sensor stack and of the actuator stacks; by virtual work the same rows spread a pair
    of forces on them. k_sensor, k_actuator : stiffness across the stacks [N/m], the reference of open-circuit
    stiffening. height : distance [m] of the two interfaces. modal : the coordinates are free modes of unit modal mass,
    damped each by itself."""

    K: Array
    M: Array
    C_ratio: Array
    C: Array
    bottom: Array
    top: Array
    sensor: Array
    actuator: Array
    k_sensor: float
    k_actuator: float
    height: float
    name: str = "apa"
    modal: bool = False

    @property
    def size(self) -> int:
        return int(self.K.shape[0])


def superelement_body(s: Superelement) -> ApaBody:
    """Return the superelement as it is, unreduced, damped in its free-free elastic modes."""
    sensor, actuator = s.elongation(s.nodes.sensor), s.elongation(s.nodes.actuator)
    K, M = (s.K + s.K.T) / 2, (s.M + s.M.T) / 2
    return ApaBody(
        K=K,
        M=M,
        C_ratio=free_free_damping(K, M),
        C=np.zeros_like(K),
        bottom=s.rows(s.nodes.bottom),
        top=s.rows(s.nodes.top),
        sensor=sensor,
        actuator=actuator,
        k_sensor=stiffness_across(s, sensor),
        k_actuator=stiffness_across(s, actuator),
        height=float(np.linalg.norm(s.xyz[s.nodes.top] - s.xyz[s.nodes.bottom])),
        name=s.name,
    )


def free_free_damping(K: Array, M: Array) -> Array:
    """Return the matrix (n, n) of damping ratio 1 for every elastic mode of the free body (Geradin & Rixen, 3.3)."""
    w2, modes = linalg.eigh(K, M)
    momenta = M @ modes[:, ELASTIC_FROM:]
    damping: Array = (momenta * (2.0 * np.sqrt(w2[ELASTIC_FROM:]))) @ momenta.T
    return damping


def stiffness_across(s: Superelement, elongation: Array) -> float:
    """Return the static stiffness [N/m] to a pair of forces along an elongation row; the bottom is held."""
    held = s.dofs(s.nodes.bottom)
    free = np.setdiff1d(np.arange(s.size), np.arange(held.start, held.stop))
    v = elongation[free]
    return float(1.0 / (v @ linalg.solve(s.K[np.ix_(free, free)], v, assume_a="sym")))
