"""The state of a unit in the workflow, which is a fold over its events and nothing else."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from accept.store import Event, Signature, StoreError, UnitState, after, undone
from accept.store.payloads import (
    AttemptStarted,
    CertificateSigned,
    EntryUndone,
    GapExplained,
    Payload,
    RecordLinked,
    RecordRefused,
    StepJudged,
    StepNoted,
    StepRemeasured,
    UnitJudged,
    ValueTaken,
    payload_of,
)
from accept.units import attempt_folder


@dataclass(frozen=True)
class StepState:
    """Entries at a step since it was last measured anew. earlier: entries of the rounds before, which stay; refused:
    records that could not be taken and in whose place nothing was given since, by input; unusable: when [s since 1970]
    each file that was ever refused here had been written, by its path."""

    entries: tuple[ValueTaken | RecordLinked, ...] = ()
    earlier: tuple[ValueTaken | RecordLinked, ...] = ()
    reasons: tuple[str, ...] = ()
    notes: tuple[StepNoted, ...] = ()
    judgements: Mapping[int, StepJudged] = field(default_factory=dict)
    refused: Mapping[str, RecordRefused] = field(default_factory=dict)
    unusable: Mapping[str, float] = field(default_factory=dict)

    @property
    def upto(self) -> int:
        """Return the number of the last entry, 0 without any."""
        return self.entries[-1].seq if self.entries else 0

    @property
    def day(self) -> str | None:
        """Return the last day on which an entry was measured, None without entries."""
        return max((entry.on for entry in self.entries), default=None)

    @property
    def form(self) -> str | None:
        """Return the form of the last entry: a section holds one form only."""
        return self.entries[-1].form if self.entries else None

    def readings(self, name: str, index: int | None = None) -> tuple[ValueTaken, ...]:
        """Return the readings that make up a value: the last one that was no repeat, and the repeats after it."""
        mine = [e for e in self.entries if isinstance(e, ValueTaken) and (e.input, e.index) == (name, index)]
        first = max((i for i, reading in enumerate(mine) if not reading.repeat), default=0)
        return tuple(mine[first:])

    def link(self, name: str) -> RecordLinked | None:
        """Return the file last given for an input, None without one."""
        return next((e for e in reversed(self.entries) if isinstance(e, RecordLinked) and e.input == name), None)


Given = tuple[tuple[int, ...], int | None]


@dataclass(frozen=True)
class Attempt:
    """One attempt at a unit. judged, certificate: of the last judgement, None if an entry came after it. gap: the last
    answer of the gap workflow, with the last entry of the responses that it explains; None before."""

    number: int
    kind: str
    parts: Mapping[str, str]
    reason: str
    spec: str
    steps: Mapping[str, StepState] = field(default_factory=dict)
    undoable: tuple[int, ...] = ()
    judged: UnitJudged | None = None
    certificate: str | None = None
    void: str | None = None  # its certificate from before the last change, None if it holds or there was none
    signatures: tuple[Signature, ...] = ()
    gap: tuple[int, Mapping[str, Any]] | None = None
    channels: Mapping[str, Any] = field(default_factory=dict)
    simulated: bool = False  # no instrument measures the unit

    @property
    def verdict(self) -> str | None:
        return None if self.judged is None else str(self.judged.result.verdict)

    def step(self, name: str) -> StepState:
        return self.steps.get(name, StepState())

    @property
    def given(self) -> Given:
        """Return the inputs of a verdict: the entries that stand, and the responses that the gap workflow explained."""
        return self.undoable, None if self.gap is None else self.gap[0]


@dataclass(frozen=True)
class UnitRun:
    """A serial and its attempts, in order; state: its judgements and certificates; seq: the last event folded in."""

    serial: str
    attempts: tuple[Attempt, ...] = ()
    state: UnitState | None = None
    seq: int = 0

    @property
    def attempt(self) -> Attempt | None:
        """Return the present attempt, None before the first."""
        return self.attempts[-1] if self.attempts else None


def fold_run(serial: str, events: Iterable[Event]) -> UnitRun:
    """Return the state of a unit after all its events. Undone entries are left out; they stay in the store.

    Raises StoreError if a payload cannot be used.
    """
    stored = [(event, payload_of(event)) for event in events]
    gone = undone(event for event, _ in stored)
    begun = {event.seq for event, payload in stored if isinstance(payload, AttemptStarted)}
    run = UnitRun(serial, seq=stored[-1][0].seq if stored else 0)
    for event, payload in stored:
        run = replace(run, state=after(run.state, event, payload))
        if event.seq in gone or (isinstance(payload, EntryUndone) and payload.undoes in begun):
            continue
        if isinstance(payload, AttemptStarted):
            own = payload.number, payload.kind, payload.parts, payload.reason
            begun_now = Attempt(*own, event.spec, channels=payload.channels, simulated=payload.simulated)
            run = replace(run, attempts=(*run.attempts, begun_now))
        elif run.attempt is not None:
            run = replace(run, attempts=(*run.attempts[:-1], _changed(serial, run.attempt, event, payload)))
        elif isinstance(payload, _OF_ATTEMPTS):
            raise StoreError(f"{event.name}: no attempt was started before it")
    return run


def _changed(serial: str, attempt: Attempt, event: Event, payload: Payload | None) -> Attempt:
    """Return the attempt after an event. A verdict no longer holds after an entry, nor after a note, since the
    certificate has every note; nor after the gap workflow, whose answer goes on the certificate."""
    match payload:
        case ValueTaken() | RecordLinked():
            return _entered(attempt, event, payload)
        case RecordRefused(step, input=name) as refused:  # nothing that is judged has changed
            state = attempt.step(step)
            unusable = {**state.unusable, refused.origin: refused.written}
            return _with_state(attempt, step, refused={**state.refused, name: refused}, unusable=unusable)
        case StepNoted(step) as noted:
            note = replace(noted, seq=event.seq, who=event.who)
            return _with_step(attempt, event, step, notes=(*attempt.step(step).notes, note))
        case StepRemeasured(step, reason):
            state = attempt.step(step)
            earlier, reasons = (*state.earlier, *state.entries), (*state.reasons, reason)
            return _with_step(attempt, event, step, entries=(), earlier=earlier, reasons=reasons, refused={})
        case EntryUndone():  # what was undone is passed over already
            return _unjudged(attempt)
        case GapExplained(upto, gap):
            return _unjudged(replace(attempt, gap=(upto, gap)))
        case StepJudged() as judged:
            own = replace(judged, spec=event.spec, code=event.code)
            known = {**attempt.step(judged.step).judgements, judged.upto: own}
            return _with_state(attempt, judged.step, judgements=known)
        case UnitJudged() as judged if Path(judged.path).parts[-2:] == (serial, attempt_folder(attempt.number)):
            return _judged(attempt, judged)  # of this attempt's folder: a batch may judge another of the same serial
        case CertificateSigned(path, _, role) if attempt.verdict is not None:
            if Path(path).name == certificate_name(serial, attempt.number):
                signatures = (*attempt.signatures, Signature(event.who, role, event.time))
                return replace(attempt, certificate=path, signatures=signatures, void=None)
    return attempt


def _entered(attempt: Attempt, event: Event, taken: ValueTaken | RecordLinked) -> Attempt:
    entry = replace(taken, seq=event.seq, who=event.who, on=taken.day or event.time[:10])  # UTC
    state = attempt.step(taken.step)
    refused = {n: r for n, r in state.refused.items() if n != taken.input and r.form == taken.form}
    return _with_step(attempt, event, taken.step, entries=(*state.entries, entry), refused=refused)


def _with_step(attempt: Attempt, event: Event, step: str, **changes: Any) -> Attempt:
    """Return the attempt with one step changed by an event that can be undone."""
    return _unjudged(replace(_with_state(attempt, step, **changes), undoable=(*attempt.undoable, event.seq)))


def _with_state(attempt: Attempt, step: str, **changes: Any) -> Attempt:
    return replace(attempt, steps={**attempt.steps, step: replace(attempt.step(step), **changes)})


def _unjudged(attempt: Attempt) -> Attempt:
    return replace(attempt, judged=None, certificate=None, signatures=(), void=attempt.certificate or attempt.void)


def _judged(attempt: Attempt, judged: UnitJudged) -> Attempt:
    """Return the attempt with its verdict. If an earlier judgement found the same, from the same inputs, spec and
    program, its certificate still holds."""
    if attempt.judged is not None and replace(judged, reason=attempt.judged.reason) == attempt.judged:
        return attempt
    return replace(attempt, judged=judged, certificate=None, signatures=(), void=attempt.certificate or attempt.void)


def certificate_name(serial: str, number: int) -> str:
    """Return the file name of an attempt's certificate."""
    return f"{serial}.pdf" if number == 1 else f"{serial}_{attempt_folder(number)}.pdf"


_ENTRIES = (ValueTaken, RecordLinked, RecordRefused)
_OF_ATTEMPTS = (*_ENTRIES, StepNoted, StepRemeasured, EntryUndone, StepJudged, GapExplained)
