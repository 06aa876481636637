"""A flexible joint: springs and dampers at its centre of rotation, half of its mass beside the APA."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array

RIGID = np.inf


@dataclass(frozen=True, eq=False)
class Joint:
    """k (6,) [N/m, N m/rad], c (6,) [N s/m, N m s/rad] along and about x, y, z; an infinite k is a rigid direction.

    arm [m]: centre of rotation from the APA's interface, outwards. The half of the mass on the APA's side sits
    half_arm [m] from the interface; the other half belongs to the bench and to the payload."""

    k: Array
    c: Array
    arm: float
    half_mass: float
    half_inertia: float
    half_arm: float


# The APA alone is clamped to the bench and to the guided payload: a joint that gives way nowhere and has no length.
CLAMP = Joint(np.full(6, RIGID), np.zeros(6), arm=0.0, half_mass=0.0, half_inertia=0.0, half_arm=0.0)
