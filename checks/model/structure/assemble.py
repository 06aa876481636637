"""The strut on its bench, put together from the granite up.

    payload      guided along z, its interferometer is da
    top joint    springs and dampers at its centre, half of its mass on the APA's side
    encoder head on the top of the APA
    APA          driven by its actuator stacks, read by its sensor stack (Vs), displaced from the joints' axis
    ruler        on the bottom of the APA; head and ruler give de
    bottom joint
    granite      does not move

The joints' axis is x = y = 0; z points up; the origin is halfway between the joints.

All but the APA itself is fastened to fifteen motions: the six of each of its interfaces, the payload's z, and the
elongations of its two kinds of stacks. So all but the APA is put together in matrices of fifteen rows."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from checks.arrays import Array, between_zeros
from checks.model.structure.apa import ApaBody
from checks.model.structure.attached import Attached, attach, axis_of_payload
from checks.model.structure.fastened import CLAMP, RIGID, Bench, Encoder, Joint
from checks.model.structure.matrix_builder import Builder, Parts, System
from checks.model.structure.rigid_motion import lever

Z = 2  # place of the axis among the six motions of a face
MOTIONS = 15
AT_PAYLOAD = 12  # among the fifteen
BOTTOM, TOP = np.eye(MOTIONS)[:6], np.eye(MOTIONS)[6:AT_PAYLOAD]
PAYLOAD, SENSOR, ACTUATOR = np.eye(MOTIONS)[AT_PAYLOAD:]


@dataclass(frozen=True, eq=False)
class FastenedParts:
    """All that is fastened to an APA: M, C, K (15, 15), outputs (c, 15), one row per channel, and ties (r, 15), rows
    that must stay zero, in terms of the fifteen motions."""

    M: Array
    C: Array
    K: Array
    outputs: Array
    channels: tuple[str, ...]
    ties: Array


def fasten(
    joints: tuple[Joint, Joint] | None,
    encoder: Encoder | None,
    bench: Bench,
    offset: Array,
    stack_stiffening: tuple[float, float] = (0.0, 0.0),
    elements: tuple[Attached, ...] = (),
) -> FastenedParts:
    """Return the strut assembled on its bench. joints: bottom and top; None: the APA is clamped to granite and payload,
    and the bench's own encoder reads the payload. encoder: None: no encoder on the strut, no de. offset (3,) [m] of the
    APA from the joints' axis, the same at both ends. stack_stiffening [N/m]: of sensor and actuator stacks by open
    circuits. elements: attached to it; each hanging one adds a motion."""
    b = Builder(MOTIONS + sum(e.hung is not None for e in elements))
    payload, read = axis_of_payload(elements, AT_PAYLOAD, MOTIONS)

    b.spring(np.array([SENSOR, ACTUATOR]), np.array(stack_stiffening), np.zeros(2))

    joint_bottom, joint_top = joints or (CLAMP, CLAMP)
    center_bottom = lever(_to_axis(offset, -joint_bottom.arm)) @ BOTTOM
    center_top = lever(_to_axis(offset, joint_top.arm)) @ TOP
    b.spring(center_bottom, joint_bottom.k, joint_bottom.c)  # granite below
    b.spring(b.wide(center_top) - payload, joint_top.k, joint_top.c)
    b.mass(lever(_to_axis(offset, -joint_bottom.half_arm)) @ BOTTOM, joint_bottom.half_mass, joint_bottom.half_inertia)
    b.mass(lever(_to_axis(offset, joint_top.half_arm)) @ TOP, joint_top.half_mass, joint_top.half_inertia)

    if encoder is not None:
        b.mass(encoder.ruler_place(BOTTOM), encoder.ruler_mass, encoder.inertia)
        b.mass(encoder.head_place(TOP), encoder.head_mass, encoder.inertia)

    b.along(PAYLOAD[None], bench.payload)
    b.spring(PAYLOAD[None], np.array([RIGID if bench.held else 0.0]), np.array([bench.guide_damping]))

    attach(b, places_of(joints, encoder, offset), elements, MOTIONS)

    outputs = {"Vs": b.wide(SENSOR[None])[0], "da": read}
    if encoder is not None:
        outputs["de"] = b.wide(encoder.reading(BOTTOM, TOP)[None])[0]
    elif joints is None:
        outputs["de"] = read
    channels = tuple(name for name in ("Vs", "de", "da") if name in outputs)
    M, C, K, ties = b.matrices()
    return FastenedParts(M, C, K, np.array([outputs[c] for c in channels]), channels, ties)


def places_of(joints: tuple[Joint, Joint] | None, encoder: Encoder | None, offset: Array) -> dict[str, Array]:
    """Return the rows (6, 15) that read the motion of every named place, in terms of the fifteen motions; those of
    joints, stacks and APA read the motion across them. A place of which the model has only some directions has zeros
    for the others."""
    payload, sensor, actuator = np.zeros((3, 6, MOTIONS))
    payload[Z], sensor[0], actuator[0] = PAYLOAD, SENSOR, ACTUATOR
    joint_bottom, joint_top = joints or (CLAMP, CLAMP)
    places = {
        "top_interface": TOP,
        "bottom_interface": BOTTOM,
        "payload": payload,
        "sensor_stack": sensor,
        "actuator_stack": actuator,
        "apa": TOP - BOTTOM,
    }
    if joints is not None:
        places["bottom_joint"] = lever(_to_axis(offset, -joint_bottom.arm)) @ BOTTOM
        places["top_joint"] = lever(_to_axis(offset, joint_top.arm)) @ TOP - payload
    if encoder is not None:
        places |= {"head": encoder.head_place(TOP), "ruler": encoder.ruler_place(BOTTOM)}
    return places


def assemble(apa: ApaBody, damping_ratio: float, fastened: FastenedParts) -> System:
    """Return the system from a force pair of 1 N on the actuator stacks to the elongation of the sensor stack, the
    encoder's reading and the payload's z [m]: channels Vs, de, da. After the APA's coordinates come the payload's z and
    hanging elements, unless ties leave fewer coordinates, which keep every rigid direction rigid."""
    hung = len(fastened.K) - MOTIONS
    motions = _motions(apa, hung)
    M, C, K = (motions.T @ A @ motions for A in (fastened.M, fastened.C, fastened.K))
    inner = slice(0, apa.size)
    M[inner, inner] += apa.M
    C[inner, inner] += apa.C + damping_ratio * apa.C_ratio
    K[inner, inner] += apa.K
    drive = between_zeros(ACTUATOR, 0, hung)
    force, outputs, channels = drive @ motions, fastened.outputs @ motions, fastened.channels
    if not len(fastened.ties):
        parts: Parts | None = None
        if apa.modal:
            w2, rate = np.diag(apa.K), damping_ratio * np.diag(apa.C_ratio)
            own = [AT_PAYLOAD, *range(MOTIONS, MOTIONS + hung)]
            parts = Parts(w2, rate, motions, fastened.M, fastened.C, fastened.K, drive, fastened.outputs, own)
        return System(M, C, K, force, outputs, channels, motions, parts=parts)
    T = linalg.null_space(fastened.ties @ motions)
    return System(T.T @ M @ T, T.T @ C @ T, T.T @ K @ T, T.T @ force, outputs @ T, channels, motions @ T, T)


def _motions(apa: ApaBody, hung: int) -> Array:
    """Return the rows (15 + hung, n) of the motions in the coordinates of the APA, the payload and hanging elements."""
    rows = np.zeros((MOTIONS + hung, apa.size + 1 + hung))
    rows[:MOTIONS, : apa.size] = np.vstack([apa.bottom, apa.top, np.zeros(apa.size), apa.sensor, apa.actuator])
    rows[[AT_PAYLOAD, *range(MOTIONS, MOTIONS + hung)], range(apa.size, apa.size + 1 + hung)] = 1.0
    return rows


def _to_axis(offset: Array, along: float) -> Array:
    """Return the vector (3,) [m] from an APA's interface to the joints' axis at height `along` above its nominal
    place."""
    return np.array([-offset[0], -offset[1], along - offset[2]])
