"""The events of the workflow: their kinds, and the payload of each. The subject is the unit's serial."""

from collections.abc import Mapping
from typing import Any

from accept.judging.result import finding_json, information_json
from accept.store import NewEvent
from accept.workflow.state.step_judgement import StepJudgement
from checks.declare import Measured

STARTED = "attempt_started"
OPENED = "run_opened"
TAKEN = "value_taken"
LINKED = "record_linked"
NOTED = "step_noted"
REMEASURED = "step_remeasured"
UNDONE = "entry_undone"
STEP_JUDGED = "step_judged"
NOT_READ = "reading_failed"
EXPLAINED = "gap_explained"


def started(
    serial: str,
    number: int,
    kind: str,
    parts: Mapping[str, str],
    reason: str,
    spec: str,
    channels: Mapping[str, Any] | None = None,
) -> NewEvent:
    """channels: our channel name -> the lab's, of an attempt that begins with a unit folder."""
    payload = {"number": number, "kind": kind, "parts": dict(parts), "reason": reason}
    return NewEvent(STARTED, serial, payload | ({"channels": dict(channels)} if channels else {}), spec)


def opened(serial: str, number: int, spec: str) -> NewEvent:
    """A unit was opened, for its attempt of this number."""
    return NewEvent(OPENED, serial, {"number": number}, spec)


def taken(
    serial: str,
    step: str,
    form: str,
    name: str,
    measured: Measured,
    unit: str,
    *,
    index: int | None = None,
    repeat: bool = False,
    text: str = "",
    source: str = "typed",
    day: str | None = None,
    evidence: Mapping[str, Any] | None = None,
) -> NewEvent:
    """A value in the unit that its input declares. index: place in a vector. repeat: one more reading of the same
    value, not a correction. source: `typed` or the instrument's name; text: what it was read from; day: on which it was
    measured, where that is not the day of this entry; evidence: of the instrument, its calibration and its line."""
    payload: dict[str, Any] = {"step": step, "form": form, "input": name, "value": measured.value, "U": measured.U}
    payload |= {"unit": unit, "index": index, "repeat": repeat, "text": text, "source": source}
    more = {"day": day, "evidence": dict(evidence) if evidence else None}
    return NewEvent(TAKEN, serial, payload | {key: value for key, value in more.items() if value is not None})


def not_read(serial: str, step: str, name: str, reason: str, source: str, evidence: Mapping[str, Any]) -> NewEvent:
    """An instrument that gave no value, and what went over its line meanwhile."""
    payload = {"step": step, "input": name, "reason": reason, "source": source, "evidence": dict(evidence)}
    return NewEvent(NOT_READ, serial, payload)


def linked(
    serial: str, step: str, form: str, name: str, file: str, sha256: str, origin: str, day: str | None = None
) -> NewEvent:
    """A file that was copied into the unit's folder as `file`; origin: where it came from; day: as of a value."""
    payload = {"step": step, "form": form, "input": name, "file": file, "sha256": sha256, "origin": origin}
    return NewEvent(LINKED, serial, payload if day is None else payload | {"day": day})


def explained(serial: str, upto: int, gap: Mapping[str, Any]) -> NewEvent:
    """What the gap workflow said of the responses whose last entry is `upto`."""
    return NewEvent(EXPLAINED, serial, {"upto": upto, "gap": dict(gap)})


def noted(serial: str, step: str, text: str, nonconformance: bool) -> NewEvent:
    """A note of the operator, or what is wrong with the part."""
    return NewEvent(NOTED, serial, {"step": step, "text": text, "nonconformance": nonconformance})


def remeasured(serial: str, step: str, reason: str) -> NewEvent:
    """A step is measured anew, and why."""
    return NewEvent(REMEASURED, serial, {"step": step, "reason": reason})


def undone(serial: str, seq: int) -> NewEvent:
    """An entry was taken back."""
    return NewEvent(UNDONE, serial, {"undoes": seq})


def step_judged(serial: str, step: str, judged: StepJudgement, spec: str) -> NewEvent:
    """A step was judged, with its findings."""
    payload = {"step": step, "upto": judged.upto, "findings": [finding_json(f) for f in judged.findings]}
    payload |= {"information": [information_json(c, q) for c, q in judged.information], "notes": list(judged.notes)}
    return NewEvent(STEP_JUDGED, serial, payload, spec)
