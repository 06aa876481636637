"""A model for other tools: its state space as matrices, as an object of python-control, as a MATLAB file."""

from pathlib import Path
from typing import Any

from accept.analysis.record_responses import control_package
from accept.base.atomic_files import write_atomic
from checks.errors import ModelError
from checks.model import StateSpace
from hw.records import ss_mat


def to_control(found: StateSpace, pade: int | None = None) -> Any:
    """Return a `control.StateSpace` with names. pade: order of the approximation of the delays; 0 leaves them out.
    Raises ModelError for delays without it, RecordError if python-control is not installed."""
    control = control_package()
    names = {"inputs": [found.input], "outputs": list(found.outputs)}
    if pade is None and found.delay_s.any():
        late = max(found.delay_s, key=abs)
        raise ModelError(f"{found.name}: a delay of {1e6 * late:.4g} us; name the order of its approximation: pade=2")
    mechanics = control.ss(found.A, found.B, found.C, found.D, **names, states=list(found.states), name=found.name)
    if not pade or not found.delay_s.any():
        return mechanics
    if (found.delay_s < 0.0).any():
        raise ModelError(
            f"{found.name}: {1e6 * min(found.delay_s):.4g} us early: no state space comes before its cause"
        )
    delays = [control.tf2ss(*control.pade(d, pade)) if d else control.ss([], [], [], [[1.0]]) for d in found.delay_s]
    return control.ss(control.append(*delays) * mechanics, **names, name=found.name)


def save_state_space(found: StateSpace, file: str | Path) -> Path:
    """Write a MATLAB file with a struct `model`: A, B, C, D, the names and units of an ss object, and OutputDelay [s].

    Raises ModelError for another ending."""
    place = Path(file)
    if place.suffix.lower() != ".mat":
        raise ModelError(f"{place}: a state space is written as .mat")
    more = {
        "InputName": [found.input],
        "OutputName": list(found.outputs),
        "InputUnit": [found.units[found.input]],
        "OutputUnit": [found.units[c] for c in found.outputs],
        "OutputDelay": found.delay_s[:, None],
        "Name": found.name,
    }
    write_atomic(place, ss_mat({"A": found.A, "B": found.B, "C": found.C, "D": found.D}, found.states, more))
    return place
