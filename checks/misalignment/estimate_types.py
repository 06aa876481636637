"""Result of an estimate of the misalignment."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from checks.cause import Reason
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.model.model import Model
from checks.rounding import with_U

DX, DY = "misalignment.dx_um", "misalignment.dy_um"
LOPSIDED = ("apa.lopsided_x_um", "apa.lopsided_y_um")  # along x, along y


@dataclass(frozen=True)
class AxisOffset:
    """Misalignment along one axis with its expanded uncertainty (k = 2), both in um."""

    value: float
    U: float


@dataclass(frozen=True, eq=False)
class MisalignmentEstimate:
    """Estimate of the misalignment. dx, dy: the best fit; reason: why it is not an answer, or None; model: with the
    fitted damping; fit: its calibration, with the drive's parameters; others: other places (dx, dy) [um] that explain
    the data alike; data: the fitted responses, repeat: the second realisation, not fitted, or None; meaning: what dx
    and dy are, in words; notes: the effects that the estimate neglects; unknown: "dx" or "dy" and why the data do not
    determine it, if they determine the other one."""

    dx: AxisOffset
    dy: AxisOffset
    model: Model
    fit: Fit
    others: tuple[tuple[float, float], ...]
    data: Dataset
    repeat: Dataset | None
    meaning: str
    reason: Reason | None = None
    notes: tuple[str, ...] = ()
    unknown: Mapping[str, Reason] = field(default_factory=dict)

    @property
    def why(self) -> Reason | None:
        """Return the reason why dx or dy is missing, None if both are known."""
        return self.reason or next(iter(self.unknown.values()), None)

    def answer(self, axis: str) -> AxisOffset | None:
        """Return the misalignment along "dx" or "dy", None if it is unknown."""
        return None if self.reason is not None or axis in self.unknown else getattr(self, axis)

    def __repr__(self) -> str:
        if self.reason is not None:
            return f"MisalignmentEstimate(no result: {self.reason})"
        answers = {axis: self.answer(axis) for axis in ("dx", "dy")}
        shown = ", ".join(
            f"{n} unknown" if a is None else f"{n} = {with_U(a.value, a.U)} um" for n, a in answers.items()
        )
        return f"MisalignmentEstimate({shown}; k = 2)"
