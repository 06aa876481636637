"""What an APA does by itself that looks like a misalignment: lopsided, it bends a strut with its axis on the joints'.

The force that its stacks put into a bending mode is a + b d, d the misalignment: zero at d = -a / b, not at zero. How
large b is, and how large a, a rough model knows to its tolerance only; the latter shifts whatever is read from that
mode by the tolerance times a / b. A row of sensor, spacer and two stacks is lopsided along x, nothing of it along y.
"""

import numpy as np

from checks.arrays import Array
from checks.misalignment.estimate_types import DX, DY
from checks.model.dynamics.real_modes import real_modes
from checks.model.model import Model

STEP_UM = 20.0
FROM_HZ, TO_HZ = 60.0, 700.0  # where a misalignment shows
DRIVEN = 0.1  # of the mode that a misalignment drives most: less is the coupling of other modes
CENTRED = ("encoder.com_x_mm", "encoder.com_y_mm")  # a misplaced encoder has priors of its own


def own_offsets(model: Model) -> tuple[float, float]:
    """|a / b| [um] along x and along y, each of the mode that tells most of a misalignment: the one whose force changes
    by the largest part. Raises ModelError for a model with coordinates that have no mass."""
    straight = model.with_values({n: 0.0 for n in (*CENTRED, DX, DY) if n in model.values})
    return _own_offset(straight, DX), _own_offset(straight, DY)


def _own_offset(model: Model, name: str) -> float:
    system = model.system()
    w2, shapes = real_modes(system)
    ends = [_forces(model, name, d, system.M @ shapes) for d in (-STEP_UM, STEP_UM)]
    slope, own = (ends[1] - ends[0]) / (2.0 * STEP_UM), shapes.T @ system.force
    f = np.sqrt(w2) / (2.0 * np.pi)
    size = np.where((f > FROM_HZ) & (f < TO_HZ), np.abs(slope), 0.0)
    driven = size > DRIVEN * size.max()
    return float(np.min(np.abs(own[driven] / slope[driven])))


def _forces(model: Model, name: str, d_um: float, momenta: Array) -> Array:
    """(n,) of the stacks in each mode at a misalignment; a shape has the sign of the one that it has become of."""
    system = model.system({name: d_um})
    shapes = real_modes(system)[1]
    return np.asarray(np.sign(np.einsum("ni,ni->i", shapes, momenta)) * (shapes.T @ system.force))
