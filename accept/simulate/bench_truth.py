"""The truth of a unit for the simulated bench, from the unit's own folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from accept import units
from accept.capture.recipes import POINTS_MM
from accept.units import UnitError, loaded
from checks.declare import Measured
from checks.errors import RecordError
from checks.record import Record
from hw.simulated import BenchSetup

NOMINAL_STROKE_UM = 360.0  # of the good APAs of [STB] 2.3; where a unit has none of its own
NOMINAL = {"sensor_uF": 4.99, "actuator_uF": 9.85}


def world_of(folder: Path) -> BenchSetup:
    """Return the true values that the simulated instruments measure on this unit: heights, capacitances and strokes;
    nominal if the folder states none. Raises UnitError, also if a section cannot be used."""
    held = loaded(folder)
    unit = held.folder

    def values(section: str) -> Mapping[str, Any]:
        if section not in unit.sections:
            return {}
        try:
            return held.values(section)
        except RecordError as e:
            raise UnitError(folder / units.UNIT_FILE, [f"[{section}] cannot be simulated: {e}"]) from e

    capacitance = values("capacitance")
    one, two = _strokes(values("stroke"))
    return BenchSetup(
        serial=unit.serial,
        heights_m=_heights(values("flatness")),
        sensor_F=_number(capacitance, "sensor_uF") * 1e-6,
        actuator_F=_number(capacitance, "actuator_uF") * 1e-6,
        one_stack_m=one,
        two_stacks_m=two,
    )


def _number(values: Mapping[str, Any], name: str) -> float:
    given = values.get(name)
    return given.value if isinstance(given, Measured) else NOMINAL[name]


def _heights(values: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the heights at the probe points in order; from a table, those of the nearest points."""
    if "points" in values:
        table = values["points"]
        away = [np.hypot(table["x_mm"] - x, table["y_mm"] - y) for x, y in POINTS_MM]
        return tuple(float(table["z_um"][int(np.argmin(a))]) * 1e-6 for a in away)
    heights = values.get("z_um", np.zeros(len(POINTS_MM)))
    return tuple(float(z) * 1e-6 for z in heights)


def _strokes(values: Mapping[str, Any]) -> tuple[float, float]:
    """Return the strokes [m] of one stack and of the other two. A typed stroke is split into one third and two
    thirds."""
    records = [values.get("one_stack"), values.get("two_stacks")]
    if all(isinstance(record, Record) for record in records):
        one, two = (float(r["d"].max() - r["d"][0]) for r in records if isinstance(r, Record))
        return one, two
    typed = values.get("stroke_um")
    total = (typed.value if isinstance(typed, Measured) else NOMINAL_STROKE_UM) * 1e-6
    return total / 3, 2 * total / 3
