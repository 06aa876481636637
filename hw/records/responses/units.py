"""Units that files of responses state: of frequencies, of ratios, of coherence and variance."""

import re

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from specs.units import UnitMismatch, factor, plain_unit

TAU = 2.0 * np.pi
TIME_UNITS = {
    "nanosecond": 1e-9, "microsecond": 1e-6, "millisecond": 1e-3, "second": 1.0, "minute": 60.0, "hour": 3600.0,
    "day": 86400.0, "week": 604800.0,
    "ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "sec": 1.0, "min": 60.0, "h": 3600.0,
}  # fmt: skip
HERTZ = {"hz": 1.0, "khz": 1e3, "ghz": 1e9, "hertz": 1.0, "cps": 1.0, "rpm": 1 / 60, "cpm": 1 / 60, "1/min": 1 / 60,
         "u/min": 1 / 60, "rev/min": 1 / 60, "r/min": 1 / 60}  # fmt: skip
TURNS = {"rad": 1.0 / TAU, "cycles": 1.0, "cycle": 1.0, "rev": 1.0}
ANGULAR = ("w", "omega")  # of no use without a unit: radians per second, or per sample
_AXIS = re.compile(
    r"^(?:(?:f|fre?qs?|frequency|frequencies|frequenz)(?:_?(?:vec|vector|axis|domain|range|list))?|hz|w|omega)"
    r"(?:_(?P<unit>hz|khz|mhz|ghz|rpm|rad_s|rad_per_s|rads))?$",
    re.IGNORECASE,
)
LARGEST_ROUNDING = 1e-5  # of a coherence in single precision above 1
EXPECTED = "expected Hz, kHz, MHz, GHz, rad/s or rpm"


def hertz(file: str, name: str, unit: str, time_unit: str = "") -> float:
    """Return the factor from a unit of frequency to Hz. time_unit: the file's "TimeUnit", seconds if empty. Raises
    RecordError for another unit."""
    plain = plain_unit(unit)
    if plain.lower() in HERTZ:
        return HERTZ[plain.lower()]
    head, _, per = plain.partition("/")
    if head.lower() in TURNS and per:
        word = (time_unit or "seconds") if per.lower() == "timeunit" else per
        seconds = TIME_UNITS.get(word.lower()) or TIME_UNITS.get(word.lower().removesuffix("s"))
        if seconds is None:
            raise RecordError(f"{file}: {name} is in {unit}, and its unit of time is '{word}'; {EXPECTED}")
        return TURNS[head.lower()] / seconds
    try:
        return factor(plain, "Hz")
    except UnitMismatch as e:
        raise RecordError(f"{file}: {name} is in {unit}; {EXPECTED}") from e


def is_frequency_unit(unit: str) -> bool:
    """Return whether a unit is one of frequencies."""
    try:
        hertz("", "", unit)
    except RecordError:
        return False
    return bool(unit)


def axis_unit(name: str) -> str | None:
    """Return the unit in the name of a frequency axis, "" without one; None for another axis."""
    found = _AXIS.match(name)
    if found is None:
        return None
    unit = found["unit"] or ""
    return "rad/s" if unit.lower().startswith("rad") else unit


def converted(name: str, unit: str) -> list[str]:
    """Return the words on a conversion of frequencies."""
    return [f"{name} in {unit} converted to Hz"] if unit and plain_unit(unit) != "Hz" else []


def fraction(file: str, name: str, values: Array, unit: str) -> tuple[Array, list[str]]:
    """Return a coherence (F,) in 0..1, NaN if not stated, and the words on its conversion. Raises RecordError
    for values outside, and for dB: 10 or 20 lg are both in use."""
    plain = unit.strip().lower()
    if "db" in plain:
        raise RecordError(
            f"{file}: {name} is in dB, which may be 10 or 20 lg of it; write it as a number from 0 to 1 or in [%]"
        )
    if plain not in ("", "-", "1", "%", "percent"):
        raise RecordError(f"{file}: {name} is in {unit}; expected a number from 0 to 1, or [%]")
    percent = plain in ("%", "percent")
    x = values / 100.0 if percent else values
    known = x[np.isfinite(x)]
    if np.isinf(x).any() or (known.size and not (known.min() >= 0.0 and known.max() <= 1.0 + LARGEST_ROUNDING)):
        lowest, highest = float(values[np.isfinite(values)].min()), float(values[np.isfinite(values)].max())
        hint = "; is it in percent? write [%] behind its name" if not percent and 1.0 < highest <= 100.0 else ""
        hint = "; is it in dB? write it as a number from 0 to 1" if lowest < 0.0 else hint
        most = "100 %" if percent else "1"
        raise RecordError(f"{file}: {name} runs from {lowest:.6g} to {highest:.6g}, expected 0 to {most}{hint}")
    return np.minimum(x, 1.0), [f"{name} in % converted"] if percent else []


def variance(file: str, name: str, values: Array, unit: str, of: tuple[str, str]) -> tuple[Array, list[str]]:
    """Return a variance (F,) in the squared unit of its response, NaN if not stated, and the words on its
    conversion. of: units of channel and input. Raises RecordError if it is negative or of another unit."""
    if (values < 0.0).any():
        low = float(np.nanmin(values))
        raise RecordError(
            f"{file}: {name} has {low:.6g}; a variance is not negative: write the squared standard deviation"
        )
    if np.isinf(values).any():
        raise RecordError(
            f"{file}: {name} is infinite at {int(np.isinf(values).sum())} frequencies; leave those rows out"
        )
    wanted = "/".join(part for part in of if part)
    if not unit.strip():
        return values, [f"{name} taken in ({wanted})^2"] if wanted and not np.isnan(values).all() else []
    plain = plain_unit(unit)
    squared = re.fullmatch(r"\((.*)\)2", plain)
    root = plain_unit(squared[1]) if squared else _root(plain)
    if root is None or not wanted:
        raise RecordError(f"{file}: {name} is in {unit}; expected the square of {wanted or 'a unit that H states'}")
    try:
        scale = 1.0 if root == wanted else factor(root, wanted)
    except UnitMismatch as e:
        raise RecordError(f"{file}: {name} is in {unit}; expected the square of {wanted}") from e
    return values * scale**2, [f"{name} in {unit} converted to ({wanted})^2"] if scale != 1.0 else []


def _root(unit: str) -> str | None:
    """Return `um/V` of `um2/V2`, None if a part is no square."""
    parts = unit.split("/")
    return (
        "/".join(part[:-1] for part in parts) if all(part.endswith("2") and len(part) > 1 for part in parts) else None
    )
