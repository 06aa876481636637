"""The strut on its bench, put together from the granite up.

    payload      guided along z, its interferometer is da
    top joint    springs and dampers at its centre, half of its mass on the APA's side
    encoder head on the top of the APA
    APA          driven by its actuator stacks, read by its sensor stack (Vs), displaced from the joints' axis
    ruler        on the bottom of the APA; head and ruler give de
    bottom joint
    granite      does not move

The joints' axis is x = y = 0; z points up; the origin is halfway between the joints.
"""

import numpy as np

from checks.arrays import Array
from checks.model.structure.apa import ApaBody
from checks.model.structure.bench import Bench
from checks.model.structure.encoder import Encoder
from checks.model.structure.joint import CLAMP, RIGID, Joint
from checks.model.structure.matrix_builder import Builder, System
from checks.model.structure.rigid_motion import lever

Z = 2  # place of the axis among the six motions of a face


def assemble(
    apa: ApaBody,
    damping_ratio: float,
    joints: tuple[Joint, Joint] | None,
    encoder: Encoder | None,
    bench: Bench,
    offset: Array,
    stiffening: tuple[float, float] = (0.0, 0.0),
) -> System:
    """System from a force pair of 1 N on the actuator stacks to the elongation of the sensor stack, the encoder's
    reading and the payload's z [m]: channels Vs, de, da.

    joints: bottom and top; None: the APA is clamped to the granite and to the payload, and the bench's own encoder
    reads the payload. encoder: None: no encoder fixed to the strut, no de. offset (3,) [m] of the APA from the joints'
    axis, the same at both ends. stiffening: of the sensor and the actuator stacks, relative, by open circuits.
    """
    bottom, top, payload = _places(apa)
    b = Builder(apa.size + 1)

    _build_in(b, apa, damping_ratio, stiffening)

    joint_bottom, joint_top = joints or (CLAMP, CLAMP)
    center_bottom = lever(_to_axis(offset, -joint_bottom.arm)) @ bottom
    center_top = lever(_to_axis(offset, joint_top.arm)) @ top
    b.spring(center_bottom, joint_bottom.k, joint_bottom.c)  # granite below
    b.spring(center_top - payload, joint_top.k, joint_top.c)
    b.mass(lever(_to_axis(offset, -joint_bottom.half_arm)) @ bottom, joint_bottom.half_mass, joint_bottom.half_inertia)
    b.mass(lever(_to_axis(offset, joint_top.half_arm)) @ top, joint_top.half_mass, joint_top.half_inertia)

    if encoder is not None:
        b.mass(encoder.ruler_place(bottom), encoder.ruler_mass, encoder.inertia)
        b.mass(encoder.head_place(top), encoder.head_mass, encoder.inertia)

    b.mass(payload, bench.payload)
    b.spring(payload[[Z]], np.array([RIGID if bench.held else 0.0]), np.array([bench.guide_damping]))

    outputs = {"Vs": _widen(apa.sensor), "da": payload[Z]}
    if encoder is not None:
        outputs["de"] = encoder.reading(bottom, top)
    elif joints is None:
        outputs["de"] = payload[Z]
    channels = tuple(name for name in ("Vs", "de", "da") if name in outputs)
    return b.finish(_widen(apa.actuator), np.array([outputs[c] for c in channels]), channels)


def _places(apa: ApaBody) -> tuple[Array, Array, Array]:
    """Motions of the APA's two interfaces and of the payload; the payload's z is the last coordinate."""
    payload = np.zeros((6, apa.size + 1))
    payload[Z, -1] = 1.0
    return _widen(apa.bottom), _widen(apa.top), payload


def _build_in(b: Builder, apa: ApaBody, damping_ratio: float, stiffening: tuple[float, float]) -> None:
    b.M[:-1, :-1] += apa.M
    b.K[:-1, :-1] += apa.K
    b.C[:-1, :-1] += apa.C + damping_ratio * apa.C_ratio
    b.spring(_widen(apa.sensor)[None], np.array([stiffening[0] * apa.k_sensor]), np.zeros(1))
    b.spring(_widen(apa.actuator)[None], np.array([stiffening[1] * apa.k_actuator]), np.zeros(1))


def _to_axis(offset: Array, along: float) -> Array:
    """From an APA's interface to the point of the joints' axis at `along` [m] from where the interface should be."""
    return np.array([-offset[0], -offset[1], along - offset[2]])


def _widen(rows: Array) -> Array:
    """Rows of the APA's coordinates as rows of all coordinates: the payload's is added, and not read."""
    return np.concatenate([rows, np.zeros((*rows.shape[:-1], 1))], axis=-1)
