"""The experiments that a unit's folder can hold: what is changed at the bench, and by how much."""

from dataclasses import dataclass

from checks.declare import Scalar
from checks.model.structure.attached import SIDES


@dataclass(frozen=True)
class ExperimentKind:
    """A kind of second measurement. value: the number that goes with it, or None; words: what was done, with the number
    in braces; place: of the strut, where a mass is put or from which whatever is attached is removed; why: what it
    shows; sizes: that are proposed, None for a kind without a number."""

    name: str
    value: Scalar | None
    words: str
    place: str = ""
    why: str = ""
    sizes: tuple[float | None, ...] = ()

    def said(self, value: float | None) -> str:
        """Return the sentence that describes the experiment, with its value."""
        return self.words.format(value)

    def drive_factor(self, value: float | None) -> float:
        """Return the factor on the drive of every record."""
        return value if self is DRIVE_LEVEL and value is not None else 1.0


MASS = Scalar("mass_kg", "mass added to the payload or to the strut", lo=1e-3, hi=100.0)
LEVEL = Scalar("level", "drive, as a part of the usual one", lo=0.01, hi=20.0)
OHM = Scalar("resistor_ohm", "resistor across the sensor stack", lo=0.1, hi=1e9)
ADDED_MASS = ExperimentKind(
    "added_mass",
    MASS,
    "{:g} kg added to the payload",
    why="an added mass moves what depends on the payload, nothing else",
    sizes=(0.5, 1.0, 2.0, 5.0),
)
OTHER_RESISTOR = ExperimentKind(
    "other_resistor",
    OHM,
    "{:g} ohm across the sensor stack",
    why="only the sensor's circuit changes",
    sizes=(20_000.0, 1.0),
)
OWN_RETURN = ExperimentKind(
    "own_return",
    None,
    "a cable with a return wire of its own for the sensor stack",
    why="what couples into its cable is then gone",
    sizes=(None,),
)
PARTS = {
    "payload": "payload",
    "top_interface": "top interface",
    "bottom_interface": "bottom interface",
    "head": "encoder's head",
    "ruler": "ruler",
    "apa": "APA from its top to its bottom interface",
}
GONE = "an element there is then gone, all else stays"
REMOVED = tuple(
    ExperimentKind(
        f"removed_from_{place}", None, f"whatever touches or hangs on the {part} removed", place, GONE, (None,)
    )
    for place, part in PARTS.items()
)
SIDE_MASSES = tuple(
    ExperimentKind(
        name=f"mass_on_{end}_interface{side}",
        value=MASS,
        words=f"{{:g}} kg at the {end} interface, 30 mm from the axis on the side of {side}",
        place=f"{end}_interface{side}",
        why="it moves the modes that turn or bend there, each by its own part",
        sizes=(0.2, 0.5),
    )
    for end in ("top", "bottom")
    for side in SIDES
)
DRIVE_LEVEL = ExperimentKind("drive_level", LEVEL, "{:g} times the drive level")
TURNED = ExperimentKind("turned", None, "the strut turned by 180 degrees about its axis")
# In the order in which they are proposed if they separate as well: the least troublesome first.
EVERY = (ADDED_MASS, DRIVE_LEVEL, OTHER_RESISTOR, TURNED, OWN_RETURN, *REMOVED, *SIDE_MASSES)
EXPERIMENT_KINDS = {kind.name: kind for kind in EVERY}
