"""The state of the dialogue at one step, and the sentences that follow from it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from accept.judging.advice import ADVICE, first_advice
from accept.store.payloads import StepJudged
from accept.workflow.dialogue import turn
from accept.workflow.dialogue.step_effects import Place
from accept.workflow.dialogue.turn import FootWords
from accept.workflow.entry.record_folder import PickableFile, Proposals, age_words
from accept.workflow.state.unit_state import StepState
from accept.workflow.steps import section
from accept.workflow.steps.plan import WorkflowStep, has_files, is_needed, needs_rig
from accept.workflow.steps.section import is_given, ready, records_awaited
from accept.workflow.steps.status import Status
from accept.workflow.steps.unit_list import RIG, Queue
from checks.acceptance import CHECKS
from checks.cause import Cause
from checks.declare import CsvTable, Form, Input, Series


@dataclass(frozen=True)
class FieldPlace:
    """The place of one value or file; index: place in a vector."""

    declared: Input
    index: int | None = None
    among_optional: bool = False  # no input of the form is needed more than the others

    @property
    def key(self) -> Place:
        return self.declared.name, self.index

    @property
    def is_file(self) -> bool:
        return isinstance(self.declared, Series | CsvTable)

    @property
    def unit(self) -> str:
        return "" if self.is_file else str(getattr(self.declared, "unit", ""))

    @property
    def name(self) -> str:
        declared = self.declared
        return declared.label if self.index is None else f"{getattr(declared, 'item', 'value')} {self.index + 1}"

    @property
    def label(self) -> str:
        needed = "" if is_needed(self.declared) or self.among_optional else " (optional)"
        return self.name[0].upper() + self.name[1:] + needed

    @property
    def default(self) -> float | None:
        return getattr(self.declared, "default", None)

    @property
    def hint(self) -> str:
        if self.is_file:
            return "F2: choose a file"
        return f"{self.default:g} {self.unit}" if self.default is not None else self.unit


def places(form: Form) -> Iterator[FieldPlace]:
    """Yield the places of a form, one per value that is typed or file that is linked."""
    alike = not any(map(is_needed, form.inputs))
    for declared, index in section.places(form.inputs):
        yield FieldPlace(declared, index, alike)


@dataclass(frozen=True)
class FieldLine:
    """One line. text: typed, not saved; pending: entries on their way to the store; doubted: the entry in question, as
    typed, or None; repeats: it is one more reading; refusal: why the last entry was not saved, "" for none."""

    place: FieldPlace
    text: str = field(default="", repr=False)
    pending: int = 0
    doubted: str | None = field(default=None, repr=False)
    question: str = field(default="", repr=False)
    repeats: bool = False
    refusal: str = field(default="", repr=False)


SAVES = ". Enter: save the field"


@dataclass(frozen=True)
class StepFacts:
    """The unit and its bench, as far as a step needs them. seq: the last event; judgement: that holds; source_action:
    what to put right at the records of a derived step; waiting: steps that are not complete; queue: what is done at one
    unit after the other; offers: what the instrument of a line gives; records: whether the bench measures the step."""

    serial: str
    kind: str
    seq: int
    state: StepState
    status: Status
    judgement: StepJudged | None = None
    source_action: str | None = None
    has_next: bool = False
    waiting: tuple[WorkflowStep, ...] = ()
    queue: Queue | None = None
    offers: Mapping[Place, str] = field(default_factory=dict)
    records: bool = False
    undoable: bool = False
    training: bool = False


@dataclass(frozen=True)
class StepDialogue:
    """State of a step's screen. cursor: the line that is typed into; given: the line that was given last, from which
    the arrows go on; asked: the line whose value the foot asks about; again: the line at which F3 was pressed once;
    chosen: the technician chose the form; reads, measures, judges: a reading, a measurement of the whole step, a
    judgement is under way; stopped: the last judgement was; early: F3 was pressed during a reading; hints: the foot
    shows the line's hint; looked: time of the proposals [s since 1970]; whole: with values without limits."""

    step: WorkflowStep
    facts: StepFacts
    form: Form
    lines: tuple[FieldLine, ...] = ()
    cursor: int | None = None
    given: int | None = None
    asked: int | None = None
    again: int | None = None
    proposals: Proposals = field(default_factory=dict)
    looked: float = 0.0
    chosen: bool = False
    reads: bool = False
    measures: bool = False
    early: bool = False
    judges: bool = False
    stopped: bool = False
    hints: bool = False
    whole: bool = False

    def with_line(self, n: int, **changes: Any) -> "StepDialogue":
        return replace(self, lines=(*self.lines[:n], replace(self.lines[n], **changes), *self.lines[n + 1 :]))

    def typed(self, texts: tuple[str, ...], cursor: int | None) -> "StepDialogue":
        """Return the state after editing. An emptied line is not in question any more."""
        lines = [
            line if line.text == text else replace(line, text=text, doubted=line.doubted if text else None)
            for line, text in zip(self.lines, texts, strict=True)
        ]
        return replace(self, lines=tuple(lines), cursor=cursor)

    def laid_out(self, form: Form, proposals: Proposals, now: float) -> "StepDialogue":
        """Return the state with the lines of a form, none of them begun."""
        refused = {name: f"✗ {record.line}\n→ {record.action}" for name, record in self.facts.state.refused.items()}
        lines = [FieldLine(place, refusal=refused.get(place.key[0], "")) for place in places(form)]
        return replace(
            self, form=form, lines=tuple(lines), proposals=proposals, looked=now, cursor=None, given=None, asked=None
        )

    def at(self, place: Place) -> int | None:
        """Return the line of a place, None if another form is laid out."""
        return next((n for n, line in enumerate(self.lines) if line.place.key == place), None)

    @property
    def here(self) -> FieldLine | None:
        return None if self.cursor is None else self.lines[self.cursor]

    @property
    def in_question(self) -> bool:
        """Return whether the foot asks about a value."""
        return self.asked is not None and self.lines[self.asked].doubted is not None

    @property
    def doubted(self) -> Sequence[int]:
        """Return the lines whose value is asked about."""
        return [n for n, line in enumerate(self.lines) if line.doubted is not None]

    def has(self, n: int) -> bool:
        """Return whether a value or file of this line is saved."""
        place = self.lines[n].place
        return is_given(place.declared, place.index, self.facts.state)

    def file(self, n: int) -> PickableFile | None:
        """Return the record for an empty line, which may be damaged; None without one."""
        line = self.lines[n]
        free = line.place.is_file and not line.pending and not self.has(n)
        return self.proposals.get(line.place.key[0]) if free else None

    def proposed(self, n: int) -> PickableFile | None:
        """Return the record that Enter takes in this line, None without one."""
        file = self.file(n)
        return file if file is not None and not file.damage else None

    def reason(self, n: int) -> tuple[str, str]:
        """Return the words below a line and their kind: `doubted`, `refused`, `proposed` or ""."""
        line, file, proposed = self.lines[n], self.file(n), self.proposed(n)
        if line.doubted is not None:
            return f"? {line.question}. ^K or F9: keep it", "doubted"
        why = line.refusal or (f"✗ {file.damage}\n→ {ADVICE[Cause.FILE_DAMAGED]}" if file and file.damage else "")
        takes = "Enter: take " if line.refusal and n == self.cursor else ""
        offer = f"→ {takes}{self.described(proposed)}" if proposed else ""
        return "\n".join(filter(None, (why, offer))), "refused" if why else "proposed" if offer else ""

    def described(self, file: PickableFile) -> str:
        return f"{file.name}, {age_words(file.mtime, self.looked)}"

    @property
    def refused(self) -> int | None:
        """Return the first line whose entry was refused and still stands there."""
        return next((n for n, x in enumerate(self.lines) if self.reason(n)[1] == "refused" and x.text.strip()), None)

    @property
    def begun(self) -> bool:
        """Return whether something was given, or typed without Enter."""
        return bool(self.facts.state.entries) or any(line.text or line.pending for line in self.lines)

    @property
    def complete(self) -> bool:
        return ready(self.step, self.facts.state)

    @property
    def awaits_records(self) -> bool:
        """Return whether optional records of this step may still arrive."""
        return records_awaited(self.step, self.facts.state)

    @property
    def is_bad(self) -> bool:
        return self.facts.status in (Status.FAIL, Status.NO_RESULT)

    @property
    def stoppable(self) -> bool:
        """Return whether Escape stops something: measuring, or a comparison with a model."""
        return self.measures or (self.judges and self.step.check.model is not None)

    @property
    def is_read(self) -> bool:
        """Return whether an instrument reads a value of the present form."""
        return any(place.key in self.facts.offers for place in places(self.form) if not place.is_file)

    @property
    def own_queue(self) -> Queue:
        return Queue(self.step.name, self.facts.kind, self.step.short, ())

    @property
    def queue(self) -> Queue | None:
        """Return the queue that this step is part of, None without one."""
        queue = self.facts.queue
        at_rig = queue is not None and queue.name == RIG and needs_rig(self.step)
        return queue if at_rig or (queue is not None and queue.name == self.step.name) else None

    @property
    def next_at_rig(self) -> WorkflowStep | None:
        """Return the step that this unit still waits for in the queue of the rig; None for none or in another queue: a
        unit leaves the rig when all of its steps there are done."""
        name = self.queue.step_at(self.facts.waiting) if self.queue is not None and self.queue.name == RIG else ""
        return next((step for step in self.facts.waiting if step.name == name), None)

    @property
    def ends_in_summary(self) -> bool:
        """Return whether Enter opens the summary from here."""
        return self.queue is None and not self.facts.has_next

    @property
    def left_words(self) -> str:
        return f"{self.facts.serial}: {self.facts.status.mark} {self.facts.status.word}. "

    @property
    def lacking(self) -> str:
        """Return what is still to be given, in words; lines show it themselves."""
        if not self.step.derived or self.complete:
            return ""
        other = CHECKS[self.step.check.reads]
        return f"Load the records of '{other.short or other.title}' first"

    @property
    def judging_words(self) -> str:
        """Return the words in place of the findings, "" to show the findings."""
        if self.step.check.model is None:
            return "Evaluating … (Esc: back; entries are kept)" if self.judges else ""
        lacks = self.stopped and self.complete and self.facts.judgement is None  # an earlier one still holds
        stopped = "Not compared. F3: compare again, Esc: back" if lacks else ""
        return "Comparing with the model … (Esc: stop)" if self.judges else stopped

    @property
    def complete_words(self) -> str:
        """Return what Enter and its neighbours do at a complete step."""
        summary = "" if self.ends_in_summary else ", F9: summary"
        return f"{self.put_right_first or 'Step complete'}. {self.enter_words}{summary}, ↑ ↓: correct, Esc: steps"

    @property
    def enter_words(self) -> str:
        if (at_rig := self.next_at_rig) is not None:
            if at_rig.name == self.step.name:
                return "Enter: this step again"
            return f"Leave {self.facts.serial} mounted. Enter: its next step, {at_rig.short}"
        if self.queue is not None:
            return "Enter: next unit"
        return f"Enter: {'summary' if self.ends_in_summary else 'next step'}, F10: next unit"

    @property
    def put_right_first(self) -> str:
        """Return the status of a step that failed or has no result, and how to measure it again, after what its result
        advises; "" of any other."""
        if self.facts.judgement is None or not self.is_bad:
            return ""
        advised = self.facts.source_action or first_advice(self.facts.judgement.findings)
        first = "^R: repair (training)" if self.facts.training else "do what → says" if advised else ""
        again = "" if self.step.derived and first else "record again" if self.step.derived else "F8: measure again"
        return f"{self.facts.status.word.capitalize()}: {', then '.join(filter(None, (first, again)))}"

    @property
    def what_now(self) -> str:
        """Return what the line under the cursor wants, and which key gives it; without a cursor, how to go on."""
        if self.cursor is None:
            return self.complete_words if self.complete or self.step.derived else "↑ ↓: choose a field"
        place, first = self.lines[self.cursor].place, self.put_right_first
        optional = self.leaves_out(place) and not place.among_optional
        if self.has(self.cursor):
            repeats = "" if place.is_file else ", F4 repeats it"
            words = f"{place.name} is saved. What is given now replaces it{repeats}"
        elif first and self.dispensable:  # nothing that may be given here puts the step right
            words = f"{'' if 'F8' in first else 'F8: measure again. '}{self.enter_words}"
        else:
            words = self._wanted(self.cursor, optional)
            first = first if optional or place.among_optional else ""
        return f"{first}. {words}" if first else words

    def _wanted(self, n: int, optional: bool) -> str:
        """Return which key gives an empty line its value."""
        place, proposed, offer = self.lines[n].place, self.proposed(n), self.facts.offers.get(self.lines[n].place.key)
        if proposed is not None:
            words = f"Enter: take {proposed.name}, F2: another file"
        elif place.is_file:
            words = f"{'F3: measure, ' if self.facts.records else ''}F2: choose the file"
        else:
            words = f"F3: take {offer}, or type it{SAVES}" if offer else f"Type the value{SAVES}"
        if proposed is None and self.leaves_out(place):
            without = "go on without it" if place.default is None else f"keep {place.default:g} {place.unit}"
            words = f"{words.replace(SAVES, '')}. Enter: {without}"
        return f"Optional: {place.name}. {words}" if optional else words

    @property
    def hint(self) -> FootWords:
        """Return what the present line wants, and which key gives it."""
        damaged = next((n for n in range(len(self.lines)) if self.file(n) and not self.proposed(n)), None)
        if damaged is not None and self.cursor in (None, damaged):
            way = "^R: repair (training)" if self.facts.training else "F2: another file"
            return FootWords(f"{self.lines[damaged].place.name}: {ADVICE[Cause.FILE_DAMAGED]}. {way}", "bad")
        return FootWords(self.what_now)

    @property
    def dispensable(self) -> bool:
        """Return whether Enter may go past all that is still empty: the step was judged, and nothing that could be
        given here is missing for a result."""
        judgement = self.facts.judgement if self.complete else None
        needed = self.here is not None and is_needed(self.here.place.declared)
        if judgement is None or needed or any(self.proposed(n) for n in range(len(self.lines))):
            return False
        causes = {r.cause for f in judgement.findings if f.cause is not None for r in f.cause.all()}
        return not causes & {Cause.NOT_MEASURED, Cause.ENTRY_MISSING}

    @property
    def called(self) -> Mapping[str, str]:
        """Return the names of keys that are called otherwise at this step."""
        own = {"f3": "Compare"} if self.step.derived else {}
        return {"enter": self.enter_label, **own, **({"escape": "Stop"} if self.stoppable else {})}

    def leaves_out(self, place: FieldPlace) -> bool:
        """Return whether Enter goes on without this value."""
        return self.complete if place.among_optional else not is_needed(place.declared)

    @property
    def main_key(self) -> str:
        """Return the key that is meant to be pressed next."""
        if self.measures:
            return "escape"
        if self.in_question:
            return "ctrl+k"
        place = None if self.here is None else self.here.place
        if place is not None and self.cursor is not None and not self.lines[self.cursor].text.strip():
            if self.has(self.cursor) or self.file(self.cursor) is not None or self.dispensable:
                return "enter"
            refused = self.reason(self.cursor)[1] == "refused"
            if place.is_file and (refused or not self.leaves_out(place)):
                dead = self.facts.training and refused  # a file as it was is no help
                return "ctrl+r" if dead else "f3" if self.facts.records else "f2"
            return "f3" if place.key in self.facts.offers else "enter"
        if self.put_right_first and not self.step.derived and self.cursor is None:
            return "ctrl+r" if self.facts.training else "f8"
        return "f3" if self.step.derived and self.facts.judgement is None and not self.stoppable else "enter"

    @property
    def enter_label(self) -> str:
        """Return what Enter does now, in a word or two."""
        if self.cursor is not None and self.here is not None:
            if self.here.text.strip():
                return "Save"
            if self.proposed(self.cursor) is not None:
                return "Take it"
            needed = is_needed(self.here.place.declared) and not self.has(self.cursor)
            typed = "Take typed" if self.here.place.is_file else "Save typed"
            return typed if needed and not self.dispensable else "Go on"
        if self.next_at_rig is None and self.queue is not None:
            return "Next unit"
        return "Summary" if self.ends_in_summary else "Next step"

    def means(self, key: str) -> bool:
        if key == "ctrl+r":
            return self.facts.training
        if key == "ctrl+f":
            return len(self.step.check.forms) > 1 and not self.step.derived
        return not self.step.derived or key in ("enter", "f3", "f5", "f9", "f10", "ctrl+d")

    @property
    def idle_keys(self) -> set[str]:
        """Return the keys that only say why they do nothing at present."""
        if self.measures:
            return {"enter", "ctrl+f", "ctrl+k", "ctrl+r", "ctrl+z", *(f"f{n}" for n in (2, 3, 4, 8, 9, 10))}
        more = {key for key, active in {"ctrl+k": self.in_question, "f10": self.complete}.items() if not active}
        if not self.lines:
            return more
        place = None if self.here is None else self.here.place
        is_value, reads = place is not None and not place.is_file, place is not None and place.key in self.facts.offers
        does = {
            "f2": has_files(self.form),
            "f3": reads or (place is not None and place.is_file and self.facts.records),
            "f4": is_value and (reads or (self.cursor is not None and self.has(self.cursor))),
            "f8": bool(self.facts.state.entries),
            "ctrl+z": self.facts.undoable,
        }
        return more | {key for key, active in does.items() if not active}


Turn = turn.Turn[StepDialogue]
