"""Units that the bench has seen in the workflow, and what each of them waits for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from accept.base.documents.results import unit_word
from accept.store import Store
from accept.store.payloads import AttemptStarted, UnitJudged
from accept.workflow.state.unit_state import Attempt, StepState, fold_run
from accept.workflow.steps.plan import WorkflowStep, needs_rig, steps_of
from accept.workflow.steps.section import entry_words, ready
from accept.workflow.steps.status import UNFINISHED, Status, judgement_of, of_findings, open_steps, state_of, status_of
from checks.verdict import Finding, UnitVerdict
from specs.spec import Spec

ALL, SIGN, HELD, RIG = "all", "sign", "held", "rig"  # queues beside those of single steps
IN_HAND = "◉", "cyan"  # mark and style of the step at which a unit stands, once something was measured
LISTED = 200  # units begun last: a serial that is older is found by typing it


@dataclass(frozen=True)
class KnownUnit:
    """A serial, its last attempt, and how far that has come. steps: how many there are, 0 without a spec of its kind;
    waiting: those that are not complete; marks: mark, style and title of each step; at: title of the step at which it
    stands; findings: as they were judged last; note: the last one; held_by: the nonconformance; entered, measured,
    judged: times of the last entry, of the first one and of the verdict that holds."""

    serial: str
    kind: str
    attempt: int
    verdict: str | None
    signed: int
    taken: int
    begun_by: str = ""
    begun: str = ""  # UTC, ISO 8601
    last: str = ""  # the last entry, in words
    notes: int = 0
    held: bool = False
    steps: int = 0
    waiting: tuple[str, ...] = ()
    last_by: str = ""
    last_at: str = ""  # UTC, ISO 8601
    marks: tuple[tuple[str, str, str], ...] = ()
    at: str = ""
    findings: tuple[Finding, ...] = ()
    note: str = ""
    held_by: str = ""
    entered_by: str = ""
    entered: str = ""
    measured: str = ""
    judged: str = ""

    @property
    def words(self) -> str:
        end = {0: "not signed", 1: "signed", 2: "signed and countersigned"}[min(self.signed, 2)]
        begun = f"{'held, ' if self.held else ''}{self.taken} step{'s' if self.taken != 1 else ''} begun"
        state = f"{self._word}, {end}" if self._word else begun
        return f"attempt {self.attempt}: {state}"

    @property
    def _word(self) -> str | None:
        return self.verdict and unit_word(self.verdict, ("a nonconformance",) if self.held else ())

    @property
    def to_sign(self) -> bool:
        """Return whether everything was measured, and the result waits for the technician's signature."""
        return not self.signed and bool(self.steps) and not self.waiting

    @property
    def state(self) -> str:
        """Return where it stands, in a few words."""
        verdict = "held" if self.held and self.verdict != UnitVerdict.REJECTED else self.verdict
        if self.signed:
            return f"{verdict}, {'signed' if self.signed == 1 else 'QA signed'}"
        if self.to_sign:
            return f"{verdict or 'complete'}, to sign"
        done = f"{self.steps - len(self.waiting)} of {self.steps} steps" if self.steps else f"{self.taken} steps begun"
        if self.held:
            return f"held, {done}"
        return f"in {self.at}" if self.at and self.is_begun else done if self.is_begun else "new"

    @property
    def is_begun(self) -> bool:
        """Return whether anything was done at it in this attempt."""
        return bool(self.taken or self.notes)

    @property
    def waits_for_qa(self) -> bool:
        """Return whether quality assurance decides next: it is held, or signed and not accepted."""
        return self.signed <= 1 and (self.held or (bool(self.signed) and self.verdict != UnitVerdict.ACCEPTED))


@dataclass(frozen=True)
class Queue:
    """Units that wait for one thing, those begun first on top. name: a step, `sign`, `held`, `rig` or `all`; kind: of
    its units, "" for every kind."""

    name: str
    kind: str
    title: str
    units: tuple[KnownUnit, ...]

    @property
    def to_sign(self) -> bool:
        """Return whether its units wait for the technician's signature."""
        return self.name == SIGN

    def after(self, serial: str, begun: Sequence[str]) -> KnownUnit | None:
        """Return the unit that comes next behind another one, which need not wait any more, or from the top again; None
        if no other waits. begun: serials of all units, those begun first on top."""
        place = {each: n for n, each in enumerate(begun)}
        here = place.get(serial, -1)
        others = [unit for unit in self.units if unit.serial != serial]
        behind = [unit for unit in others if place.get(unit.serial, here) > here]
        return next(iter([*behind, *others]), None)

    @property
    def nothing_waits(self) -> str:
        """Return why no other unit is opened."""
        if self.name in (ALL, SIGN, HELD, RIG):
            return f"No other unit waits: {self.title}"
        return f"No other unit waits for {self.title}: all the others have it"

    def renewed(self, units: Sequence[KnownUnit], specs: Mapping[str, Spec]) -> "Queue":
        same = (queue for queue in queues(units, specs) if (queue.name, queue.kind) == (self.name, self.kind))
        return next(same, replace(self, units=()))

    def step_at(self, waiting: Sequence[WorkflowStep]) -> str:
        """Return the step at which a unit of the queue is opened, "" for its summary. waiting: its open steps."""
        if self.name == RIG:
            return next((step.name for step in waiting if needs_rig(step)), "")
        return "" if self.name in (ALL, SIGN, HELD) else self.name


def queues(units: Sequence[KnownUnit], specs: Mapping[str, Spec]) -> list[Queue]:
    """Return what the units wait for: all of them as they were given, then what is to be signed, what is held, what
    needs the rig, and each step, by kind. A queue without units is left out. units: the newest first."""
    oldest = units[::-1]
    found = [
        Queue(ALL, "", "All units", tuple(units)),
        Queue(SIGN, "", "To sign", tuple(unit for unit in oldest if unit.to_sign)),
        Queue(HELD, "", "Held for QA", tuple(unit for unit in oldest if unit.waits_for_qa)),
        Queue(RIG, "", "For the rig", tuple(unit for unit in oldest if rig_steps(unit, specs))),
    ]
    kinds = [kind for kind in specs if any(unit.kind == kind for unit in units)]
    for kind in kinds:
        for step in steps_of(specs[kind]):
            waiting = tuple(unit for unit in oldest if unit.kind == kind and step.name in unit.waiting)
            found.append(Queue(step.name, kind, f"{step.short}{f', {kind}' if len(kinds) > 1 else ''}", waiting))
    return [queue for queue in found if queue.units or queue.name == ALL]


def rig_steps(unit: KnownUnit, specs: Mapping[str, Spec]) -> list[str]:
    """Return the steps that wait for the rig."""
    steps = steps_of(specs[unit.kind]) if unit.kind in specs else ()
    return [step.name for step in steps if step.name in unit.waiting and needs_rig(step)]


def known_units(store: Store, specs: Mapping[str, Spec]) -> list[KnownUnit]:
    """Return the units whose attempts were begun last, the newest first. Raises StoreError."""
    last = {event.subject: event.seq for event in store.last_of_each(AttemptStarted.KIND)}
    serials = sorted(last, key=lambda serial: -last[serial])[:LISTED]
    found = (known_unit(store, serial, specs) for serial in serials)
    return [unit for unit in found if unit is not None]


def known_unit(store: Store, serial: str, specs: Mapping[str, Spec]) -> KnownUnit | None:
    """Return the entry of one serial, None for a new one. Raises StoreError."""
    events = list(store.events(serial))
    attempt = fold_run(serial, events).attempt
    if attempt is None:
        return None
    begun = [event for event in events if event.what == AttemptStarted.KIND][-1]
    entries = sorted((entry for state in attempt.steps.values() for entry in state.entries), key=lambda each: each.seq)
    notes = sorted((note for state in attempt.steps.values() for note in state.notes), key=lambda note: note.seq)
    held: Sequence[str] = [note.text for note in notes if note.nonconformance]
    if attempt.judged is not None:  # it knows those of earlier attempts too
        stated = attempt.judged.result.nonconformances
        held = (held or stated) if stated else ()
    times = {event.seq: event.time for event in events}
    verdicts = [event.time for event in events if event.what == UnitJudged.KIND]
    unit = KnownUnit(
        serial,
        attempt.kind,
        attempt.number,
        attempt.verdict,
        signed=len(attempt.signatures),
        taken=sum(1 for state in attempt.steps.values() if state.entries),
        begun_by=begun.who,
        begun=begun.time,
        last_by=events[-1].who,
        last_at=events[-1].time,
        notes=len(notes),
        note=notes[-1].text if notes else "",
        held=bool(held),
        held_by=held[0] if held else "",
        judged=verdicts[-1] if verdicts and attempt.judged is not None else "",
    )
    if entries:
        first, last = entries[0], entries[-1]
        words, entered, measured = entry_words(last), times[last.seq], times[first.seq]
        unit = replace(unit, last=words, entered_by=last.who, entered=entered, measured=measured)
    return unit if attempt.kind not in specs else _with_steps(unit, attempt, specs[attempt.kind])


def _with_steps(unit: KnownUnit, attempt: Attempt, spec: Spec) -> KnownUnit:
    steps, spec_name = steps_of(spec), spec.with_hash
    states = {step.name: state_of(attempt, step) for step in steps}
    waiting = [step.name for step in open_steps(steps, states, spec_name)]
    found = dict[str, Sequence[Finding]]()
    for step in steps:  # of the unit's verdict where it has one, else of the step's own judgement if that still holds
        own = judgement_of(states[step.name], spec_name)
        found[step.name] = () if own is None else own.findings
        if attempt.judged is not None:
            found[step.name] = [each for each in attempt.judged.result.findings if each.check == step.name]
    stands_at = waiting[0] if attempt.undoable and waiting else ""
    return replace(
        unit,
        steps=len(steps),
        waiting=tuple(waiting),
        at=next((step.short for step in steps if step.name in waiting), ""),
        marks=tuple((*_mark(step, states[step.name], found[step.name], stands_at), step.short) for step in steps),
        findings=tuple(finding for findings in found.values() for finding in findings),
    )


def _mark(step: WorkflowStep, state: StepState, found: Sequence[Finding], stands_at: str) -> tuple[str, str]:
    """Return mark and style of a step, as the list of steps has them, or that the unit stands there."""
    status = of_findings(found) if found and ready(step, state) else status_of(step, state, None)
    if any(note.nonconformance for note in state.notes) and status in (*UNFINISHED, Status.PASS):
        status = Status.HELD
    return IN_HAND if step.name == stands_at and status is Status.NOT_DONE else (status.mark, status.style)
