"""The section of `unit.toml` from the state of a step: one value from repeated readings, and the missing inputs."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from statistics import fmean, stdev
from typing import Any

from accept.store.payloads import MARK, RecordLinked, ValueTaken
from accept.units import TYPED
from accept.workflow.state.unit_state import Attempt, StepState
from accept.workflow.steps.plan import WorkflowStep, is_needed
from checks.acceptance import CHECKS
from checks.declare import CsvTable, Form, Input, Scalar, Series, Vector
from checks.quantity import COVERAGE_FACTOR
from specs.spec import CheckSpec

OF_FOLDER = "unit folder"  # source of a value that an existing folder gave


@dataclass(frozen=True)
class Repeated:
    """Mean of readings of one value; scatter: their standard deviation, None for a single one; U: as typed, or stated
    and scatter together, None if only the spec's statement applies."""

    value: float
    count: int
    scatter: float | None
    U: float | None


def repeated(readings: Sequence[ValueTaken], asked: CheckSpec, name: str) -> Repeated | None:
    """Return the mean of repeated readings, None without any.

    The scatter of the mean adds in square to the stated uncertainty ([JCGM100] 4.2.3 and 5.1.2). If none is stated, it
    stays unknown: scatter does not show what all readings have in common.
    """
    if not readings:
        return None
    value = fmean(r.value for r in readings)
    typed = readings[-1].U
    if len(readings) == 1:
        return Repeated(value, 1, None, typed)
    scatter = stdev(r.value for r in readings)
    by_spec = asked.uncertainty.get(name)
    stated = by_spec.at(value) if typed is None and by_spec else typed
    U = None if stated is None else math.hypot(stated, COVERAGE_FACTOR * scatter / math.sqrt(len(readings)))
    return Repeated(value, len(readings), scatter, U)


def section(step: WorkflowStep, state: StepState) -> dict[str, Any]:
    """Return the content of the step's section of `unit.toml`; empty if nothing was taken."""
    form = step.form(state.form)
    content = {i.name: _content(i, step, state) for i in form.inputs}
    return {name: value for name, value in content.items() if value is not None}


def missing(step: WorkflowStep, state: StepState) -> list[Input]:
    """Return the inputs of the step's form without which nothing can be judged."""
    inputs = [i for i in step.form(state.form).inputs if is_needed(i)]
    return [i for i in inputs if not all(is_given(*place, state) for place in places([i]))]


def missing_labels(step: WorkflowStep, state: StepState) -> list[str]:
    """Return the labels of the missing inputs; for a list of values, which of them: `heights 2, 3, 5`."""
    return [_missing_label(i, state) for i in missing(step, state)]


def _missing_label(declared: Input, state: StepState) -> str:
    if not isinstance(declared, Vector):
        return declared.label
    places = [str(i + 1) for i in range(declared.size) if not is_given(declared, i, state)]
    return f"{declared.item}{'s' if len(places) > 1 else ''} {', '.join(places)}"


def counted(form: Form, state: StepState) -> tuple[int, int]:
    """Return how many of the values and files that a form needs were given, and how many it needs; where none is needed
    more than the others, of all of them."""
    wanted = list(places([i for i in form.inputs if is_needed(i)] or form.inputs))
    return sum(is_given(*place, state) for place in wanted), len(wanted)


def full(step: WorkflowStep, state: StepState) -> bool:
    """Return whether every input of the step's form was given, optional ones too."""
    return all(is_given(*place, state) for place in places(step.form(state.form).inputs))


def records_awaited(step: WorkflowStep, state: StepState) -> bool:
    """Return whether inputs of a form are still missing that needs none of them more than the others: one is enough to
    judge, and how the others are measured is still to be read."""
    return not any(map(is_needed, step.form(state.form).inputs)) and not full(step, state)


def ready(step: WorkflowStep, state: StepState) -> bool:
    """Return whether judging the step would give more than a missing input."""
    return bool(state.entries) and not missing(step, state)


def places(inputs: Sequence[Input]) -> Iterator[tuple[Input, int | None]]:
    """Yield where one value or file goes each: its input, and of a list of values its place in it."""
    for declared in inputs:
        for index in range(declared.size) if isinstance(declared, Vector) else (None,):
            yield declared, index


def is_given(declared: Input, index: int | None, state: StepState) -> bool:
    """Return whether there is a value or file for such a place."""
    if isinstance(declared, Series | CsvTable):
        return state.link(declared.name) is not None
    return bool(state.readings(declared.name, index))


def _content(declared: Input, step: WorkflowStep, state: StepState) -> Any:
    match declared:
        case Scalar():
            return _scalar(repeated(state.readings(declared.name), step.asked, declared.name))
        case Vector():
            taken = [repeated(state.readings(declared.name, i), step.asked, "") for i in range(declared.size)]
            return [one.value for one in taken if one is not None] or None
        case _:
            link = state.link(declared.name)
            return link.file if link else None


def _scalar(one: Repeated | None) -> Any:
    if one is None:
        return None
    return one.value if one.U is None else {"value": one.value, "U": one.U}


def document(serial: str, attempt: Attempt, steps: Sequence[WorkflowStep], simulated: bool = False) -> dict[str, Any]:
    """Return the whole `unit.toml` of an attempt: values and files, the days on which they were measured, the notes.
    simulated: no instrument measured it."""
    states = {step.check.reads: (step, attempt.step(step.name)) for step in steps if not step.derived}
    sections = {name: section(step, state) for name, (step, state) in states.items()}
    days = {name: date.fromisoformat(state.day) for name, (_, state) in states.items() if sections[name] and state.day}
    notes = {step.name: note_lines(attempt.step(step.name)) for step in steps}
    entered = {step.name: attempt.step(step.name).entries for step in steps}
    people = {name: list(dict.fromkeys(entry.who for entry in entries)) for name, entries in entered.items() if entries}
    if len({name for names in people.values() for name in names}) > 1:
        first = {step: [f"measured by {' and '.join(names)}"] for step, names in people.items()}
        notes = {step: [*first.get(step, []), *lines] for step, lines in notes.items()}
    head: dict[str, Any] = {"serial": serial, "kind": attempt.kind, "simulated": simulated}
    head |= {"parts": dict(attempt.parts), "measured": days}
    head["measured_by"] = people
    sources = {name: _sources(step, state) for name, (step, state) in states.items() if sections[name]}
    head["read_with"] = {name: found for name, found in sources.items() if set(found) - {TYPED, OF_FOLDER}}
    head["channels"] = dict(attempt.channels)
    head["notes"] = {name: lines for name, lines in notes.items() if lines}
    pictures = {s.name: [each for note in attempt.step(s.name).notes for each in note.pictures] for s in steps}
    head["pictures"] = {name: files for name, files in pictures.items() if files}
    return {name: content for name, content in (head | sections).items() if content}


def _sources(step: WorkflowStep, state: StepState) -> list[str]:
    taken = (state.readings(i.name, index) for i, index in places(step.form(state.form).inputs))
    return list(dict.fromkeys(reading.source for readings in taken for reading in readings))


def entry_words(entry: ValueTaken | RecordLinked) -> str:
    """Return the file of an entry, or its value with the name of its input: `height 3 4.95 um`."""
    if isinstance(entry, RecordLinked):
        return entry.file
    name = entry.input
    declared = next((check.inputs[name] for check in CHECKS.values() if name in check.inputs), None)
    if entry.index is not None:
        called = f"{getattr(declared, 'item', name)} {entry.index + 1}"
    else:
        called = name if declared is None else declared.label
    return f"{called} {entry.value:.6g} {entry.unit}".strip()


def note_lines(state: StepState) -> list[str]:
    """Return the certificate's lines on a step: measured anew and why, notes, nonconformances."""
    again = [f"measured again: {reason}" for reason in state.reasons]
    return again + [f"{MARK if n.nonconformance else ''}{n.line(n.who)}" for n in state.notes if not n.internal]
