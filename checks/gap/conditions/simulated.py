"""What an experiment does to a unit that is simulated: to its parameters and to its drive.

Turned: the strut goes round by 180 degrees about its axis, with its APA, joints and encoder. In the bench's frame what
lies across the axis changes its sign (where the APA sits and pushes, where head and ruler are and are read) and the
matrices of the APA turn; what lies along z stays. The bench knows no x and y: granite that does not move, a payload
guided along z, a mode of the bench along z ([STB] 3.1, 6.1). Seen from the strut nothing has changed, so every response
stays what it was, whatever is wrong with the strut: what changes is the bench's, or the mounting's.

Another resistor across the sensor stack: its corner goes with one over it ([STB] 3.1.9). A stack that is stiffer
without a path for its charge ([IEEE176] 2) is open if the corner lies below the band, and closed far above it.
"""

from checks.errors import ModelError
from checks.gap.conditions.kinds import ADDED_MASS, OTHER_RESISTOR, TURNED, ExperimentKind
from checks.model.electrical import highpass_corner
from checks.model.model import Model

PAYLOAD, CORNER, STIFFENING = "bench.payload_kg", "sensor.highpass_Hz", "apa.sensor_stiffening"
OPEN_HZ, CLOSED_HZ = 2.0, 20_000.0  # corners of a stack that is open, closed, at 5 Hz to 2 kHz
SENSOR_F = 5.1e-6  # of the sensor stack, the default ([STB] 3.1.9)


def under_experiment(model: Model, kind: ExperimentKind, value: float | None, sensor_F: float | None = None) -> Model:
    """Return a model of a unit as it is under an experiment; the drive's level is not a parameter of it. sensor_F: of
    the sensor stack, if it was measured. Raises ModelError."""
    if kind is TURNED:
        return model
    if value is None:
        raise ModelError(f"experiment '{kind.name}' is given without its value")
    if kind is ADDED_MASS:
        return model.with_values({PAYLOAD: model.values[PAYLOAD] + value})
    if kind is OTHER_RESISTOR:
        corner = highpass_corner(value, SENSOR_F if sensor_F is None else sensor_F)
        stiffer = model.values[STIFFENING]
        return model.with_values({CORNER: corner, STIFFENING: stiffer and stiffer * share_open(corner)})
    return model


def share_open(corner_Hz: float) -> float:
    """Return the share of the open circuit's stiffening that remains at a corner [Hz]: 0 or 1. Raises ModelError in
    between, if the stack is neither open nor closed over the band."""
    if OPEN_HZ < corner_Hz < CLOSED_HZ:
        raise ModelError(
            f"a resistor that puts the sensor stack's corner at {corner_Hz:.3g} Hz leaves a stack that is stiffer when "
            f"open neither open nor closed; expected a corner up to {OPEN_HZ:g} Hz, or from {CLOSED_HZ:g} Hz on"
        )
    return 1.0 if corner_Hz <= OPEN_HZ else 0.0
