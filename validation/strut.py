"""A strut on its bench, written from words alone, for blind tests; means and priors are those of `strut.toml`.

Nothing of the model that it tests is used here: what judges the gap workflow must not share its mistakes. The
super-element matrices are the real ones, or what was built by them (`shell`). Frame: z the strut axis, x the long axis
of the shell, y across. SI.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from validation.beams import Section, chain
from validation.rational import Rational
from validation.shell import NODES, Built, across, free_shell

Array = NDArray[np.float64]

MODEL_FILE = Path(__file__).parent / "data" / "strut.toml"

CHANNELS = ("de", "da", "Vs")
AMPLIFIER_GAIN = 20.0
JOINT_CENTRE = 12.75e-3
JOINT_MASS_AT = 6.4e-3
HALF_JOINT_KG = 0.0146
HALF_JOINT_INERTIA = np.full(3, 1e-6)
JOINT_LATERAL = 12.7e6
JOINT_AXIS_DAMPING = 10.0
ENCODER_COM = np.array([0.0, 11.5e-3, 9.5e-3])
ENCODER_INERTIA = np.array([3.0e-5, 6.0e-6, 2.6e-5])
BLOCK = Section(
    EA=1.5e7, EI=60.0, GJ=50.0, GA=5e6, mass=1.25, inertia=7e-5
)  # between neck and shell: steel, 10 mm thick
NECK = {"mass": 8e-3, "inertia": 1e-9}
BRACKET_SHARE = 0.1  # of the mass of head or ruler
BRACKET_THICK = 6e-3
BETWEEN_ACTUATORS = 5  # node where the two actuator stacks meet
PARTS = 4  # elements of a neck or a bracket
DYNAMIC_BELOW_HZ = 15e3  # faster modes follow the drive: statics miss less than 0.1 % at 2 kHz (tested)


@dataclass(frozen=True)
class Hung:
    """A second mass on a spring, along z, on the encoder's head: no effect of the library does this."""

    mass: float
    f_Hz: float
    damping_ratio: float


@dataclass(frozen=True)
class Support:
    """A payload that its guide does not hold rigidly: six degrees of freedom in place of one. kx, ky: of the guide
    across the axis [N/m]; krx, kry, krz: about the axes [Nm/rad]; inertia: about the centre of mass [kg m2];
    damping_ratio: of each of these five; axis_x, axis_y: where the strut's axis passes the centre of mass [m]; height:
    of the centre of mass above the joint [m]; read_x, read_y: where da is read [m]."""

    kx: float
    ky: float
    krx: float
    kry: float
    krz: float
    inertia: tuple[float, float, float]
    damping_ratio: float
    axis_x: float = 0.0
    axis_y: float = 0.0
    height: float = 0.0
    read_x: float = 0.0
    read_y: float = 0.0


@dataclass(frozen=True)
class Flexible:
    """A strut that is no frame. neck_m: length over which each joint bends, as a beam, in place of a point; head_Hz,
    ruler_Hz: lowest frequency of each on its bracket, were that clamped; damping_ratio: of that mode."""

    neck_m: float
    head_Hz: float
    ruler_Hz: float
    damping_ratio: float


@dataclass(frozen=True)
class Attached:
    """An element in the mechanics, along one direction (0 to 5: x, y, z and the rotations) of a place: "top", "bottom"
    (the shell's interfaces), "head" (its centre of mass), "payload", "sensor" (across that stack). at: point beside the
    place's own [m]; k, c, m: spring [N/m], damper [N s/m], mass [kg] to ground; hung: mass [kg], f [Hz], damping
    ratio of what swings there."""

    place: str
    direction: int = 2
    at: tuple[float, float] = (0.0, 0.0)
    k: float = 0.0
    c: float = 0.0
    m: float = 0.0
    hung: Hung | None = None


@dataclass(frozen=True)
class Loose:
    """A joint of other stiffness and damping. side: -1 the bottom one, +1 the top one; kz, kR: factors; cz [N s/m], cR
    [N m s]: added."""

    side: int
    kz: float
    kR: float
    cz: float
    cR: float


@dataclass(frozen=True)
class Strut:
    """All that differs from strut to strut, SI. stiffening: of the sensor stack, in parts of the stiffness that the
    free shell has across it; modal: whether each mode is damped for itself, as in the recorded units, or the dampers
    also join the modes, as real ones do. built: how its shell differs from the matrices; ruler_x, ruler_y: where the
    ruler is read, none where the head is; support: a guide of the payload that gives way; tuned: a mass on a spring,
    along z, on the payload; flexible: joints and brackets that bend as beams; attached: elements in the mechanics;
    loose: a joint that differs; dead: share of the force that the right one of the two actuator stacks lacks."""

    kz: float
    kRx: float
    kRy: float
    kRz: float
    cR: float
    head: float
    ruler: float
    arm_x: float
    arm_y: float
    payload: float
    guide: float
    zeta: float
    ga: float
    gs: float
    dx: float = 0.0
    dy: float = 0.0
    stiffening: float = 0.0
    modal: bool = False
    hung: Hung | None = None
    built: Built | None = None
    ruler_x: float | None = None
    ruler_y: float | None = None
    support: Support | None = None
    tuned: Hung | None = None
    flexible: Flexible | None = None
    attached: tuple[Attached, ...] = ()
    loose: Loose | None = None
    dead: float = 0.0


# field of Strut -> section and name in the model file, factor to SI
DRAWN: Mapping[str, tuple[str, str, float]] = {
    "kz": ("joint", "kz_N_per_um", 1e6),
    "kRx": ("joint", "kRx_Nm_per_rad", 1.0),
    "kRy": ("joint", "kRy_Nm_per_rad", 1.0),
    "kRz": ("joint", "kRz_Nm_per_rad", 1.0),
    "cR": ("joint", "cR_Nm_s_per_rad", 1.0),
    "head": ("encoder", "head_mass_kg", 1.0),
    "ruler": ("encoder", "ruler_mass_kg", 1.0),
    "arm_x": ("encoder", "arm_x_mm", 1e-3),
    "arm_y": ("encoder", "arm_y_mm", 1e-3),
    "payload": ("bench", "payload_kg", 1.0),
    "guide": ("bench", "guide_damping_N_s_per_m", 1.0),
    "zeta": ("apa", "damping_ratio", 1.0),
    "ga": ("constants", "ga_N_per_V", 1.0),
    "gs": ("constants", "gs_V_per_m", 1.0),
}


@cache
def priors() -> dict[str, tuple[float, float]]:
    """Return the mean and standard deviation, SI, of each field of Strut, as the model file states them."""
    text = tomllib.loads(MODEL_FILE.read_text())
    stated = {field: (text[section][name], scale) for field, (section, name, scale) in DRAWN.items()}
    return {field: (entry["value"] * scale, entry["sd"] * scale) for field, (entry, scale) in stated.items()}


def nominal() -> Strut:
    return Strut(**{field: mean for field, (mean, _) in priors().items()})


def draw(rng: np.random.Generator) -> Strut:
    """Return a strut with every parameter drawn from its prior; the signs stay those of the means."""
    values = {field: _draw(rng, mean, sd) for field, (mean, sd) in priors().items()}
    return Strut(**values, modal=bool(rng.integers(2)))


def _draw(rng: np.random.Generator, mean: float, sd: float) -> float:
    while True:
        value = rng.normal(mean, sd)
        if value / mean > 0.1:
            return float(value)


def _lever(at: Array) -> Array:
    """Return the matrix (3, 6) from a node's translations and rotations to the displacement of a point rigidly fixed to
    it: u + theta x r."""
    x, y, z = at
    return np.hstack([np.eye(3), np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])])


class _Assembly:
    """Matrices being put together: shell, payload along z, the hung mass, if any, then what a strut has more: the other
    motions of a payload that is not held rigidly (x, y, rotations), a tuned mass."""

    def __init__(self, strut: Strut) -> None:
        K, M, C, stack = free_shell(strut.built)
        self.payload, self.hung, size = K.shape[0], K.shape[0] + 1, K.shape[0] + 2
        self.tilting = [size, size + 1, self.payload, size + 2, size + 3, size + 4] if strut.support else []
        size += 5 if strut.support else 0
        self.tuned = size
        size += 1 if strut.tuned else 0
        self.swinging = size
        size += len(strut.attached)
        self.unused = size
        size += 6 * 4 * PARTS if strut.flexible else 0
        self.K, self.M, self.C = (np.zeros((size, size)) for _ in range(3))
        inner = slice(0, self.payload)
        self.K[inner, inner], self.M[inner, inner], self.C[inner, inner] = K, M, strut.zeta * C
        pick = across(size)
        self.K += strut.stiffening * stack * np.outer(pick, pick)

    def nodes(self, number: int) -> list[Array]:
        """Return the motions (6, size) of so many new nodes."""
        first, self.unused = self.unused, self.unused + 6 * number
        every = np.eye(self.K.shape[0])
        return [every[first + 6 * k : first + 6 * k + 6] for k in range(number)]

    def beams(self, sections: Sequence[Section], points: Sequence[Array], moves: Sequence[Array], beta: float) -> None:
        """Add a chain of beams. moves: motions (6, size) of each point; beta: stiffness-proportional damping [s]."""
        K, M = chain(sections, points)
        P = np.vstack(moves)
        self.K += P.T @ K @ P
        self.M += P.T @ M @ P
        self.C += beta * (P.T @ K @ P)

    def tied(self, node: int, at: Array) -> Array:
        """Return the motions (6, size) of a point that a node carries rigidly."""
        moves = np.zeros((6, self.K.shape[0]))
        moves[:3] = self.point(node, at)
        moves[3:, 6 * node + 3 : 6 * node + 6] = np.eye(3)
        return moves

    def body(self, node: int, at: Array, mass: float, inertia: Array) -> None:
        block = slice(6 * node, 6 * node + 6)
        lever = _lever(at)
        self.M[block, block] += mass * lever.T @ lever
        self.M[block, block][3:, 3:] += np.diag(inertia)

    def springs(self, along: Array, k: Array, c: Array) -> None:
        """Add springs. along (n, size): their elongations; k, c (n,)."""
        self.K += along.T @ (k[:, None] * along)
        self.C += along.T @ (c[:, None] * along)

    def point(self, node: int, at: Array) -> Array:
        """Return the displacement (3, size) of a point fixed to a node."""
        pick = np.zeros((3, self.K.shape[0]))
        pick[:, 6 * node : 6 * node + 6] = _lever(at)
        return pick


def _up(z: float) -> Array:
    return np.array([0.0, 0.0, z])


def _joint(a: _Assembly, strut: Strut, node: int, side: float) -> None:
    """Add a joint. side: -1 the bottom one, to the ground; +1 the top one, to the payload. The shell is offset from the
    axis."""
    axis = np.array([-strut.dx, -strut.dy, 0.0])
    if strut.flexible is not None:
        _bending_joint(a, strut, strut.flexible, node, side, axis)
        return
    a.body(node, axis + _up(side * JOINT_MASS_AT), HALF_JOINT_KG, HALF_JOINT_INERTIA)
    along = np.zeros((6, a.K.shape[0]))
    along[:3] = a.point(node, axis + _up(side * JOINT_CENTRE))
    along[3:, 6 * node + 3 : 6 * node + 6] = np.eye(3)
    if side > 0:
        along -= _payload_motion(a, strut.support)
    k = np.array([JOINT_LATERAL, JOINT_LATERAL, strut.kz, strut.kRx, strut.kRy, strut.kRz])
    c = np.array([JOINT_AXIS_DAMPING] * 3 + [strut.cR] * 3)
    if strut.loose is not None and strut.loose.side == side:
        k[2:5] *= [strut.loose.kz, strut.loose.kR, strut.loose.kR]
        c[2:5] += [strut.loose.cz, strut.loose.cR, strut.loose.cR]
    a.springs(along, k, c)


def _bending_joint(a: _Assembly, strut: Strut, flexible: Flexible, node: int, side: float, axis: Array) -> None:
    """Add a joint whose block and neck are beams. The neck has the joint's stiffness from end to end: bending by its
    mean, the length beside it takes from the lateral one what bending gives."""
    L = flexible.neck_m
    bends = (strut.kRx + strut.kRy) / 2
    shear = 1 / JOINT_LATERAL - L**2 / (12 * bends)
    if shear <= 0:
        raise ValueError(f"a neck of {L} m bends more than the joint gives way sideways")
    neck = Section(EA=strut.kz * L, EI=bends * L, GJ=strut.kRz * L, GA=L / shear, **NECK)
    heights = [0.0, *np.linspace(JOINT_CENTRE - L / 2, JOINT_CENTRE + L / 2, PARTS + 1)]
    points = [axis + _up(side * h) for h in heights]
    inner = a.nodes(PARTS)
    far = _payload_motion(a, strut.support) if side > 0 else np.zeros((6, a.K.shape[0]))
    a.beams([BLOCK, *[neck] * PARTS], points, [a.tied(node, axis), *inner, far], 0.0)
    a.springs(inner[0] - far, np.zeros(6), np.array([JOINT_AXIS_DAMPING] * 3 + [strut.cR] * 3))


def _bracket(a: _Assembly, flexible: Flexible, node: int, com: Array, mass: float, f_Hz: float) -> Array:
    """Add a bracket from a node to the body that it carries; return the body's motions (6, size)."""
    length, omega = float(np.linalg.norm(com)), 2 * np.pi * f_Hz
    line, points = BRACKET_SHARE * mass / length, [com * k / PARTS for k in range(PARTS + 1)]
    body = np.diag([(1 - BRACKET_SHARE) * mass] * 3 + list(ENCODER_INERTIA))

    def of(EI: float) -> Section:
        EA = 12 * EI / BRACKET_THICK**2
        return Section(EA=EA, EI=EI, GJ=0.8 * EI, GA=EA / 3, mass=line, inertia=line * BRACKET_THICK**2 / 12)

    K, M = chain([of(1.0)] * PARTS, points)
    M[-6:, -6:] += body
    softest = linalg.eigvalsh(K[6:, 6:], M[6:, 6:])[0]
    free = a.nodes(PARTS)
    moves = [a.tied(node, np.zeros(3)), *free]
    a.beams([of(omega**2 / softest)] * PARTS, points, moves, 2 * flexible.damping_ratio / omega)
    a.M += free[-1].T @ body @ free[-1]
    return free[-1]


def _payload_motion(a: _Assembly, support: Support | None) -> Array:
    """Return the translations and rotations (6, size) of the payload where the top joint ends in it."""
    moves = np.zeros((6, a.K.shape[0]))
    if support is None:
        moves[2, a.payload] = 1.0
        return moves
    moves[:3, a.tilting] = _lever(np.array([support.axis_x, support.axis_y, -support.height]))
    moves[3:, a.tilting[3:]] = np.eye(3)
    return moves


def _bench(a: _Assembly, strut: Strut) -> None:
    """Add the payload, its guide and what hangs on it."""
    a.M[a.payload, a.payload] += strut.payload
    a.C[a.payload, a.payload] += strut.guide
    if strut.support is not None:
        s = strut.support
        k = np.array([s.kx, s.ky, s.krx, s.kry, s.krz])
        m = np.array([strut.payload, strut.payload, *s.inertia])
        held = [a.tilting[i] for i in (0, 1, 3, 4, 5)]
        a.M[held, held] += m
        a.K[held, held] += k
        a.C[held, held] += 2 * s.damping_ratio * np.sqrt(k * m)
    if strut.tuned is not None:
        h, omega = strut.tuned, 2 * np.pi * strut.tuned.f_Hz
        a.M[a.tuned, a.tuned] = h.mass
        along = np.zeros((1, a.K.shape[0]))
        along[0, [a.tuned, a.payload]] = 1.0, -1.0
        a.springs(along, np.array([h.mass * omega**2]), np.array([2 * h.damping_ratio * omega * h.mass]))


def _attach(a: _Assembly, strut: Strut) -> None:
    """Add the elements in the mechanics."""
    for i, e in enumerate(strut.attached):
        row = _motion_of(a, e)
        a.K += e.k * np.outer(row, row)
        a.C += e.c * np.outer(row, row)
        a.M += e.m * np.outer(row, row)
        own = np.eye(a.K.shape[0])[a.swinging + i]
        h = e.hung or Hung(1.0, 1e6, 1e-3)  # out of every way
        omega, away = 2 * np.pi * h.f_Hz, own - (row if e.hung else 0.0)
        a.M += h.mass * np.outer(own, own)
        a.springs(away[None], np.array([h.mass * omega**2]), np.array([2 * h.damping_ratio * omega * h.mass]))


def _motion_of(a: _Assembly, e: Attached) -> Array:
    """Return the row (size,) of the motion that an element sees."""
    if e.place == "payload":
        return np.eye(a.K.shape[0])[a.payload]
    if e.place == "sensor":
        return across(a.K.shape[0])
    beside = ENCODER_COM * [1, 1, -1] if e.place == "head" else np.zeros(3)
    return a.tied(NODES["bottom" if e.place == "bottom" else "top"], beside + np.array([*e.at, 0.0]))[e.direction]


def _encoder(a: _Assembly, strut: Strut) -> Array:
    """Add head and ruler; return the row (size,) that the encoder reads."""
    above, below = ENCODER_COM, ENCODER_COM * [1, 1, -1]
    head_at = np.array([strut.arm_x, strut.arm_y, 0.0])
    ruler_at = np.array([_or(strut.ruler_x, strut.arm_x), _or(strut.ruler_y, strut.arm_y), 0.0])
    if strut.flexible is not None:
        top, bottom, bends = NODES["top"], NODES["bottom"], strut.flexible
        head = _bracket(a, bends, top, below, strut.head, bends.head_Hz)
        ruler = _bracket(a, bends, bottom, above, strut.ruler, bends.ruler_Hz)
        reads = (_lever(head_at - below) @ head - _lever(ruler_at - above) @ ruler)[2]
    else:
        a.body(NODES["top"], below, strut.head, ENCODER_INERTIA)
        a.body(NODES["bottom"], above, strut.ruler, ENCODER_INERTIA)
        reads = a.point(NODES["top"], head_at)[2] - a.point(NODES["bottom"], ruler_at)[2]
    if strut.hung is None:
        a.M[a.hung, a.hung], a.K[a.hung, a.hung] = 1.0, (2 * np.pi * 1e6) ** 2  # out of every way
        return reads
    h, omega = strut.hung, 2 * np.pi * strut.hung.f_Hz
    a.M[a.hung, a.hung] = h.mass
    along = -a.point(NODES["top"], below)[2:]
    along[0, a.hung] += 1.0
    a.springs(along, np.array([h.mass * omega**2]), np.array([2 * h.damping_ratio * omega * h.mass]))
    return reads


def matrices(strut: Strut) -> tuple[Array, Array, Array, Array, Array]:
    """Return the matrices M, C, K (n, n), inputs (n, 2): per volt of Va and per newton on the payload, outputs (3, n):
    de, da, Vs."""
    a = _Assembly(strut)
    _joint(a, strut, NODES["bottom"], -1.0)
    _joint(a, strut, NODES["top"], +1.0)
    reads = _encoder(a, strut)
    _bench(a, strut)
    _attach(a, strut)
    size = a.K.shape[0]
    inputs, outputs = np.zeros((size, 2)), np.zeros((3, size))
    force = AMPLIFIER_GAIN * strut.ga
    inputs[6 * NODES["actuator_right"], 0], inputs[6 * NODES["actuator_left"], 0] = (1 - strut.dead) * force, -force
    inputs[6 * BETWEEN_ACTUATORS, 0] = strut.dead * force
    inputs[a.payload, 1] = 1.0
    outputs[0] = reads
    outputs[1, a.payload] = 1.0
    if strut.support is not None:
        outputs[1, a.tilting] = _lever(np.array([strut.support.read_x, strut.support.read_y, 0.0]))[2]
    outputs[2] = strut.gs * across(size)
    return a.M, a.C, a.K, inputs, outputs


def _or(value: float | None, other: float) -> float:
    return other if value is None else value


def plant(strut: Strut, column: int = 0) -> Rational:
    """Return the responses of de, da, Vs to Va (column 0) or a force on the payload (1): all modes below 15 kHz, the
    statics of the rest.

    Dampers join the modes, which are complex then: eigenvalues of the first-order form in the coordinates of the
    undamped ones, which scale it well. The static response is that of the whole stiffness.
    """
    M, C, K, inputs, outputs = matrices(strut)
    w2, shapes = linalg.eigh(K, M)
    keep = w2 < (2 * np.pi * 3 * DYNAMIC_BELOW_HZ) ** 2
    omega, shapes = np.sqrt(w2[keep]), shapes[:, keep]
    damping = shapes.T @ C @ shapes
    if strut.modal:
        damping = np.diag(np.diag(damping))
    zero, W = np.zeros_like(damping), np.diag(omega)
    poles, R = np.linalg.eig(np.block([[zero, W], [-W, -damping]]))
    drive = np.linalg.solve(R, np.concatenate([np.zeros(omega.size), shapes.T @ inputs[:, column]]))
    read = np.hstack([outputs @ shapes / omega, np.zeros((3, omega.size))]) @ R
    use = (np.abs(poles) < 2 * np.pi * DYNAMIC_BELOW_HZ) & (poles.imag >= 0)
    modes = Rational(poles[use], (read * drive)[:, use], np.zeros(3))
    static = outputs @ np.linalg.solve(K, inputs[:, column])
    return replace(modes, direct=static - modes.at(np.zeros(1))[:, 0].real)


def modes_Hz(strut: Strut, clamped: bool = False) -> Array:
    """Return the undamped frequencies [Hz], rising; clamped: with the payload held along z."""
    M, _, K, inputs, _ = matrices(strut)
    free = np.ones(M.shape[0], dtype=bool)
    free[np.flatnonzero(inputs[:, 1])] = not clamped
    return np.sqrt(linalg.eigvalsh(K[np.ix_(free, free)], M[np.ix_(free, free)])) / (2 * np.pi)
