"""A quarter of 520 units with planted faults, drawn from the description of one and from nothing of accept.

Written before the fleet's rules were read, and it imports none of them: what it plants is what quarters have in them,
not what a rule is good at. Thirteen weeks from Monday 2026-07-06, ten units a day from Monday to Thursday, typed
values. Ann works with the gauge G-77 and the meter LCR-1 (reads 0.001 uF), Ben with G-78 and LCR-2. A golden unit is
measured on G-77 each Monday.

`quarter(seed)` is quiet: nothing but scatter. `quarter(seed, *FAULTS)` has every fault; each can be planted alone.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import date, timedelta

import numpy as np

FIRST = date(2026, 7, 6)
WEEKS, A_DAY, DAYS = 13, 10, 4

FAULTS = (
    "constant",  # Ben types a sensor of 4.95 from 08-10: 160 units
    "drift",  # the gauge G-77 drifts from 0 to 1.5 % between 07-27 and 08-24, then it is calibrated
    "lot",  # 30 units of the lot L02-S have 5 % less stroke
    "two_stacks",  # stacks of two suppliers, mixed in every box: 4.851 and 5.101 uF
    "coarse",  # LCR-2 shows 0.01 uF
    "offset",  # LCR-2 reads 0.3 % more
    "transposed",  # five values have two digits exchanged
)

STROKE = {"mean": 362.6, "sd": 4.08, "repeat": 0.0022}  # um; 0.22 % is the repeatability of the gauge
STIFFNESS = {"mean": 1.755, "sd": 0.025, "repeat": 0.004}  # N/um
SENSOR = {"mean": 4.95, "sd": 0.035, "repeat": 0.0005}  # uF, one stack
RATIO = {"mean": 2.0, "sd": 0.009}  # two stacks to one, of one batch of ceramic
DECIMALS = {"stroke_um": 1, "stiffness_N_um": 3, "sensor_uF": 3, "actuator_uF": 3, "flatness_um": 1}


@dataclass
class Unit:
    serial: str
    day: date
    operator: str
    gauge: str
    meter: str
    lot: str
    values: dict[str, float]


@dataclass
class Quarter:
    units: list[Unit]
    golden: list[tuple[date, dict[str, float]]]
    planted: dict[str, list[str]] = field(
        default_factory=dict
    )  # serials by fault; of a transposition "serial quantity"


def gauge_drift(day: date) -> float:
    """Share by which G-77 reads too much while it drifts."""
    start, end = date(2026, 7, 27), date(2026, 8, 24)
    return 0.015 * (day - start).days / (end - start).days if start <= day < end else 0.0


def transpose(value: float, decimals: int, at: int) -> float:
    """Return `value` with the digits at `at` and after it exchanged, as somebody types them."""
    digits = [c for c in f"{value:.{decimals}f}" if c != "."]
    digits[at], digits[at + 1] = digits[at + 1], digits[at]
    return int("".join(digits)) / 10**decimals


def _draw(rng: np.random.Generator, lots: bool, stacks: bool) -> dict[str, float]:
    """Draw what one unit truly is."""
    stiff = rng.standard_normal()
    stroke = STROKE["mean"] + STROKE["sd"] * (0.8 * rng.standard_normal() - 0.6 * stiff)  # a stiff frame moves less
    if lots:
        stroke *= 0.95
    sensor = SENSOR["mean"] + SENSOR["sd"] * rng.standard_normal()
    if stacks:
        sensor += rng.choice([4.851, 5.101]) - SENSOR["mean"]
    return {
        "stroke_um": stroke,
        "stiffness_N_um": STIFFNESS["mean"] + STIFFNESS["sd"] * stiff,
        "sensor_uF": sensor,
        "actuator_uF": sensor * (RATIO["mean"] + RATIO["sd"] * rng.standard_normal()),
        "flatness_um": 6.0 * float(np.exp(0.3 * rng.standard_normal())),  # skewed, as every deviation of form
    }


def _read(
    true: dict[str, float], day: date, operator: str, faults: frozenset[str], rng: np.random.Generator
) -> dict[str, float]:
    """Read a unit with the gauge and meter of `operator`, and type it in."""
    ben = operator == "Ben"
    drift = gauge_drift(day) if "drift" in faults and not ben else 0.0
    meter = 1.003 if "offset" in faults and ben else 1.0
    read = {
        "stroke_um": true["stroke_um"] * (1 + drift + STROKE["repeat"] * rng.standard_normal()),
        "stiffness_N_um": true["stiffness_N_um"] * (1 + STIFFNESS["repeat"] * rng.standard_normal()),
        "sensor_uF": true["sensor_uF"] * meter * (1 + SENSOR["repeat"] * rng.standard_normal()),
        "actuator_uF": true["actuator_uF"] * meter * (1 + SENSOR["repeat"] * rng.standard_normal()),
        "flatness_um": abs(true["flatness_um"] + 0.3 * rng.standard_normal()),
    }
    decimals = dict(DECIMALS)
    if "coarse" in faults and ben:
        decimals |= {"sensor_uF": 2, "actuator_uF": 2}
    return {name: round(float(value), decimals[name]) for name, value in read.items()}


def quarter(seed: int, *planted: str) -> Quarter:
    """Draw a quarter with the faults `planted` (of FAULTS; none is quiet)."""
    faults, rng = frozenset(planted), np.random.default_rng(seed)
    units: list[Unit] = []
    where: dict[str, list[str]] = {name: [] for name in planted}
    for week in range(WEEKS):
        for i in range(A_DAY * DAYS):
            day = FIRST + timedelta(days=7 * week + i // A_DAY)
            operator = "Ann" if i % 2 == 0 else "Ben"
            short = week == 1 and i < 30
            true = _draw(rng, short and "lot" in faults, "two_stacks" in faults)
            values = _read(true, day, operator, faults, rng)
            serial = f"APA-{week + 1:02d}{i:02d}"
            lot = f"L{week + 1:02d}" + ("-S" if short else "")
            if "constant" in faults and operator == "Ben" and day >= date(2026, 8, 10):
                values["sensor_uF"] = 4.95
                where["constant"].append(serial)
            if "lot" in faults and short:
                where["lot"].append(serial)
            if "drift" in faults and operator == "Ann" and gauge_drift(day) > 0:
                where["drift"].append(serial)
            units.append(
                Unit(
                    serial,
                    day,
                    operator,
                    "G-77" if operator == "Ann" else "G-78",
                    "LCR-1" if operator == "Ann" else "LCR-2",
                    lot,
                    values,
                )
            )
    golden = _golden(faults, np.random.default_rng([seed, 1]))
    if "transposed" in faults:
        where["transposed"] = _transpose_five(units, np.random.default_rng([seed, 2]))
    return Quarter(units, golden, where)


def _golden(faults: Iterable[str], rng: np.random.Generator) -> list[tuple[date, dict[str, float]]]:
    """Measure the golden unit on G-77 each Monday."""
    true = {"stroke_um": 360.5, "stiffness_N_um": 1.76, "sensor_uF": 4.96, "actuator_uF": 9.93, "flatness_um": 5.5}
    mondays = [FIRST + timedelta(days=7 * week) for week in range(WEEKS)]
    return [(day, _read(true, day, "Ann", frozenset(faults), rng)) for day in mondays]


def _transpose_five(units: list[Unit], rng: np.random.Generator) -> list[str]:
    """Exchange two digits of five values of Ann's, as happened: two strokes, a stiffness, both stacks.

    The places are those of the quarter: 363.2 -> 336.2, 364.5 -> 634.5, 1.755 -> 1.575,
    4.827 -> 4.287, 9.521 -> 9.251. An exchange that leaves the value as it was is no fault: another unit is taken.
    """
    typed = []
    for name, at in (("stroke_um", 1), ("stroke_um", 0), ("stiffness_N_um", 1), ("sensor_uF", 1), ("actuator_uF", 1)):
        while True:
            unit = units[int(rng.integers(len(units)))]
            wrong = transpose(unit.values[name], DECIMALS[name], at)
            if unit.operator == "Ann" and wrong != unit.values[name] and not any(unit.serial in one for one in typed):
                break
        unit.values[name] = wrong
        typed.append(f"{unit.serial} {name}")
    return typed
