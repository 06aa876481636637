"""What is fastened to an APA.

Joints: springs and dampers at their centre of rotation, half of their mass beside the APA. Encoder: its head on the top
of the APA, its ruler on the bottom, and the point where it reads. Bench: a base of granite that holds the bottom, a
payload guided along z, perhaps a mode of the frame."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.model.structure.rigid_motion import lever

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


@dataclass(frozen=True, eq=False)
class Encoder:
    """head_mass, ruler_mass [kg], rigid on the interface nodes; com (3,) [m] of the ruler from the bottom node, of the
    head from the top node with z turned; inertia (3,) [kg m2] of each about its centre of mass; arm (2,) [m] x and y of
    the point on the head that is read, from the top node; ruler_arm (2,) [m] of the point on the ruler, from the bottom
    node. They differ if head and ruler are not mounted in line."""

    head_mass: float
    ruler_mass: float
    com: Array
    inertia: Array
    arm: Array
    ruler_arm: Array

    def ruler_place(self, bottom: Array) -> Array:
        """Return the motion (6, n) of the ruler's centre of mass."""
        return lever(self.com) @ bottom

    def head_place(self, top: Array) -> Array:
        """Return the motion (6, n) of the head's centre of mass."""
        return lever(self.com * np.array([1.0, 1.0, -1.0])) @ top

    def reading(self, bottom: Array, top: Array) -> Array:
        """Return the row (n,) of its reading [m]: the difference in z of its two points, rotations included."""
        head, ruler = (lever((x, y, 0.0))[2] for x, y in (self.arm, self.ruler_arm))
        row: Array = head @ top - ruler @ bottom
        return row


def bracket(f: Array, f_Hz: float, damping_ratio: float) -> Complex:
    """Return the factor (F,) of a head on a flexible bracket: w^2 / (s^2 + 2 z w s + w^2); one for an infinite f_Hz."""
    x = 1j * f / f_Hz
    factor: Complex = 1.0 / (x * x + 2.0 * damping_ratio * x + 1.0)
    return factor


@dataclass(frozen=True)
class Bench:
    """payload [kg] including its half of the top joint; guide_damping [N s/m]; held: the payload is clamped too."""

    payload: float
    guide_damping: float
    held: bool = False


def suspension(f: Array, static: float, ratio: float, f_Hz: float, damping_ratio: float) -> Complex:
    """Return the contribution (F,) of a mode of the bench to both displacements: ratio g0 w^2 / (s^2 + 2 z w s + w^2).

    static: g0, the static gain of da [m/V] ([DESIGN] 6)."""
    x = 1j * f / f_Hz
    added: Complex = ratio * static / (x * x + 2.0 * damping_ratio * x + 1.0)
    return added
