"""Live stiffness: displacement while a mass is put on and taken off, circuit closed and open ([STB] 3.1.7, 3.2.1)."""

import numpy as np

from accept.capture.run import Captured, Run, Take
from accept.units.unit_folder import read as read_unit
from checks.acceptance.stiffness import deflection_of
from checks.cause import NoResult
from checks.record import Record
from hw import records
from hw.errors import Implausible

SECTION = "stiffness"
CIRCUITS = {"closed_circuit": "stiffness_closed.mat", "open_circuit": "stiffness_open.mat"}
ADD_S, REMOVE_S, END_S = 15.0, 22.0, 30.0  # of a record, by the check's own guide
MAX_GAP_S = 0.15  # between two readings: the check looks at a tenth of a second after the step


def stiffness(run: Run, take: Take) -> Captured:
    """A record of each circuit, and the mass where the unit's folder does not have it yet."""
    held = read_unit(run.folder).sections.get(SECTION)
    known = held is not None and held.number("mass_kg") is not None
    entries: dict[str, object] = dict(CIRCUITS) if known else {**CIRCUITS, "mass_kg": _weighed(run)}
    files, notes = {}, []
    for circuit, name in CIRCUITS.items():
        run.hands.load(circuit)
        t, de = _record(run, take, circuit)
        files[name] = records.mat_bytes({"t": t, "de": de})
        rate = (t.size - 1) / (t[-1] - t[0])
        notes.append(f"{circuit}: {t.size} readings, {rate:.0f} a second, evenly spaced by interpolation")
    return Captured(entries, files, tuple(notes))


def _weighed(run: Run) -> float:
    """[kg]. Raises Implausible for what is no mass."""
    said = run.hands.weigh()
    try:
        mass = float(said)
    except ValueError:
        mass = float("nan")
    if not 0.0 < mass < float("inf"):
        raise Implausible(f"the mass is {said!r}, expected a number in kg")
    return mass


def _record(run: Run, take: Take, circuit: str) -> tuple[np.ndarray, np.ndarray]:
    """Return t (N,) [s] in even steps and de (N,) [m]. Raises Implausible if readings came too slowly, or do not hold
    the steps that the check needs: now the mass can be put on once more."""
    cues = [(ADD_S, "put the mass on now"), (REMOVE_S, "take the mass off now")]

    def cue(now: float) -> None:
        while cues and now >= cues[0][0]:
            run.say(f"{circuit}, {now:.0f} s: {cues.pop(0)[1]}")

    when, value = np.transpose(take.moving(circuit, END_S, MAX_GAP_S, cue))
    t = np.linspace(when[0], when[-1], when.size)
    de = np.interp(t, when, value)
    try:
        deflection_of(Record(t, {"de": de}, {"de": "m"}))
    except (NoResult, ValueError) as e:
        raise Implausible(f"{circuit}: {e}") from e
    return t, de
