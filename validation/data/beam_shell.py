"""A shell of the project's own where the public finite-element matrices are absent: beams and solid blocks in the shape
of the APA300ML, with as many elastic modes as the matrices have.

Interface nodes and frame are those of the matrices: bottom and top, then the ends of the stacks along x. SI.
"""

from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from validation.beams import Section, between

Array = NDArray[np.float64]
Sides = tuple[float, float, float]

INTERFACE = 7  # nodes
STEEL = (200e9, 0.3, 7850.0)  # Young's modulus, Poisson's ratio, density
WEIGHTLESS = (200e9, 0.3, 0.0)  # a neck: its mass is that of its block
CERAMIC = (45.78e9, 0.3, 7850.0)
HALF_HEIGHT = 15e-3
STATIONS = (-32.5e-3, -12.5e-3, -7.5e-3, 12.5e-3, 32.5e-3)  # sensor stack, spacer, two actuator stacks
STACK_SIDE, SPACER_SIDE, SPACER_BOX = 10e-3, 10.4e-3, (5e-3, 14e-3, 14e-3)
ROOT_X, ROOT_Z, FOOT_Z = 39e-3, 5.658e-3, 12.722e-3  # where an arm begins beside the row, and where it ends
ARM_WIDTH, ARM_THICK, ARM_RISE = 19.57e-3, (1.671e-3, 1.66e-3), 0.88e-3
ARM_PARTS = 4
END_BOX, END_CENTRE, END_NECK = (24.4e-3, 8.68e-3, 4.49e-3), 6e-3, (5.79e-3, 10.85e-3)
TOP_BOX, TOP_CENTRE, TOP_NECK = (20e-3, 24e-3, 0.719e-3), 2e-3, (16e-3, 5.044e-3)


def rigid(r: Array) -> Array:
    """Return the matrix (6, 6) from a node's motions to those of a point at r that the node carries."""
    x, y, z = r
    moves = np.eye(6)
    moves[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return moves


@dataclass
class _Net:
    """Nodes, the beams between them, and the boxes that they carry."""

    points: list[Array] = field(default_factory=list)
    beams: list[tuple[int, int, Array, Section]] = field(default_factory=list)
    boxes: list[tuple[int, Array, Sides]] = field(default_factory=list)

    def node(self, x: float, z: float) -> int:
        self.points.append(np.array([x, 0.0, z]))
        return len(self.points) - 1

    def chain(self, nodes: list[int], *sections: Section, start: Array | None = None) -> None:
        """Add beams from node to node. start: where the first begins, if its node only carries that point."""
        for k, (a, b) in enumerate(pairwise(nodes)):
            at = self.points[a] if start is None or k else start
            self.beams.append((a, b, at, sections[min(k, len(sections) - 1)]))

    def block(
        self, node: int, joint: int, neck: tuple[float, float], box: tuple[float, float, float], c: float
    ) -> None:
        """Add a neck from a node to a joint and a box about a point of it; half of the box moves with either."""
        away = self.points[joint] - self.points[node]
        self.chain([node, joint], Section.rectangle(*WEIGHTLESS, *neck))
        self.box(node, joint, self.points[node] + c * away / np.linalg.norm(away), box)

    def box(self, a: int, b: int, centre: Array, sides: Sides) -> None:
        self.boxes += [(node, centre - self.points[node], sides) for node in (a, b)]

    def matrices(self) -> tuple[Array, Array]:
        size = 6 * len(self.points)
        K, M = np.zeros((size, size)), np.zeros((size, size))
        for a, b, start, section in self.beams:
            at = np.r_[6 * a : 6 * a + 6, 6 * b : 6 * b + 6]
            T = np.eye(12)
            T[:6, :6] = rigid(start - self.points[a])
            k, m = between(section, start, self.points[b])
            K[np.ix_(at, at)] += T.T @ k @ T
            M[np.ix_(at, at)] += T.T @ m @ T
        for node, r, sides in self.boxes:
            mass, squares = STEEL[2] * float(np.prod(sides)) / 2, np.square(sides)
            body = np.diag([mass] * 3 + list(mass / 12 * (squares.sum() - squares)))
            own = slice(6 * node, 6 * node + 6)
            M[own, own] += rigid(r).T @ body @ rigid(r)
        return K, M


@cache
def beam_shell() -> tuple[Array, Array, Array]:
    """Return K, M (162, 162) of the free shell and the places (7, 3) [m] of its interface nodes, which come first."""
    net = _Net()
    bottom, top = net.node(0.0, -HALF_HEIGHT), net.node(0.0, HALF_HEIGHT)
    row = [net.node(x, 0.0) for x in STATIONS]
    stack = Section.rectangle(*CERAMIC, STACK_SIDE, STACK_SIDE)
    for k in (0, 2, 3):
        net.chain([row[k], net.node((STATIONS[k] + STATIONS[k + 1]) / 2, 0.0), row[k + 1]], stack)
    middle = net.node((STATIONS[1] + STATIONS[2]) / 2, 0.0)
    net.chain([row[1], middle, row[2]], Section.rectangle(*WEIGHTLESS, SPACER_SIDE, SPACER_SIDE))
    net.box(middle, middle, net.points[middle], SPACER_BOX)
    ends = {side: net.node(side * ROOT_X, 0.0) for side in (-1, 1)}
    feet = {up: net.node(0.0, up * FOOT_Z) for up in (-1, 1)}
    net.block(row[0], ends[-1], END_NECK, END_BOX, END_CENTRE)
    net.block(row[4], ends[1], END_NECK, END_BOX, END_CENTRE)
    net.block(bottom, feet[-1], TOP_NECK, TOP_BOX, TOP_CENTRE)
    net.block(top, feet[1], TOP_NECK, TOP_BOX, TOP_CENTRE)
    for side, end in ends.items():
        for up, foot in feet.items():
            _arm(net, end, foot, side, up)
    return (*_reduced(*net.matrices(), 6 * INTERFACE), np.array(net.points[:INTERFACE]))


def _reduced(K: Array, M: Array, held: int) -> tuple[Array, Array]:
    """Return K, M by the first `held` motions and the modes of the rest with those held, of unit mass: all of them, so
    nothing is lost ([CB68])."""
    inner = slice(held, None)
    static = -linalg.solve(K[inner, inner], K[inner, :held], assume_a="pos")
    shapes = linalg.eigh(K[inner, inner], M[inner, inner])[1]
    T = np.block([[np.eye(held), np.zeros((held, shapes.shape[1]))], [static, shapes]])
    K, M = T.T @ K @ T, T.T @ M @ T
    return (K + K.T) / 2, (M + M.T) / 2


def _arm(net: _Net, end: int, foot: int, side: int, up: int) -> None:
    """Add an arm, bowed outwards along a parabola, from a point that the end block carries to the foot."""
    s = np.linspace(0.0, 1.0, ARM_PARTS + 1)
    root = np.array([side * ROOT_X, 0.0, up * ROOT_Z])
    path = root + s[:, None] * (net.points[foot] - root) + np.outer(4 * s * (1 - s), [0.0, 0.0, up * ARM_RISE])
    thick = np.interp((s[1:] + s[:-1]) / 2, [0.0, 1.0], ARM_THICK)
    inner = [net.node(x, z) for x, _, z in path[1:-1]]
    net.chain([end, *inner, foot], *(Section.rectangle(*STEEL, ARM_WIDTH, t) for t in thick), start=root)
