"""Live stiffness: displacement while a mass is put on and taken off, circuit closed and open ([STB] 3.1.7, 3.2.1)."""

import numpy as np

from accept.capture.setup import CaptureResult, CaptureSetup, RecordFile
from checks.acceptance import deflection_of
from checks.cause import NoResult
from checks.declare import Measured
from checks.record import Record
from hw import records
from hw.errors import Implausible

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
