"""What an experiment does to a unit that is simulated: to its parameters and to its drive.

Turned: the strut goes round by 180 degrees about its axis, with its APA, joints and encoder. In the bench's frame what
lies across the axis changes its sign (where the APA sits and pushes, where head and ruler are and are read) and the
matrices of the APA turn; what lies along z stays. The bench knows no x and y: granite that does not move, a payload
guided along z, a mode of the bench along z ([STB] 3.1, 6.1). Seen from the strut nothing has changed, so every response
stays what it was, whatever is wrong with the strut: what changes is the bench's, or the mounting's.
"""

from checks.errors import ModelError
from checks.gap.conditions.kinds import ADDED_MASS, DRIVE_LEVEL, OTHER_RESISTOR, TURNED, ExperimentKind
from checks.model.electrical import highpass_corner
from checks.model.model import Model

PAYLOAD, CORNER = "bench.payload_kg", "sensor.highpass_Hz"
SENSOR_F = 5.1e-6  # of the sensor stack, where nothing else is known ([STB] 3.1.9)


def under(model: Model, kind: ExperimentKind, value: float | None, sensor_F: float = SENSOR_F) -> Model:
    """A model of a unit as it is under an experiment; the drive's level is none of its parameters. Raises
    ModelError."""
    if kind is TURNED:
        return model
    if value is None:
        raise ModelError(f"experiment '{kind.name}' is given without its value")
    if kind is ADDED_MASS:
        return model.with_values({PAYLOAD: model.values[PAYLOAD] + value})
    if kind is OTHER_RESISTOR:
        return model.with_values({CORNER: highpass_corner(value, sensor_F)})
    return model


def drive(kind: ExperimentKind, value: float | None) -> float:
    """Factor on the drive of every record."""
    return value if kind is DRIVE_LEVEL and value is not None else 1.0
