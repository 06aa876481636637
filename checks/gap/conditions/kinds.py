"""The experiments that a unit's folder can hold: what is changed at the bench, and by how much."""

from dataclasses import dataclass

from checks.declare import Scalar


@dataclass(frozen=True)
class ExperimentKind:
    """value: the number that goes with it, or None; words: what was done, with the number in braces."""

    name: str
    value: Scalar | None
    words: str

    def said(self, value: float | None) -> str:
        """Return the sentence that describes the experiment, with its value."""
        return self.words.format(value)

    def drive_factor(self, value: float | None) -> float:
        """Return the factor on the drive of every record."""
        return value if self is DRIVE_LEVEL and value is not None else 1.0


ADDED_MASS = ExperimentKind(
    "added_mass", Scalar("mass_kg", "mass added to the payload", lo=1e-3, hi=100.0), "{:g} kg added to the payload"
)
DRIVE_LEVEL = ExperimentKind(
    "drive_level", Scalar("level", "drive, as a part of the usual one", lo=0.01, hi=20.0), "{:g} times the drive level"
)
OTHER_RESISTOR = ExperimentKind(
    "other_resistor",
    Scalar("resistor_ohm", "resistor across the sensor stack", lo=0.1, hi=1e9),
    "{:g} ohm across the sensor stack",
)
TURNED = ExperimentKind("turned", None, "the strut turned by 180 degrees about its axis")

EXPERIMENT_KINDS = {kind.name: kind for kind in (ADDED_MASS, DRIVE_LEVEL, OTHER_RESISTOR, TURNED)}
