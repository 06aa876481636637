"""Which measurement would tell two explanations apart: the menu of [GAP] step 11."""

from collections.abc import Iterable
from itertools import combinations

MASS = "repeat with +0.5 kg on the payload: an added mass moves what depends on the payload, nothing else"
LEVEL = "repeat at half the drive level: what is linear stays, hysteresis and saturation change"
DUMMY = "drive a dummy capacitor and read it back: amplifier, converters and delay without the strut"
RESISTOR = "repeat with another resistor across the sensor stack: only the sensor's high-pass moves"
TURN = "turn the strut by 180 degrees about its axis: what belongs to the strut changes sign in de, the bench does not"
POINT = "read a second point with the interferometer: a mode of the bench shows there, one of the encoder does not"
UNPLUG = "unplug the sensor stack at the amplifier and record Vs: what is left is cross-talk"
BARE = "record without the encoder: its mass, scale and bracket are then gone"

_PAIRS: dict[frozenset[str], str] = {
    frozenset({"loop_delay", "amplifier_bandwidth"}): DUMMY,
    frozenset({"payload_mass", "open_circuit_stiffening"}): MASS,
    frozenset({"payload_mass", "joint_axial_compliance"}): MASS,
    frozenset({"encoder_scale", "encoder_bracket_mode"}): POINT,
    frozenset({"misalignment", "encoder_mass"}): TURN,
    frozenset({"misalignment", "encoder_bracket_mode"}): TURN,
    frozenset({"misalignment", "bench_mode"}): TURN,
    frozenset({"crosstalk", "sensor_highpass"}): UNPLUG,
    frozenset({"hysteresis", "creep"}): LEVEL,
}
_SINGLE: tuple[tuple[str, str], ...] = (
    ("payload_mass", MASS),
    ("crosstalk", UNPLUG),
    ("sensor_highpass", RESISTOR),
    ("misalignment", TURN),
    ("bench_mode", POINT),
    ("encoder_mass", BARE),
    ("encoder_scale", POINT),
    ("encoder_bracket_mode", POINT),
    ("amplifier_bandwidth", DUMMY),
    ("loop_delay", DUMMY),
    ("hysteresis", LEVEL),
    ("open_circuit_stiffening", RESISTOR),
    ("joint_axial_compliance", MASS),
)


def experiment(effects: Iterable[str]) -> str:
    """The measurement that separates these effects best: one made for a pair of them, else one that a single one asks
    for."""
    names = tuple(effects)
    for pair in combinations(names, 2):
        if frozenset(pair) in _PAIRS:
            return _PAIRS[frozenset(pair)]
    return next((words for name, words in _SINGLE if name in names), LEVEL)
