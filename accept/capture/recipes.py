"""Sections that are measured live, each by a recipe: the readings of an instrument in the order of the check."""

import math
import statistics
from collections.abc import Callable, Sequence

import numpy as np

from accept.capture.setup import CaptureResult, CaptureSetup, RecordFile
from checks.acceptance import POSITIONS_MM, deflection_of
from checks.cause import NoResult
from checks.declare import Measured
from checks.record import Record
from hw import records
from hw.errors import Implausible
from hw.instruments import scaled

CIRCUITS = {"closed_circuit": "stiffness_closed.mat", "open_circuit": "stiffness_open.mat"}
ADD_S, REMOVE_S, END_S = 15.0, 22.0, 30.0  # of a record, by the check's own guide
MAX_GAP_S = 0.15  # between two readings: the check looks at a tenth of a second after the step


def stiffness(setup: CaptureSetup) -> CaptureResult:
    """Follow the displacement while a mass is added and removed, with closed and open circuit ([STB] 3.1.7, 3.2.1). Ask
    for the mass unless it is known."""
    typed = {} if "mass_kg" in setup.known else {"mass_kg": Measured(_ask_mass(setup))}
    files, notes = {}, []
    for circuit, name in CIRCUITS.items():
        setup.actions.load(circuit)
        t, de = _mass_record(setup, circuit)
        files[circuit] = RecordFile(name, records.own_record({"t": t, "de": de}))
        rate = (t.size - 1) / (t[-1] - t[0])
        notes.append(f"{circuit}: {t.size} readings, {rate:.0f} a second, evenly spaced by interpolation")
    return CaptureResult(files=files, typed=typed, notes=tuple(notes))


def _ask_mass(setup: CaptureSetup) -> float:
    """Return the mass [kg] that a person types. Raises Implausible."""
    typed = setup.actions.weigh()
    try:
        mass = float(typed)
    except ValueError:
        mass = float("nan")
    if not 0.0 < mass < float("inf"):
        raise Implausible(f"the mass is {typed!r}, expected a number in kg")
    return mass


def _mass_record(setup: CaptureSetup, circuit: str) -> tuple[np.ndarray, np.ndarray]:
    """Return t (N,) [s] in even steps and de (N,) [m]. Raises Implausible if readings were too slow or lack the steps
    that the check needs; the mass can then be added again."""
    cues = [(ADD_S, "put the mass on now"), (REMOVE_S, "take the mass off now")]

    def cue(now: float) -> None:
        while cues and now >= cues[0][0]:
            setup.say(f"{circuit}, {now:.0f} s: {cues.pop(0)[1]}")

    when, value = np.transpose(setup.read.moving(circuit, END_S, MAX_GAP_S, cue))
    t = np.linspace(when[0], when[-1], when.size)
    de = np.interp(t, when, value)
    try:
        deflection_of(Record(t, {"de": de}, {"de": "m"}))
    except (NoResult, ValueError) as e:
        raise Implausible(f"{circuit}: {e}") from e
    return t, de


REPEATS = 3  # rounds over the probe points, so that their scatter is known
MAX_SPREAD_UM = 3.0  # of repeats at one probe point: more is a probe that was not seated, or moved
MAX_OPEN_LOOP = 0.3  # of a stroke that may be left back at the first voltage: a loop is 10 to 15 % wide, creep less
GROUPS = {"sensor_uF": "sensor", "actuator_uF": "actuator"}
STROKES = {"one_stack": "stroke_one_stack.mat", "two_stacks": "stroke_two_stacks.mat"}
POINTS_MM = [(float(x), float(y)) for x, y in np.array(POSITIONS_MM, dtype=float)]
UM, UF = 1e-6, 1e-6


def capacitance(setup: CaptureSetup) -> CaptureResult:
    """Measure both groups of stacks, C at 1 kHz, with the meter's accuracy if the bench file states it."""
    values: dict[str, Measured] = {}
    notes = []
    for name, group in GROUPS.items():
        setup.actions.leads(group)
        reading = setup.read(name)
        setup.say(f"{name} = {reading.value / UF:.4f}" + "".join(f", {k} = {v:g}" for k, v in reading.more.items()))
        value = scaled(reading.value, 1 / UF)
        values[name] = Measured(value, setup.accuracy.at(value) if setup.accuracy else None)
        notes += [f"{name}: {key} = {value:g}" for key, value in reading.more.items()]
    return CaptureResult(values, notes=tuple(notes))


def flatness(setup: CaptureSetup) -> CaptureResult:
    """Measure the heights of the probe points in the order of the picture, `REPEATS` times round: repeats that follow
    each other at once would not show drift or seating. Raises Implausible if the repeats of a point differ too much."""
    rounds: list[list[float]] = [[] for _ in POINTS_MM]
    for nth in range(REPEATS):
        for point, (x, y) in enumerate(POINTS_MM, 1):
            setup.actions.probe(point, x, y)
            rounds[point - 1].append(scaled(setup.read(f"point {point}, round {nth + 1}").value, 1 / UM))
    for point, heights in enumerate(rounds, 1):
        if max(heights) - min(heights) > MAX_SPREAD_UM:
            words = ", ".join(f"{z:.1f}" for z in heights)
            raise Implausible(f"point {point}: its repeats are {words} um, more than {MAX_SPREAD_UM:g} um apart")
    if len({z for heights in rounds for z in heights}) == 1:
        raise Implausible(
            f"all {REPEATS * len(rounds)} heights are {rounds[0][0]:g} um: the display stands still; is it on hold?"
        )
    scatter = math.sqrt(statistics.fmean(statistics.variance(heights) for heights in rounds))
    setup.say(f"scatter of the repeats: {scatter:.2f} um (standard deviation of one reading)")
    x_mm, y_mm = np.transpose(POINTS_MM)
    table = {"x_mm": x_mm, "y_mm": y_mm, "z_um": np.array([statistics.fmean(heights) for heights in rounds])}
    note = f"{REPEATS} readings a point, standard deviation of one reading {scatter:.3g} um"
    return CaptureResult(files={"points": RecordFile("flatness.csv", records.csv_bytes(table))}, notes=(note,))


def stroke(setup: CaptureSetup) -> CaptureResult:
    """Measure the displacement of one stack, then of the other two, over the cycles of the voltage."""
    files: dict[str, RecordFile] = {}
    steps = voltages_by_hand() if setup.actions.sets_each_voltage else voltages()
    for group, name in STROKES.items():
        setup.actions.drive(group)
        setup.say(f"{group}: {len(steps)} voltage steps")
        files[group] = RecordFile(name, _stroke_record(setup, group, steps))
    return CaptureResult(files=files)


def _stroke_record(setup: CaptureSetup, group: str, steps: Sequence[float]) -> bytes:
    """Return a record of one reading per step. As a record needs even steps, `t` [s] has the mean spacing of the
    readings; `t_read` has the true times."""
    d, t_read, before = [], [], None
    for V in steps:
        if V != before or not setup.actions.sets_each_voltage:
            setup.actions.voltage(V)
        before = V
        reading = setup.read(f"{group} at {V:g} V")
        d.append(reading.value)
        t_read.append(reading.t)
    _must_follow(group, d)
    when = np.array(t_read) - t_read[0]
    t = np.linspace(0.0, max(when[-1], 1e-3 * len(steps)), len(steps))
    return records.own_record({"t": t, "V": np.array(steps), "d": np.array(d), "t_read": when})


def _must_follow(group: str, d: Sequence[float]) -> None:
    """Raise Implausible if the display does not return with the voltage: held, or on its maximum."""
    span = max(d) - min(d)
    if span == 0.0 or abs(d[-1] - d[0]) > MAX_OPEN_LOOP * span:
        raise Implausible(
            f"{group}: it begins at {d[0] / UM:.2f} um, spans {span / UM:.2f} um and ends, at the same voltage, at "
            f"{d[-1] / UM:.2f} um: the display does not follow; is it on hold, MAX or MIN, or was it set to zero?"
        )


def voltages(cycles: int = 2) -> list[float]:
    """Return the steps of the voltage on the stacks [V], from -20 V to 150 V and back: fine at the ends, because the
    check fits a parabola over 2 % of the span there, and close enough at mid-voltage for the width of the loop."""
    near = np.arange(0.0, 4.0, 0.25)
    up = np.concatenate([-20.0 + near, np.arange(-16.0, 146.0, 3.0), 146.0 + near, [150.0]])
    once = np.concatenate([up, up[-2::-1]])
    return [float(V) for V in np.concatenate([once, *(once[1:] for _ in range(cycles - 1))])]


def voltages_by_hand() -> list[float]:
    """Return the steps for a person who sets each voltage [V]: one cycle of 31 settings with four readings each. The
    check fits a parabola to at least 12 samples at either end and to 8 at mid-voltage."""
    up = [-20, -19, -18, -17, 10, 35, 53, 65, 77, 100, 125, 141, 147, 148, 149, 150]
    return [float(V) for V in (*up, *up[-2::-1]) for _ in range(4)]


RECIPES: dict[str, Callable[[CaptureSetup], CaptureResult]] = {
    "flatness": flatness,
    "capacitance": capacitance,
    "stroke": stroke,
    "stiffness": stiffness,
}
