"""The `frame` APA: a beam model of the elliptical shell and its stacks, reduced to the APA's seven interface nodes."""

from collections import defaultdict
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError
from checks.model.structure.beam import Beams, Material, add_beams, add_body
from checks.model.structure.frame_geometry import FrameGeometry, SolidBlock
from checks.model.structure.superelement import DOFS, Superelement

INTERFACE_NODES = 7  # two ends and the five faces of the row of stacks; they come first
MODES = 40  # to 33 kHz: fewer would lift the modes below 2.5 kHz by 0.2 %
ARM_ELEMENTS = 6
STACK_ELEMENTS = 2


@dataclass
class _Net:
    """The nodes, members and bodies of a frame under construction."""

    points: list[Array] = field(default_factory=list)
    members: dict[Material, list[tuple[object, ...]]] = field(default_factory=lambda: defaultdict(list))
    bodies: list[tuple[int, float, Array, Array]] = field(default_factory=list)

    def node(self, point: ArrayLike) -> int:
        self.points.append(np.asarray(point, dtype=float))
        return len(self.points) - 1

    def beam(
        self, material: Material, a: int, b: int, width: float, height: float, at_a: ArrayLike | None = None
    ) -> None:
        """Add a member from node a to node b; at_a (3,) [m]: its start, if it is another point rigidly fixed to a."""
        start = self.points[a] if at_a is None else np.asarray(at_a, dtype=float)
        offset = np.array([start - self.points[a], np.zeros(3)])
        self.members[material].append(((a, b), self.points[b] - start, width, height, offset))

    def box(self, ends: tuple[int, int], material: Material, sides: tuple[float, float, float], center: Array) -> None:
        """Add a solid box with its sides along the axes; half of its mass and inertia moves with each of two nodes."""
        mass = material.rho * float(np.prod(sides)) / 2.0
        squares = np.square(sides)
        inertia = mass / 12.0 * (squares.sum() - squares)
        self.bodies += [(node, mass, inertia, center - self.points[node]) for node in ends]

    def matrices(self) -> tuple[Array, Array]:
        n = DOFS * len(self.points)
        K, M = np.zeros((n, n)), np.zeros((n, n))
        for material, rows in self.members.items():
            add_beams(K, M, Beams(material, *(np.array(column) for column in zip(*rows, strict=True))))
        for node, mass, inertia, offset in self.bodies:
            add_body(M, node, mass, inertia, offset)
        return K, M


def frame_apa(geometry: FrameGeometry | None = None, modes: int = MODES) -> Superelement:
    """Return the frame APA as a superelement: seven interface nodes (42 dofs) and `modes` internal modes; takes 5 ms.

    Without a geometry: that of the APA300ML, calibrated on its published finite-element matrices (see FrameGeometry).
    Raises ModelError for a geometry that no part can have."""
    K, M, points = frame_matrices(geometry or FrameGeometry())
    K, M = craig_bampton(K, M, DOFS * INTERFACE_NODES, modes)
    return Superelement(K, M, points[:INTERFACE_NODES], name="frame APA")


def frame_matrices(g: FrameGeometry, arm_elements: int = ARM_ELEMENTS) -> tuple[Array, Array, Array]:
    """Return K, M (n, n) of all nodes, unreduced, and their places (n/6, 3) [m], the seven interface nodes first."""
    net = _Net()
    bottom, top = net.node([0, 0, -g.height / 2]), net.node([0, 0, g.height / 2])
    row = [net.node([x, 0, 0]) for x in g.stations]
    _row(net, g, row)
    ends = {-1: _end_block(net, g, row[0], -1), 1: _end_block(net, g, row[-1], 1)}
    feet = {-1: _top_block(net, g, bottom, -1), 1: _top_block(net, g, top, 1)}
    for side, end in ends.items():
        for up, foot in feet.items():
            _arm(net, g, end, foot, side * g.arm_beyond + row_end(g, side), up, arm_elements)
    return (*net.matrices(), np.array(net.points))


def row_end(g: FrameGeometry, side: int) -> float:
    """Return the coordinate x [m] of the left (-1) or right (+1) end of the row of stacks."""
    return g.stations[0] if side < 0 else g.stations[-1]


def _row(net: _Net, g: FrameGeometry, row: list[int]) -> None:
    """Add sensor stack, spacer and the two actuator stacks; each face of the spacer carries half of its mass."""
    for i in (0, 2, 3):
        inner = np.linspace(net.points[row[i]], net.points[row[i + 1]], STACK_ELEMENTS + 1)[1:-1]
        chain = [row[i], *(net.node(p) for p in inner), row[i + 1]]
        for a, b in pairwise(chain):
            net.beam(g.ceramic, a, b, g.stack_side, g.stack_side)
    net.beam(_massless(g.steel), row[1], row[2], g.spacer_side, g.spacer_side)
    left, right = net.points[row[1]], net.points[row[2]]
    net.box((row[1], row[2]), g.steel, (right[0] - left[0], g.spacer_box, g.spacer_box), (left + right) / 2)


def _end_block(net: _Net, g: FrameGeometry, node: int, side: int) -> int:
    """Add a neck and a box beyond the row's end; return the node that its two arms start from."""
    root = net.node([row_end(g, side) + side * g.arm_beyond, 0, 0])
    return _block(net, g, node, root, g.end)


def _top_block(net: _Net, g: FrameGeometry, node: int, up: int) -> int:
    """Add a neck and a box below the top interface (above the bottom one); return the node that its two arms end at."""
    foot = net.node([0, 0, up * g.arm_foot_z])
    return _block(net, g, node, foot, g.top)


def _block(net: _Net, g: FrameGeometry, node: int, joint: int, block: SolidBlock) -> int:
    away = net.points[joint] - net.points[node]
    net.beam(_massless(g.steel), node, joint, *block.neck)
    net.box((node, joint), g.steel, block.box, net.points[node] + block.center * away / np.linalg.norm(away))
    return joint


def _arm(net: _Net, g: FrameGeometry, end: int, foot: int, root_x: float, up: int, elements: int) -> None:
    """Add a tapered arm, bowed outwards along a parabola, from above (below) an end block's node to the foot."""
    s = np.linspace(0.0, 1.0, elements + 1)
    root = np.array([root_x, 0.0, up * g.arm_root_z])
    path = root + s[:, None] * (net.points[foot] - root) + np.outer(4 * s * (1 - s), [0, 0, up * g.arm_rise])
    chain = [end, *(net.node(p) for p in path[1:-1]), foot]
    thickness = np.interp((s[1:] + s[:-1]) / 2, [0, 1], g.arm_thickness)
    for i, (a, b) in enumerate(pairwise(chain)):
        net.beam(g.steel, a, b, g.arm_width, float(thickness[i]), at_a=root if i == 0 else None)


def _massless(material: Material) -> Material:
    """Return the material without density, for a neck: its mass is in its block's box."""
    return replace(material, rho=0.0)


def craig_bampton(K: Array, M: Array, interface: int, modes: int) -> tuple[Array, Array]:
    """Return K, M of a free body reduced to the first `interface` dofs, kept as they are, and `modes` modal dofs with
    unit modal mass: its lowest modes with the interface held.

    K, M (n, n) with the interface first; returns two (interface + modes, interface + modes). Exact at rest for loads on
    the interface ([CB68]). Raises ModelError if the interior is not held by it."""
    inside = K.shape[0] - interface
    if not 0 <= modes <= inside:
        raise ModelError(f"{modes} interior modes were asked for, expected 0..{inside}")
    Kii, Mii = K[interface:, interface:], M[interface:, interface:]
    try:
        static = -linalg.cho_solve(linalg.cho_factor(Kii), K[interface:, :interface])
    except linalg.LinAlgError as e:
        raise ModelError(f"the interior is not held by the {interface} interface dofs: {e}") from e
    shapes = linalg.eigh(Kii, Mii, subset_by_index=[0, modes - 1])[1] if modes else np.zeros((inside, 0))
    T = np.block([[np.eye(interface), np.zeros((interface, modes))], [static, shapes]])
    reduced = [T.T @ A @ T for A in (K, M)]
    return (reduced[0] + reduced[0].T) / 2, (reduced[1] + reduced[1].T) / 2
