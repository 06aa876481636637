"""The figures that an APA is judged by, computed from its superelement."""

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.model import Superelement
from checks.model.structure.rigid_motion import rigid_motions
from checks.model.structure.superelement import DOFS

MOTIONS = ("ux", "uy", "uz", "rx", "ry", "rz")
CLAMPED_MODES = 7  # to 3.3 kHz
FREE_MODES = 5  # to 3.5 kHz


def figures(s: Superelement) -> dict[str, float]:
    """Return the figures that an APA is judged by, by name, SI.

    mass, inertia_x..z about the origin; compliance_ux..rz of the top with the bottom clamped [m/N, rad/(N m)], and
    coupling_ux_ry, coupling_uy_rx of it [rad/N]; stiffness_sensor, stiffness_actuator [N/m] felt by a pair of forces
    on the stacks' nodes; stroke_sensor, stroke_actuator: motion of the top along z per elongation of the stacks under
    that pair; push_sensor, push_actuator [m/N]: the same per force of the pair; crosstalk_free, crosstalk_blocked
    [m/N]: elongation of one per force pair on the other, with the top free and with its z held (what Vs is below and
    above the axial resonance); clamped_i, free_i [Hz]: modes with the bottom clamped, elastic modes of the free body.
    """
    R = rigid_motions(s.xyz, s.size)
    body = R.T @ s.M @ R
    out = {"mass": body[0, 0], **{f"inertia_{a}": body[3 + i, 3 + i] for i, a in enumerate("xyz")}}
    out |= _static(s)
    held = np.setdiff1d(np.arange(s.size), np.arange(s.size)[s.dofs(s.nodes.bottom)])
    clamped = _frequencies(s.K[np.ix_(held, held)], s.M[np.ix_(held, held)])
    free = _frequencies(s.K, s.M)[DOFS:]
    out |= {f"clamped_{i}": f for i, f in enumerate(clamped[:CLAMPED_MODES])}
    return {k: float(v) for k, v in (out | {f"free_{i}": f for i, f in enumerate(free[:FREE_MODES])}).items()}


def _static(s: Superelement) -> dict[str, float]:
    held = np.setdiff1d(np.arange(s.size), np.arange(s.size)[s.dofs(s.nodes.bottom)])
    loads = np.column_stack([s.rows(s.nodes.top).T, s.elongation(s.nodes.sensor), s.elongation(s.nodes.actuator)])[held]
    C = loads.T @ linalg.solve(s.K[np.ix_(held, held)], loads, assume_a="sym")
    sensor, actuator = 6, 7
    return {
        **{f"compliance_{name}": C[i, i] for i, name in enumerate(MOTIONS)},
        "coupling_ux_ry": C[0, 4],
        "coupling_uy_rx": C[1, 3],
        "stiffness_sensor": 1.0 / C[sensor, sensor],
        "stiffness_actuator": 1.0 / C[actuator, actuator],
        "stroke_sensor": C[2, sensor] / C[sensor, sensor],
        "stroke_actuator": C[2, actuator] / C[actuator, actuator],
        "push_sensor": C[2, sensor],
        "push_actuator": C[2, actuator],
        "crosstalk_free": C[sensor, actuator],
        "crosstalk_blocked": C[sensor, actuator] - C[2, sensor] * C[2, actuator] / C[2, 2],
    }


def _frequencies(K: Array, M: Array) -> Array:
    w2 = linalg.eigh(K, M, eigvals_only=True, subset_by_index=[0, min(len(K), 20) - 1])
    return np.sqrt(np.maximum(w2, 0.0)) / (2 * np.pi)
