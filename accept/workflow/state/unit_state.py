"""The state of a unit in the workflow is a fold over its events; nothing else is remembered."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from accept.judging.result import finding_from_json, information_from_json
from accept.store import Event, Signature, StoreError
from accept.workflow.state import entries
from accept.workflow.state.step_judgement import StepJudgement


@dataclass(frozen=True)
class EnteredValue:
    """One value that was typed or read; U: typed beside it; index: its place in a vector; day: on which it was
    measured, ISO."""

    seq: int
    form: str
    input: str
    value: float
    U: float | None
    unit: str
    index: int | None
    repeat: bool
    source: str
    day: str


@dataclass(frozen=True)
class FileLink:
    """A file in the unit's folder that holds the data of an input."""

    seq: int
    form: str
    input: str
    file: str
    sha256: str
    day: str


@dataclass(frozen=True)
class Note:
    """Words about a step. nonconformance: what was found wrong."""

    seq: int
    who: str
    text: str
    nonconformance: bool


@dataclass(frozen=True)
class StepState:
    """What was taken at a step since it was last measured anew. earlier: entries of the rounds before, which stay."""

    entries: tuple[EnteredValue | FileLink, ...] = ()
    earlier: tuple[EnteredValue | FileLink, ...] = ()
    reasons: tuple[str, ...] = ()
    notes: tuple[Note, ...] = ()
    judgements: Mapping[int, StepJudgement] = field(default_factory=dict)

    @property
    def upto(self) -> int:
        """The last entry, 0 without any."""
        return self.entries[-1].seq if self.entries else 0

    @property
    def day(self) -> str | None:
        """The last day on which something of it was measured, None without entries."""
        return max((entry.day for entry in self.entries), default=None)

    @property
    def form(self) -> str | None:
        """The form of the last entry: a section holds one form only."""
        return self.entries[-1].form if self.entries else None

    def readings(self, name: str, index: int | None = None) -> tuple[EnteredValue, ...]:
        """The readings that make up a value: the last one that was no repeat, and the repeats after it."""
        mine = [e for e in self.entries if isinstance(e, EnteredValue) and (e.input, e.index) == (name, index)]
        first = max((i for i, reading in enumerate(mine) if not reading.repeat), default=0)
        return tuple(mine[first:])

    def link(self, name: str) -> FileLink | None:
        """The file last given for an input."""
        return next((e for e in reversed(self.entries) if isinstance(e, FileLink) and e.input == name), None)


Given = tuple[tuple[int, ...], int | None]


@dataclass(frozen=True)
class Attempt:
    """One go at a unit. verdict, judged, certificate: of the last judgement, None when an entry came after it; judged
    is all that was found, and from what. gap: what the gap workflow said last, with the last entry of the responses it
    was said of; None before."""

    number: int
    kind: str
    parts: Mapping[str, str]
    reason: str
    spec: str
    steps: Mapping[str, StepState] = field(default_factory=dict)
    undoable: tuple[int, ...] = ()
    verdict: str | None = None
    judged: Mapping[str, Any] | None = None
    certificate: str | None = None
    signatures: tuple[Signature, ...] = ()
    gap: tuple[int, Mapping[str, Any]] | None = None
    channels: Mapping[str, Any] = field(default_factory=dict)

    def step(self, name: str) -> StepState:
        return self.steps.get(name, StepState())

    @property
    def given(self) -> Given:
        """What a verdict goes by: the entries that stand, and the responses that the gap workflow answered for."""
        return self.undoable, None if self.gap is None else self.gap[0]


@dataclass(frozen=True)
class UnitRun:
    """A serial and its attempts, in order; seq: the last event folded in."""

    serial: str
    attempts: tuple[Attempt, ...] = ()
    seq: int = 0

    @property
    def attempt(self) -> Attempt | None:
        """The present attempt."""
        return self.attempts[-1] if self.attempts else None


def fold_run(serial: str, events: Iterable[Event]) -> UnitRun:
    """State of a unit after all its events. What was undone is passed over; it stays in the store.

    Raises StoreError for a payload that cannot be used.
    """
    stored = list(events)
    gone = {event.data.get("undoes") for event in stored if event.what == entries.UNDONE}
    run = UnitRun(serial, seq=stored[-1].seq if stored else 0)
    for event in stored:
        if event.seq not in gone:
            try:
                run = _STEPS.get(event.what, _nothing)(run, event, event.data)
            except (KeyError, TypeError, ValueError) as e:
                raise StoreError(f"{event.name}: its payload cannot be used: {type(e).__name__} {e}") from e
    return run


def _nothing(run: UnitRun, *_: Event | Mapping[str, Any]) -> UnitRun:
    return run


def _started(run: UnitRun, event: Event, data: Mapping[str, Any]) -> UnitRun:
    attempt = Attempt(
        int(data["number"]),
        str(data["kind"]),
        dict(data["parts"]),
        str(data["reason"]),
        event.spec,
        channels=dict(data.get("channels", {})),
    )
    return replace(run, attempts=(*run.attempts, attempt))


def _taken(run: UnitRun, event: Event, data: Mapping[str, Any]) -> UnitRun:
    names = ("form", "input", "value", "U", "unit", "index", "repeat", "source")
    given = {name: data[name] for name in names}
    return _entered(run, event, data["step"], EnteredValue(event.seq, **given, day=_day(event, data)))


def _linked(run: UnitRun, event: Event, data: Mapping[str, Any]) -> UnitRun:
    given = {name: data[name] for name in ("form", "input", "file", "sha256")}
    return _entered(run, event, data["step"], FileLink(event.seq, **given, day=_day(event, data)))


def _day(event: Event, data: Mapping[str, Any]) -> str:
    """The day that is stated, else that of the entry (UTC)."""
    return str(data.get("day") or event.time[:10])


def _entered(run: UnitRun, event: Event, step: str, entry: EnteredValue | FileLink) -> UnitRun:
    return _changed(run, event, step, lambda state: replace(state, entries=(*state.entries, entry)))


def _noted(run: UnitRun, event: Event, data: Mapping[str, Any]) -> UnitRun:
    note = Note(event.seq, event.who, str(data["text"]), bool(data["nonconformance"]))
    return _changed(run, event, data["step"], lambda state: replace(state, notes=(*state.notes, note)))


def _remeasured(run: UnitRun, event: Event, data: Mapping[str, Any]) -> UnitRun:
    def anew(state: StepState) -> StepState:
        earlier, reasons = (*state.earlier, *state.entries), (*state.reasons, str(data["reason"]))
        return replace(state, entries=(), earlier=earlier, reasons=reasons)

    return _changed(run, event, data["step"], anew)


def _changed(run: UnitRun, event: Event, step: str, change: Callable[[StepState], StepState]) -> UnitRun:
    """The run with one step changed. The unit's verdict no longer holds, after a note neither: the certificate has
    every note."""
    attempt = _present(run)
    steps = {**attempt.steps, step: change(attempt.step(step))}
    return _with(run, _unjudged(replace(attempt, steps=steps, undoable=(*attempt.undoable, event.seq))))


def _unjudged(attempt: Attempt) -> Attempt:
    return replace(attempt, verdict=None, judged=None, certificate=None, signatures=())


def _step_judged(run: UnitRun, event: Event, data: Mapping[str, Any]) -> UnitRun:
    attempt = _present(run)
    findings = tuple(finding_from_json(f) for f in data["findings"])
    information = tuple((str(q["check"]), information_from_json(q)) for q in data["information"])
    judgement = StepJudgement(int(data["upto"]), event.spec, event.code, findings, information, tuple(data["notes"]))
    state = attempt.step(data["step"])
    state = replace(state, judgements={**state.judgements, judgement.upto: judgement})
    return _with(run, replace(attempt, steps={**attempt.steps, data["step"]: state}))


def _explained(run: UnitRun, _: Event, data: Mapping[str, Any]) -> UnitRun:
    """A verdict that was given without it is given again with it: it goes on the certificate."""
    return _with(run, _unjudged(replace(_present(run), gap=(int(data["upto"]), dict(data["gap"])))))


def _judged(run: UnitRun, _: Event, data: Mapping[str, Any]) -> UnitRun:
    """Only of this attempt's own folder: a batch may have judged a folder of the same serial. Where the same was found
    once more, from the same inputs, spec and program, a certificate of it still holds."""
    attempt = run.attempt
    if attempt is None or Path(data["path"]).parts[-2:] != (run.serial, folder_name(attempt.number)):
        return run
    verdict = str(data["result"]["verdict"])
    if data == attempt.judged:
        return run
    return _with(run, replace(attempt, verdict=verdict, judged=dict(data), certificate=None, signatures=()))


def _undone(run: UnitRun, *_: Event | Mapping[str, Any]) -> UnitRun:
    """What was undone is passed over already; a verdict that was given with it no longer holds."""
    return _with(run, _unjudged(_present(run)))


def _signed(run: UnitRun, event: Event, data: Mapping[str, Any]) -> UnitRun:
    attempt = run.attempt
    if attempt is None or attempt.verdict is None:
        return run
    if Path(data["path"]).name != certificate_name(run.serial, attempt.number):
        return run
    signature = Signature(event.who, str(data["role"]), event.time)
    signatures = (*attempt.signatures, signature)
    return _with(run, replace(attempt, certificate=str(data["path"]), signatures=signatures))


def folder_name(number: int) -> str:
    """Name of an attempt's folder below that of its serial."""
    return f"attempt-{number}"


def certificate_name(serial: str, number: int) -> str:
    """File name of an attempt's certificate."""
    return f"{serial}.pdf" if number == 1 else f"{serial}_{folder_name(number)}.pdf"


def _present(run: UnitRun) -> Attempt:
    if run.attempt is None:
        raise ValueError("no attempt was started before it")
    return run.attempt


def _with(run: UnitRun, attempt: Attempt) -> UnitRun:
    return replace(run, attempts=(*run.attempts[:-1], attempt))


_STEPS: Mapping[str, Callable[[UnitRun, Event, Mapping[str, Any]], UnitRun]] = {
    entries.STARTED: _started,
    entries.TAKEN: _taken,
    entries.LINKED: _linked,
    entries.NOTED: _noted,
    entries.REMEASURED: _remeasured,
    entries.UNDONE: _undone,
    entries.STEP_JUDGED: _step_judged,
    entries.EXPLAINED: _explained,
    "unit_judged": _judged,
    "certificate_signed": _signed,
}
