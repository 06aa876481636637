"""Names and units of quantities as people read them: units by the name, labels of channels and of a model's values.

The unit of a quantity is the suffix of its name; without a suffix it is SI or dimensionless."""

import math
import re

# Longest suffix first: `k_N_per_um` ends in `_um` too.
_SUFFIXES = {
    "N_s_per_m": "N s/m",
    "Nm_s_per_rad": "N m s/rad",
    "Nm_per_rad": "N m/rad",
    "N_per_um": "N/um",
    "um_per_V": "um/V",
    "N_per_V": "N/V",
    "V_per_m": "V/m",
    "V_per_N": "V/N",
    "kg_m2": "kg m2",
    "V_per_V": "V/V",
    "percent": "percent",
    "samples": "samples",
    "urad": "urad",
    "ohm": "ohm",
    "deg": "deg",
    "um": "um",
    "mm": "mm",
    "uF": "uF",
    "Hz": "Hz",
    "kg": "kg",
    "us": "us",
    "dB": "dB",
    "V": "V",
    "s": "s",
}
DIMENSIONLESS = "1"


def unit_of(quantity: str) -> str:
    """Return unit of a quantity by its name: `k_closed_N_per_um` is in "N/um", `coherence` in "1"."""
    for suffix, unit in _SUFFIXES.items():
        if quantity == suffix or quantity.endswith("_" + suffix):
            return unit
    return DIMENSIONLESS


def without_unit(quantity: str) -> str:
    """Return the name without its unit: `k_closed` of `k_closed_N_per_um`; a name that is a unit alone stays."""
    for suffix in _SUFFIXES:
        if quantity.endswith("_" + suffix):
            return quantity.removesuffix("_" + suffix)
    return quantity


PREFIXES = {"p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6, "G": 1e9}
BASES = frozenset({"F", "m", "Hz", "V", "s", "ohm", "N", "g", "rad"})
ALIASES = {"\u03a9": "ohm", "\u2126": "ohm", "Ohm": "ohm", "Ohms": "ohm", "ohms": "ohm"}  # Greek omega, ohm sign
ALIASES |= {"inch": "in"}
WITHOUT_PREFIX = {"in": (0.0254, "m"), "mil": (25.4e-6, "m"), "min": (60.0, "s"), "deg": (math.pi / 180.0, "rad"),
                  "percent": (0.01, "1"), "1": (1.0, "1")}  # fmt: skip
SAME = {"%": "percent", "°": "deg", "": "1", "-": "1", '"': "in"}


_HEADER = re.compile(r"^(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\])]*)\s*[\])]$")


def parse_header(text: str) -> tuple[str, str]:
    """Return name and unit of a column: `de [nm]` and `de (nm)` are ("de", "nm"), `de` is ("de", "")."""
    found = _HEADER.match(text.strip())
    return (found["name"].strip(), found["unit"].strip()) if found else (text.strip(), "")


# Units as other programs spell them.
_WORDS = {"volt": "V", "newton": "N", "meter": "m", "metre": "m", "micron": "um", "hertz": "Hz", "radian": "rad",
          "second": "s"}  # fmt: skip
_PREFIX_WORDS = {"nano": "n", "micro": "u", "milli": "m", "kilo": "k"}
_SPELLED = re.compile(rf"(?P<prefix>{'|'.join(_PREFIX_WORDS)})?(?P<base>{'|'.join(_WORDS)})s?", re.IGNORECASE)
_NO_UNIT = ("-", "none", "n/a", "unknown")  # words in the place of a unit
_PER_TIME = ("s", "s2", "sec", "min")  # a unit that ends so is a velocity or an acceleration


def spelled(unit: str) -> str:
    """Return a unit as a symbol: "Volts" is V, "milliseconds" ms; "" for words such as "none"."""
    unit = unit.strip()
    if unit.lower() == "sec":
        return "s"
    if unit.lower() in _NO_UNIT:
        return ""
    found = _SPELLED.fullmatch(unit)
    return (
        unit
        if found is None
        else _PREFIX_WORDS.get((found["prefix"] or "").lower(), "") + _WORDS[found["base"].lower()]
    )


def plain_unit(text: str) -> str:
    """Return a unit in one way of writing: `m/s^2`, `m/s**2`, `m/s²` and `(m / s2)` are "m/s2"."""
    text = re.sub(r"\*\*|\^", "", text.strip().replace("²", "2").replace("µ", "u").replace("μ", "u"))
    text = re.sub(r"\s*/\s*", "/", text)
    text = re.sub(r"(?<=/)(sec|seconds?)\b", "s", text.replace("/s/s", "/s2"))
    text = re.sub(r"/sec2\b", "/s2", text)
    text = re.sub(r"[A-Za-z]+", lambda word: _WORDS.get(word[0].lower().removesuffix("s"), word[0]), text)
    return text[1:-1].strip() if re.fullmatch(r"\([^()]*\)", text) else text


def split_ratio(text: str) -> tuple[str, str]:
    """Return the unit of a channel and that of its input: `(m/s^2)/N` is ("m/s2", "N"), `m/s2` is ("m/s2", "")."""
    depth, parts = 0, [""]
    for letter in plain_unit(text):
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if letter == "/" and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    parts = [plain_unit(part) for part in parts]
    if len(parts) == 1 or parts[-1] in _PER_TIME:
        return "/".join(parts), ""
    return "/".join(parts[:-1]), parts[-1]


_LOOSE_HEADER = re.compile(r"^(?P<name>\w[\w .-]*?)\s*(?:/|\bin\b|,)\s*(?P<unit>[^\W\d_]\S*|%|°)$")


def parse_column(text: str) -> tuple[str, str]:
    """Return name and unit of a column as `parse_header`, also of `de/nm`, `de in nm` and `de, nm` if the last part is
    a unit."""
    name, unit = parse_header(text)
    found = None if unit else _LOOSE_HEADER.match(name)
    if found is None or not is_unit(found["unit"]) or is_unit(found["name"]):
        return name, unit
    return found["name"].strip(), found["unit"]


class UnitMismatch(ValueError):
    """A unit of another kind than expected."""


def factor(given: str, wanted: str) -> float:
    """Return the factor that converts a number in `given` to `wanted`, both as written: `factor("nF", "uF")` is 1e-3.

    Raises UnitMismatch naming both."""
    given, wanted = (SAME.get(unit, unit) for unit in (given.strip(), wanted))
    if given.lower().replace("µ", "u").replace("μ", "u") == wanted.lower():
        return 1.0
    source, target = _parts(given), _parts(wanted)  # scale and base units of each
    if source is None or target is None or source[1] != target[1]:
        raise UnitMismatch(f"{given} does not fit here; use {wanted}")
    return source[0] / target[0]


def to_si(unit: str) -> tuple[float, str] | None:
    """Return the factor to SI and the SI unit: "nm" is (1e-9, "m"). None for an unknown unit, and for grams."""
    parts = _parts(unit.strip())
    return None if parts is None or "g" in parts[1] else (parts[0], "/".join(parts[1]))


def is_unit(text: str) -> bool:
    """Return whether a text is a unit that is known here."""
    return _parts(SAME.get(text.strip(), text.strip())) is not None


def _parts(unit: str) -> tuple[float, tuple[str, ...]] | None:
    """Return the factor to the base units, and those in order: `N/um` is (1e6, ("N", "m"))."""
    scale, bases = 1.0, []
    for place, word in enumerate(unit.split("/")):
        found = _simple(word.strip())
        if found is None:
            return None
        scale = scale * found[0] if place == 0 else scale / found[0]
        bases.append(found[1])
    return scale, tuple(bases)


def _simple(word: str) -> tuple[float, str] | None:
    word = _plain(word)
    if word in BASES:
        return 1.0, word
    if word in WITHOUT_PREFIX:
        return WITHOUT_PREFIX[word]
    prefix, base = word[:1], _plain(word[1:])
    return (PREFIXES[prefix], base) if prefix in PREFIXES and base in BASES else None


def _plain(word: str) -> str:
    return ALIASES.get(word, word)


RESPONSE_UNITS = {"Vs": "V/V", "de": "m/V", "da": "m/V"}  # of the responses to Va

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

_NAMED = {
    **dict.fromkeys(("k", "ke", "ka", "kx", "ky"), "stiffness"),
    **dict.fromkeys(("kRx", "kRy"), "bending stiffness"),
    **dict.fromkeys(("dx", "dy", "dz"), "offset"),
    **{"kz": "axial stiffness", "kRz": "torsional stiffness", "c": "axial damping", "cR": "bending damping"},
    **{"ga": "actuator constant", "gs": "sensor constant"},
}
_MODEL_VALUES = {symbol: f"{words} {symbol}" for symbol, words in _NAMED.items()}
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
