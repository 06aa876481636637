"""The encoder: its head on the top of the APA, its ruler on the bottom, and the point where it reads."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.model.structure.rigid_motion import lever


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
