"""What channels and values of a model are called where people read them."""

from specs.units import DIMENSIONLESS, unit_of, without_unit

CHANNEL_LABELS = {
    "t": "time t",
    "Va": "drive Va",
    "Vs": "sensor stack Vs",
    "de": "encoder de",
    "da": "interferometer da",
    "V": "voltage V",
    "d": "gauge d",
    "Track1": "force Track1",
    "Track2": "rotation Track2",
}

_MODEL_VALUES = {
    "kx": "stiffness kx",
    "ky": "stiffness ky",
    "kz": "axial stiffness kz",
    "kRx": "bending stiffness kRx",
    "kRy": "bending stiffness kRy",
    "kRz": "torsional stiffness kRz",
    "ga": "actuator constant ga",
    "gs": "sensor constant gs",
    "dx": "offset dx",
    "dy": "offset dy",
    "dz": "offset dz",
    "c": "axial damping c",
    "cR": "bending damping cR",
    "k": "stiffness k",
    "ke": "stiffness ke",
    "ka": "stiffness ka",
}
_PLACES = {"apa": "APA", "constants": "APA", "joint": "joints"}


def label_from_name(quantity: str) -> str:
    """Return words for a quantity by its name: `insulation_ohm` is "Insulation"."""
    words = without_unit(quantity).replace("_", " ").strip() or quantity
    return words[0].upper() + words[1:]


def model_label(name: str) -> str:
    """Return words for a value of a model by its flat name: `joint.kRx_Nm_per_rad` is "joints: bending stiffness kRx",
    `apa.mode_stiffness_12` "APA: mode stiffness 12"."""
    *places, value = name.split(".")
    words = without_unit(value).replace("_", " ")
    where = _PLACES.get(".".join(places)) or " ".join(reversed(places)).replace("_", " ")
    return f"{where}: {_MODEL_VALUES.get(words, words)}" if where else _MODEL_VALUES.get(words, words)


def with_unit(words: str, name: str) -> str:
    """Return a number, or a number and its uncertainty, with the unit that a name ends in; a pure number has none."""
    unit = unit_of(name.rpartition(".")[2])
    return words if unit == DIMENSIONLESS else f"{words} {unit}"
