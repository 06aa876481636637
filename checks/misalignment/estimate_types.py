"""What an estimate of the misalignment says."""

from dataclasses import dataclass

from checks.cause import Reason
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.model.model import Model
from checks.rounding import with_U

DX, DY = "misalignment.dx_um", "misalignment.dy_um"
LOPSIDED = ("apa.lopsided_x_um", "apa.lopsided_y_um")  # along x, along y


@dataclass(frozen=True)
class Along:
    """Misalignment along one axis with its expanded uncertainty (k = 2), both in um."""

    value: float
    U: float


@dataclass(frozen=True, eq=False)
class MisalignmentEstimate:
    """dx, dy: what fits best. reason: why that is no answer, or None. model: with the fitted damping; fit: of it, with
    the drive's parameters; others: other places (dx, dy) [um] that explain the data alike; data:
    what was fitted, repeat: what was not, or None; meaning: what dx and dy are, in words."""

    dx: Along
    dy: Along
    model: Model
    fit: Fit
    others: tuple[tuple[float, float], ...]
    data: Dataset
    repeat: Dataset | None
    meaning: str
    reason: Reason | None = None

    def __repr__(self) -> str:
        if self.reason is not None:
            return f"MisalignmentEstimate(no result: {self.reason})"
        dx, dy = (with_U(along.value, along.U) for along in (self.dx, self.dy))
        return f"MisalignmentEstimate(dx = {dx} um, dy = {dy} um; k = 2)"
