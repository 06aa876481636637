"""Base of instruments that read a length: settings, agreement of readings, resolution, plausible range."""

from typing import Annotated, TypeVar

from pydantic import Field

from hw.errors import Implausible
from hw.instruments.reading import Reading
from hw.instruments.serial_instrument import SerialInstrument, SerialSettings
from specs.strict import Positive

METRES = {"mm": 1e-3, "in": 25.4e-3, "um": 1e-6}


class LengthSettings(SerialSettings):
    """range_mm : plausible readings. agreement_um : how far two answers in a row may differ. resolution_um : the
    coarsest last digit."""

    range_mm: Annotated[list[float], Field(min_length=2, max_length=2)]
    agreement_um: Positive = 0.5
    resolution_um: Positive = 1.0

    def plausible(self, who: str, line: bytes, metres: float) -> float:
        """Return the length if it is within the range. Raises Implausible."""
        lo, hi = self.range_mm
        if not lo <= metres * 1e3 <= hi:
            raise Implausible(f"{who}: {line!r} is outside {lo:g} to {hi:g} mm, the range in the bench file")
        return metres

    def fine_enough(self, who: str, line: bytes, unit: str, decimals: int) -> None:
        """Raise Implausible if the last digit of the display is coarser than `resolution_um`."""
        step_um = METRES[unit] * 1e6 * 10.0**-decimals
        if step_um > self.resolution_um * (1 + 1e-9):
            raise Implausible(
                f"{who}: {line!r} shows steps of {step_um:g} um, the bench file allows {self.resolution_um:g} um; "
                "set the display to a finer resolution"
            )


L = TypeVar("L", bound=LengthSettings)


class LengthInstrument(SerialInstrument[L]):
    """A driver whose readings are lengths [m]."""

    unit = "m"

    def _within(self, _: Reading) -> float:
        return self.settings.agreement_um * 1e-6
