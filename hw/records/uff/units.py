"""Units of a data set 58: by label, else by specific data type, exponents and data set 164, which must agree."""

import re
from typing import NamedTuple

import numpy as np

from checks.errors import RecordError
from hw.records.uff.set58 import Axis, UffFunction, UnitSystem
from specs.units import UnitMismatch, factor, plain_unit, split_ratio

# Specific data type: what it is, its exponents of length and force, its SI unit.
KINDS = {
    2: ("stress", (-2, 1), "Pa"),
    3: ("strain", (0, 0), "m/m"),
    5: ("temperature", (0, 0), "K"),
    6: ("heat flux", (-1, 1), "W/m2"),
    8: ("displacement", (1, 0), "m"),
    9: ("force", (0, 1), "N"),
    11: ("velocity", (1, 0), "m/s"),
    12: ("acceleration", (1, 0), "m/s2"),
    13: ("force", (0, 1), "N"),
    15: ("pressure", (-2, 1), "Pa"),
    16: ("mass", (-1, 1), "kg"),
    17: ("time", (0, 0), "s"),
    18: ("frequency", (0, 0), "Hz"),
    19: ("rotation speed", (0, 0), "rpm"),
    20: ("order", (0, 0), "order"),
}
TURNING = {"m": "rad", "m/s": "rad/s", "m/s2": "rad/s2", "N": "N m"}  # the same type about an axis
BY_NAME = {name: unit for name, _, unit in KINDS.values()} | {"voltage": "V"}
SPECIAL = {"g": "acceleration", "gn": "acceleration", "g's": "acceleration", "rpm": "rotation speed"}
LENGTHS = {"in": 0.0254, "inch": 0.0254, "ft": 0.3048, "mil": 25.4e-6, "cm": 0.01, "g": 9.80665, "gn": 9.80665}
FORCES = {"lbf": 4.4482216152605, "kgf": 9.80665}


class AxisUnit(NamedTuple):
    """The unit of an axis. unit: of the values times scale, "" if not stated; said: the conversion in words."""

    unit: str
    scale: float
    said: str = ""


def kind_of(unit: str) -> str:
    """Return the quantity that a plain unit measures, "" if unknown."""
    if unit in SPECIAL or not unit:
        return SPECIAL.get(unit, "")
    head, _, per = unit.partition("/")
    if per in ("s", "s2"):
        kind = {"s": "velocity", "s2": "acceleration"}[per]
        return kind if head in LENGTHS or _fits(head, "m") or _fits(head, "rad") else ""
    if head in LENGTHS and not per:
        return "displacement"
    if unit in FORCES:
        return "force"
    wanted = {"m": "displacement", "N": "force", "V": "voltage", "s": "time", "Hz": "frequency", "rad": "displacement"}
    return next((kind for each, kind in wanted.items() if _fits(unit, each)), "")


def _fits(unit: str, wanted: str) -> bool:
    try:
        factor(unit, wanted)
    except UnitMismatch:
        return False
    return True


def ordinate_unit(file: str, f: UffFunction, axis: Axis, of: str) -> AxisUnit:
    """Return the unit of an ordinate or its denominator, and the scale of its values. of: its name in messages.

    A voltage has no data type in this format: its label decides, whatever the type. Raises RecordError for statements
    that contradict each other."""
    typed, exponents, si = KINDS.get(axis.kind, ("", (0, 0), ""))
    unit = plain_unit(axis.unit)
    word = axis.label.lower() if axis.label.lower() in BY_NAME else ""
    labelled = kind_of(unit)
    stated = {
        f"unit label {axis.unit}": labelled,
        f"axis label {axis.label}": word,
        f"data type {axis.kind} ({typed})": "" if "voltage" in (labelled, word) else typed,
    }
    kinds = {what: kind for what, kind in stated.items() if kind}
    if len(set(kinds.values())) > 1:
        raise RecordError(f"{file}: {of}: {' and '.join(kinds)} contradict each other; correct its records 8 to 10")
    if unit:
        for part in split_ratio(unit):
            _vet_label(file, f.system, part, kind_of(part), of)
        return AxisUnit(unit, 1.0)
    kind = next(iter(kinds.values()), "")
    if kind == "voltage":
        return AxisUnit("V", 1.0)
    if kind and not typed:
        typed, exponents, si = next(each for each in KINDS.values() if each[0] == kind)
    return _by_type(file, f.system, axis, (typed, exponents, si), of)


def _vet_label(file: str, system: UnitSystem | None, unit: str, kind: str, of: str) -> None:
    """Raise RecordError if data set 164 states another unit of length or force than a label."""
    if system is None:
        return
    head = unit.partition("/")[0]
    if kind in ("displacement", "velocity", "acceleration") and not _fits(head, "rad"):
        scale, theirs = LENGTHS.get(head) or factor(head, "m"), system.length
    elif kind == "force":
        scale, theirs = FORCES.get(unit) or factor(unit, "N"), system.force
    else:
        return
    if not np.isclose(scale, theirs, rtol=1e-3, atol=0.0):
        raise RecordError(
            f"{file}: {of}: its unit label is {unit}, and data set 164 has {system.name}; correct one of them"
        )


def _by_type(
    file: str, system: UnitSystem | None, axis: Axis, typed: tuple[str, tuple[int, int], str], of: str
) -> AxisUnit:
    """Return the unit by specific data type and exponents, in SI by data set 164 (SI without it)."""
    name, exponents, unit = typed
    turning = TURNING.get(unit, unit)
    about = (exponents[0] - 1, 0) if name != "force" else (1, 1)  # of the same type about an axis
    if name and axis.exponents not in ((0, 0), exponents, about if turning != unit else exponents):
        raise RecordError(f"{file}: {of}: the exponents {axis.exponents} contradict its data type {axis.kind} ({name})")
    if name and turning != unit and (axis.turns or (name == "force" and axis.exponents == (1, 1))):
        unit, exponents = turning, about
    if not name:
        exponents = axis.exponents
        unit = "N" if exponents == (0, 1) else ""
    if system is None or system.si:
        return AxisUnit(unit, 1.0)
    if not name and axis.kind != 1 and exponents == (0, 0):
        raise RecordError(
            f"{file}: data set 164 has {system.name}, and {of} has neither a unit label nor a data type, so its unit "
            "is not known; write its unit into records 9 and 10"
        )
    scale = system.length ** exponents[0] * system.force ** exponents[1]
    said = f"{of} in units of {system.name} by data set 164, converted to {unit or 'SI'}" if scale != 1.0 else ""
    return AxisUnit(unit, scale, said)


def time_scale(file: str, f: UffFunction) -> float:
    """Return the factor that converts the abscissa of a time record to seconds. Raises RecordError if it is no time."""
    unit = re.sub(r"^(m|u|n|k)?(?:secs?|seconds?)$", r"\1s", plain_unit(f.x.unit).lower())
    word = f.x.label.lower()
    if f.x.kind not in (0, 1, 17) or (word in BY_NAME and word != "time"):
        raise RecordError(
            f"{file}: '{f.name}' is a time record (function type 1) over an abscissa of data type {f.x.kind} "
            f"({KINDS.get(f.x.kind, ('unknown',))[0]}), label '{f.x.label}'; expected a time (17)"
        )
    if unit in ("min", "h"):
        return {"min": 60.0, "h": 3600.0}[unit]
    try:
        return factor(unit or "s", "s")
    except UnitMismatch as e:
        raise RecordError(f"{file}: '{f.name}': its time axis is in {f.x.unit}; expected s, ms or us") from e
