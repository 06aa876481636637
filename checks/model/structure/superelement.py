"""A superelement: the mass and stiffness of a body, reduced to its interface nodes and some internal modes."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array

DOFS = 6  # ux uy uz rx ry rz of every interface node


@dataclass(frozen=True)
class Nodes:
    """Roles of the interface nodes, counted from 0. A stack lies between its two nodes, first to second."""

    bottom: int = 0
    top: int = 1
    sensor: tuple[int, int] = (2, 3)
    actuator: tuple[int, int] = (4, 6)


@dataclass(frozen=True, eq=False)
class Superelement:
    """K, M of an APA. Six dofs (ux uy uz rx ry rz) per interface node first, then the internal modal dofs.

    K (n, n) [N/m, N, N m/rad], M (n, n) [kg, kg m, kg m2]; xyz (p, 3) [m] interface nodes in the model's frame.
    Node order of the APA300ML: bottom (z -15 mm), top (+15 mm), then along x -32.5, -12.5, -7.5, 12.5, 32.5 mm."""

    K: Array
    M: Array
    xyz: Array
    nodes: Nodes = Nodes()
    name: str = "superelement"

    @property
    def size(self) -> int:
        return int(self.K.shape[0])

    def dofs(self, node: int) -> slice:
        """Return the six columns of an interface node."""
        return slice(DOFS * node, DOFS * node + DOFS)

    def rows(self, node: int) -> Array:
        """Return the rows (6, n) that read the motion of an interface node."""
        return np.eye(self.size)[self.dofs(node)]

    def elongation(self, stack: tuple[int, int]) -> Array:
        """Return the row (n,) of a stack's elongation [m]: the relative motion of its nodes along their line."""
        first, second = stack
        line = self.xyz[second] - self.xyz[first]
        direction = line / np.linalg.norm(line)
        row = np.zeros(self.size)
        row[self.dofs(second)][:3] = direction
        row[self.dofs(first)][:3] = -direction
        return row
