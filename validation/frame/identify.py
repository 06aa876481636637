"""Identification of the frame's effective dimensions on a finite-element superelement of the same APA."""

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from checks.arrays import Array
from checks.errors import ModelError
from checks.model import Superelement
from checks.model.structure.frame import frame_apa
from checks.model.structure.frame_geometry import FrameGeometry
from validation.frame.figures import figures

PULL = 2e-2  # of the relative change of a dimension, against relative errors of the figures
# Weights: what places the axial resonance, what else a strut's response below 1 kHz depends on, the rest.
AXIAL, HEAVY, LIGHT = 9.0, 3.0, 1.0
_HEAVY = (
    "mass",
    "compliance_",
    "coupling_",
    "stroke_",
    "stiffness_",
    "crosstalk_",
    *(f"clamped_{i}" for i in range(3)),
)


def identify(
    reference: Superelement, start: FrameGeometry, max_steps: int = 60
) -> tuple[FrameGeometry, dict[str, float]]:
    """Return the geometry whose figures come closest to the reference's, and the relative error left in each figure.

    Least squares on log ratios over the fourteen effective dimensions, from `start`, with a weak pull (2 % per 100 %)
    towards it, since the figures leave some directions (the sides of a box) nearly open.
    Raises ModelError if a figure of the reference has the opposite sign to the start's.
    """
    target = figures(reference)
    first = figures(frame_apa(start))
    for name, value in first.items():
        if not value * target[name] > 0:
            raise ModelError(
                f"{reference.name}: {name} is {target[name]:.4g}, the frame gives {value:.4g}: not the same APA"
            )
    weight = np.array([_weight(name) for name in target])
    centre = effective(start)

    def residuals(x: Array) -> Array:
        got = figures(frame_apa(with_effective(start, centre * np.exp(x))))
        ratio = np.array([max(got[name] / target[name], 1e-3) for name in target])
        return np.concatenate([weight * np.log(ratio), PULL * x])

    # Steps of 1e-4: round-off of the free-free modes makes smaller differences noisy.
    found = least_squares(residuals, np.zeros(centre.size), max_nfev=max_steps, diff_step=1e-4, x_scale=0.1)
    geometry = with_effective(start, centre * np.exp(found.x))
    got = figures(frame_apa(geometry))
    return geometry, {name: got[name] / target[name] - 1.0 for name in target}


def _weight(figure: str) -> float:
    if figure == "compliance_uz":
        return AXIAL
    return HEAVY if figure.startswith(_HEAVY) else LIGHT


def effective(g: FrameGeometry) -> Array:
    """Return the identified dimensions (14,) in the order in which `with_effective` takes them."""
    return np.array(
        [
            g.ceramic.E,
            g.arm_root_z,
            g.arm_foot_z,
            *g.arm_thickness,
            g.arm_width,
            g.arm_rise,
            *g.end.box,
            *g.end.neck,
            g.top.box[2],
            g.top.neck[1],
        ]
    )


def with_effective(g: FrameGeometry, values: Array) -> FrameGeometry:
    """Return the geometry with other effective dimensions (14,)."""
    E, root_z, foot_z, t_root, t_foot, width, rise, *blocks = (float(v) for v in values)
    end_x, end_y, end_z, end_width, end_height, top_z, neck = blocks
    return replace(
        g,
        ceramic=replace(g.ceramic, E=E),
        arm_root_z=root_z,
        arm_foot_z=foot_z,
        arm_thickness=(t_root, t_foot),
        arm_width=width,
        arm_rise=rise,
        end=replace(g.end, box=(end_x, end_y, end_z), neck=(end_width, end_height)),
        top=replace(g.top, box=(*g.top.box[:2], top_z), neck=(g.top.neck[0], neck)),
    )
