"""The APA of two springs and a force: the 2-DoF topology of [STB] 1.1, rigid in every direction but its axis.

    bottom --+-------- k, c --------+-- top
             +-- ka, ca, Fa -- ke, ce --+

Coordinates: the six rigid motions of the bottom, the elongation of the APA, the elongation of ka. No mass of its own.
"""

import numpy as np

from checks.arrays import Array
from checks.model.structure.apa import ApaBody
from checks.model.structure.rigid_motion import lever

_BOTTOM, _APA, _KA = slice(0, 6), 6, 7
_SIZE = 8  # coordinates: six motions of the bottom, the elongation of the shell, that of ka


def two_dof_body(k: float, ke: float, ka: float, c: float, ce: float, ca: float, height: float) -> ApaBody:
    """Return the APA of two degrees of freedom. k, ke, ka [N/m], c, ce, ca [N s/m]; height [m] between the interfaces.

    The stacks lie across the axis: when they push, the APA shrinks. So a positive force pair pulls ka together, and the
    sensor stack is read as the elongation of ke - the signs of a shell, and of ga and gs in [STB] 4.2."""
    top = np.zeros((6, _SIZE))
    top[:, _BOTTOM] = lever((0.0, 0.0, height))
    top[2, _APA] = 1.0
    return ApaBody(
        K=_springs(k, ke, ka),
        M=np.zeros((_SIZE, _SIZE)),
        C_ratio=np.zeros((_SIZE, _SIZE)),
        C=_springs(c, ce, ca),
        bottom=np.eye(_SIZE)[_BOTTOM],
        top=top,
        sensor=_row({_APA: 1.0, _KA: -1.0}),
        actuator=_row({_KA: -1.0}),
        k_sensor=ke,
        k_actuator=ka,
        height=height,
        name="2dof",
    )


def _row(entries: dict[int, float]) -> Array:
    row = np.zeros(_SIZE)
    for i, value in entries.items():
        row[i] = value
    return row


def _springs(shell: float, sensor: float, actuator: float) -> Array:
    """Return the (8, 8) matrix of three springs, or of three dampers."""
    rows = (_row({_APA: 1.0}), _row({_APA: 1.0, _KA: -1.0}), _row({_KA: 1.0}))
    return sum((s * np.outer(r, r) for s, r in zip((shell, sensor, actuator), rows, strict=True)), np.zeros((8, 8)))
