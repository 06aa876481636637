"""Live capture: readings of an instrument, in the order of a check, into the unit folder and the event store.

Every reading is in the journal before the next is asked for. A run that fails leaves its journal and its transcript,
and no entry in `unit.toml`.
"""

import math
import statistics
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from accept.base.atomic_files import write_atomic
from accept.capture.journal import Journal
from accept.capture.mass_steps import stiffness
from accept.capture.run import Captured, Run, Take
from accept.store import payloads
from accept.units import toml_edit
from accept.units.unit_folder import read as read_unit
from checks.acceptance.flatness import POSITIONS_MM
from hw import records
from hw.errors import Implausible, InstrumentError
from hw.instruments.reading import scaled
from specs.bench import InstrumentEntry

REPEATS = 3  # rounds over the probe points, so that their scatter is known
MAX_SPREAD_UM = 3.0  # of repeats at one probe point: more is a probe that was not seated, or moved
MAX_OPEN_LOOP = 0.3  # of a stroke that may be left back at the first voltage: a loop is 10 to 15 % wide, creep less
GROUPS = {"sensor_uF": "sensor", "actuator_uF": "actuator"}
STROKES = {"one_stack": "stroke_one_stack.mat", "two_stacks": "stroke_two_stacks.mat"}
POINTS_MM = [(float(x), float(y)) for x, y in np.array(POSITIONS_MM, dtype=float)]
UM, UF = 1e-6, 1e-6
MOST_LINES = 12_000  # in an event: a stroke, the longest run that is not followed, has some 10,000


def capture(section: str, run: Run) -> Captured:
    """Capture one section of a unit that has its `unit.toml`. Raises InstrumentError, UnitError, OSError."""
    serial = read_unit(run.folder).serial
    with Journal(run.folder, section) as journal:
        try:
            for reminder in run.instrument.reminders:
                run.say(reminder)
            run.instrument.connect()
            captured = CAPTURES[section](run, Take(run, journal))
            run.instrument.confirm()  # still the instrument that it was, set as it was, before anything is set
        except InstrumentError as e:
            run.store.write(payloads.CaptureFailed(**_kept(section, run, journal), reason=str(e)), serial, who=run.who)
            raise
        finally:
            run.instrument.close()
        for name, content in captured.files.items():
            write_atomic(run.folder / name, content)
        toml_edit.enter(run.folder, section, captured.entries)
        event = payloads.Captured(**_kept(section, run, journal), entries=captured.entries, notes=tuple(captured.notes))
        run.store.write(event, serial, who=run.who)
    return captured


def _kept(section: str, run: Run, journal: Journal) -> dict[str, Any]:
    """Return what the event of a run keeps, whether it failed or not."""
    link, calibration = run.instrument.link, run.entry.calibration
    return {
        "section": section,
        "instrument": run.instrument.name,
        "model": run.entry.model,
        "serial": run.entry.serial,
        "calibration": None
        if calibration is None
        else payloads.InstrumentCalibration(calibration.certificate, calibration.due.isoformat()),
        "settings": dict(run.instrument.asked),
        "readings": tuple(_ends(journal.lines)),
        "journal": journal.path.name,
        "transcript": () if link is None else tuple(_ends([tuple(t.to_json()) for t in link.take_transcript()])),
    }


def _ends(lines: list[Any]) -> list[Any]:
    """Both ends of what is too long for an event: a record that is followed has thousands of readings, which the
    journal in the unit's folder holds, and asks five times as often."""
    if len(lines) <= MOST_LINES:
        return lines
    return [*lines[: MOST_LINES // 2], *lines[-MOST_LINES // 2 :]]


def capacitance(run: Run, take: Take) -> Captured:
    """Both groups of stacks, C at 1 kHz, with the meter's accuracy where the bench file has it."""
    entries: dict[str, Any] = {}
    notes = []
    for name, group in GROUPS.items():
        run.hands.leads(group)
        reading = take(name)
        run.say(f"{name} = {reading.value / UF:.4f}" + "".join(f", {k} = {v:g}" for k, v in reading.more.items()))
        entries[name] = _with_accuracy(scaled(reading.value, 1 / UF), run.entry)
        notes += [f"{name}: {key} = {value:g}" for key, value in reading.more.items()]
    return Captured(entries, notes=tuple(notes))


def _with_accuracy(value: float, entry: InstrumentEntry) -> Any:
    """The number that goes into `unit.toml`: no more digits than a double carries through text; of U, six."""
    return value if entry.accuracy is None else {"value": value, "U": float(f"{entry.accuracy.at(value):.6g}")}


def flatness(run: Run, take: Take) -> Captured:
    """Heights of the probe points in the order of the picture, `REPEATS` times round: repeats that follow each other
    at once would not show drift or seating. Raises Implausible where the repeats of a point lie too far apart."""
    rounds: list[list[float]] = [[] for _ in POINTS_MM]
    for nth in range(REPEATS):
        for point, (x, y) in enumerate(POINTS_MM, 1):
            run.hands.probe(point, x, y)
            rounds[point - 1].append(scaled(take(f"point {point}, round {nth + 1}").value, 1 / UM))
    for point, heights in enumerate(rounds, 1):
        if max(heights) - min(heights) > MAX_SPREAD_UM:
            words = ", ".join(f"{z:.1f}" for z in heights)
            raise Implausible(f"point {point}: its repeats are {words} um, more than {MAX_SPREAD_UM:g} um apart")
    if len({z for heights in rounds for z in heights}) == 1:
        raise Implausible(
            f"all {REPEATS * len(rounds)} heights are {rounds[0][0]:g} um: the display stands still; is it on hold?"
        )
    scatter = math.sqrt(statistics.fmean(statistics.variance(heights) for heights in rounds))
    run.say(f"scatter of the repeats: {scatter:.2f} um (standard deviation of one reading)")
    x_mm, y_mm = np.transpose(POINTS_MM)
    table = {"x_mm": x_mm, "y_mm": y_mm, "z_um": np.array([statistics.fmean(heights) for heights in rounds])}
    note = f"{REPEATS} readings a point, standard deviation of one reading {scatter:.3g} um"
    return Captured({"points": "flatness.csv"}, {"flatness.csv": records.csv_bytes(table)}, (note,))


def stroke(run: Run, take: Take) -> Captured:
    """Displacement of one stack and of the two others while the voltage goes through its cycles."""
    files, steps = {}, voltages_by_hand() if run.hands.sets_each_voltage else voltages()
    for group, name in STROKES.items():
        run.hands.drive(group)
        run.say(f"{group}: {len(steps)} voltage steps")
        files[name] = _stroke_record(run, take, group, steps)
    return Captured(dict(STROKES), files)


def _stroke_record(run: Run, take: Take, group: str, steps: Sequence[float]) -> bytes:
    """A record that counts readings: quasi-static, so `t` [s] runs in even steps of their mean distance, as a record
    must; when each reading came is in `t_read`."""
    d, t_read, before = [], [], None
    for V in steps:
        if V != before or not run.hands.sets_each_voltage:
            run.hands.voltage(V)
        before = V
        reading = take(f"{group} at {V:g} V")
        d.append(reading.value)
        t_read.append(reading.t)
    _must_follow(group, d)
    when = np.array(t_read) - t_read[0]
    t = np.linspace(0.0, max(when[-1], 1e-3 * len(steps)), len(steps))
    return records.mat_bytes({"t": t, "V": np.array(steps), "d": np.array(d), "t_read": when})


def _must_follow(group: str, d: Sequence[float]) -> None:
    """Raises Implausible for a display that does not go back with the voltage: held, or on its maximum."""
    span = max(d) - min(d)
    if span == 0.0 or abs(d[-1] - d[0]) > MAX_OPEN_LOOP * span:
        raise Implausible(
            f"{group}: it begins at {d[0] / UM:.2f} um, spans {span / UM:.2f} um and ends, at the same voltage, at "
            f"{d[-1] / UM:.2f} um: the display does not follow; is it on hold, MAX or MIN, or was it set to zero?"
        )


def voltages(cycles: int = 2) -> list[float]:
    """Steps of the voltage on the stacks [V], from -20 V to 150 V and back: fine at the ends, where the check fits a
    parabola over 2 % of the span, and close enough at mid-voltage for the loop's width."""
    near = np.arange(0.0, 4.0, 0.25)
    up = np.concatenate([-20.0 + near, np.arange(-16.0, 146.0, 3.0), 146.0 + near, [150.0]])
    once = np.concatenate([up, up[-2::-1]])
    return [float(V) for V in np.concatenate([once, *(once[1:] for _ in range(cycles - 1))])]


def voltages_by_hand() -> list[float]:
    """Steps for a person who sets each of them [V]: one cycle of 31 settings, four readings at each, so many and there
    because the check fits a parabola to at least 12 samples at either end and 8 at mid-voltage."""
    up = [-20, -19, -18, -17, 10, 35, 53, 65, 77, 100, 125, 141, 147, 148, 149, 150]
    return [float(V) for V in (*up, *up[-2::-1]) for _ in range(4)]


CAPTURES: dict[str, Callable[[Run, Take], Captured]] = {
    "flatness": flatness,
    "capacitance": capacitance,
    "stroke": stroke,
    "stiffness": stiffness,
}
