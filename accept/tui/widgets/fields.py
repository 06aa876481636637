"""One line of a form for each place where a value or a file goes, made from what the check declares."""

from collections.abc import Iterator
from dataclasses import dataclass

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Static

from accept.judging.advice import ADVICE
from accept.tui.widgets.limit_bar import numbers
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.record_folder import PickableFile, age_words
from accept.workflow.state.unit_state import StepJudgement, StepState
from accept.workflow.steps.plan import WorkflowStep, is_needed
from accept.workflow.steps.section import Repeated, repeated
from checks.cause import Cause
from checks.declare import CsvTable, Form, Scalar, Series, Vector
from checks.declare import Input as Declared
from checks.rounding import rounded

SAVED = "▪"  # what is saved is not yet judged: no mark of a verdict


@dataclass(frozen=True)
class FieldPlace:
    """Where one value or file goes; index: place in a vector."""

    declared: Declared
    index: int | None = None
    among_optional: bool = False  # no input of the form is needed more than the others

    @property
    def is_file(self) -> bool:
        return isinstance(self.declared, Series | CsvTable)

    @property
    def unit(self) -> str:
        return "" if self.is_file else str(getattr(self.declared, "unit", ""))

    @property
    def name(self) -> str:
        """Return what it is called in a sentence."""
        declared = self.declared
        return declared.label if self.index is None else f"{getattr(declared, 'item', 'value')} {self.index + 1}"

    @property
    def label(self) -> str:
        needed = "" if is_needed(self.declared) or self.among_optional else " (optional)"
        return self.name[0].upper() + self.name[1:] + needed

    @property
    def hint(self) -> str:
        """Return what an empty field shows."""
        if self.is_file:
            return "F2: choose a file"
        default = getattr(self.declared, "default", None)
        return f"{default:g} {self.unit}" if default is not None else self.unit


def places(form: Form) -> Iterator[FieldPlace]:
    """Yield the places of a form, one per value that is typed or file that is linked."""
    alike = not any(map(is_needed, form.inputs))
    for declared in form.inputs:
        if isinstance(declared, Vector):
            yield from (FieldPlace(declared, index) for index in range(declared.size))
        else:
            yield FieldPlace(declared, among_optional=alike)


class Field(Vertical):
    """Label, what is typed, and beside it what is saved; below, why it was refused or what is asked about it.

    pending: entries on their way to the store. doubted: what was typed and is asked about, None without. proposed: a
    record that fits, which Enter takes; None without. damaged: why the record that belongs here cannot be read.
    """

    def __init__(self, place: FieldPlace, step: WorkflowStep, state: StepState) -> None:
        super().__init__(classes="field")
        self.place, self._step, self._state = place, step, state
        self.pending = 0
        self.doubted: str | None = None
        self.question = ""  # that is asked about it
        self.proposed: PickableFile | None = None
        self.damaged = ""
        refused = state.refused.get(place.declared.name)
        self._refusal = f"✗ {refused.line}\n→ {refused.action}" if refused else ""  # of the last entry

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield Label(self.place.label, classes="label", markup=False)
            yield TextEntry(placeholder=self.place.hint)
            yield Static("", classes="stored", markup=False)
        yield Static("", classes="reason", markup=False)

    def on_mount(self) -> None:
        self.show(self._state)

    def on_input_changed(self, event: Input.Changed) -> None:
        """Give a line its room when something is typed in it: before, what is saved stands in one column. Nothing is
        asked about an emptied line."""
        self.set_class(bool(event.value), "typing")
        if not event.value and self.doubted is not None:
            self.doubted = None
            self._reason("", "")

    @property
    def input(self) -> Input:
        return self.query_one(Input)

    def show(self, state: StepState, judgement: StepJudgement | None = None) -> None:
        """Show what is saved for this place. judgement: what stands above it on the screen."""
        words = stored_words(self.place, self._step, state, judgement)
        blank = "\N{NO-BREAK SPACE}" if self.place.is_file else " "  # a long name begins beside its mark
        self._put(".stored", f"{SAVED}{blank}{words}" if words else "")
        self.set_class(bool(words), "has-stored")
        for line in self.query(Input):
            line.placeholder = "" if words and self.place.is_file else self._hint()  # the name takes its room

    def _hint(self) -> str:
        return self.place.hint if self.proposed is None else "Enter: take it"

    def propose(self, file: PickableFile | None) -> None:
        """Propose a record, or none, or say why the one that belongs here cannot be taken; what was refused there keeps
        its reason, above a proposal."""
        self.proposed = file if file is not None and not file.damage else None
        self.damaged = "" if file is None else file.damage
        for line in self.query(Input):
            line.placeholder = self._hint() if not self.has_class("has-stored") else line.placeholder
        if self.has_class("doubted"):
            return
        proposed = f"→ {file.name}, {age_words(file.mtime)}" if file is not None and self.proposed else ""
        if proposed and self._refusal:
            proposed = f"→ Enter: take {proposed.removeprefix('→ ')}"
        damaged = f"✗ {self.damaged}\n→ {ADVICE[Cause.FILE_DAMAGED]}" if self.damaged else ""
        kind = "refused" if self._refusal or damaged else "proposed" if proposed else ""
        self._reason("\n".join(filter(None, (self._refusal or damaged, proposed))), kind)

    def send(self) -> None:
        """Send what was typed: the line is free, and the next key is not of this entry."""
        self.pending += 1
        self.doubted = self.proposed = None
        self._refusal = self.damaged = ""
        self._reason("", "")
        for line in self.query(Input):
            line.value = ""

    def refuse(self, text: str, reason: str) -> None:
        """Say why nothing was saved; what was typed comes back, unless something else was typed meanwhile."""
        self._back(text)
        self._refusal = f"✗ {reason}"
        self._reason(self._refusal, "refused")

    def ask(self, text: str, question: str) -> None:
        """Ask about what was typed, which may be a slip: it is saved when that is confirmed."""
        self._back(text)
        self.doubted, self.question = text, question
        self._reason(f"? {question}. F9: keep it", "doubted")

    def arrived(self) -> None:
        """Note that one entry reached the store, or came back from it."""
        self.pending = max(0, self.pending - 1)

    def _back(self, text: str) -> None:
        for line in self.query(Input):
            if not line.value:
                line.value = text
                if line.has_focus:
                    line.select_all()  # what is typed next replaces it

    def _reason(self, words: str, kind: str) -> None:
        self._put(".reason", words)
        for one in ("refused", "doubted", "proposed"):
            self.set_class(kind == one, one)

    def _put(self, where: str, words: str) -> None:
        """Put text into a part of this field, unless the form was changed meanwhile and the field is gone."""
        for part in self.query(where).results(Static):
            part.update(words)


def stored_words(
    place: FieldPlace, step: WorkflowStep, state: StepState, judgement: StepJudgement | None = None
) -> str:
    """Return what is stored for a place, "" for nothing. judgement: what stands above it on the screen."""
    if place.is_file:
        link = state.link(place.declared.name)
        return link.file if link else ""
    key = place.declared.name if isinstance(place.declared, Scalar) else ""
    judged = {f.quantity: f.U for f in judgement.findings if f.U} if judgement is not None else {}
    one = repeated(state.readings(place.declared.name, place.index), step.asked, key)
    return _value_words(one, place.unit if place.index is None else "", judged.get(key)).rstrip() if one else ""


def _value_words(one: Repeated, unit: str, judged_U: float | None = None) -> str:
    """Return a stored value. judged_U: of its finding, which stands above: the value has its digits then, and no other
    U beside it."""
    if judged_U is not None:
        shown = f"{rounded(one.value, judged_U)} {unit}"
    else:
        shown = numbers(one.value, one.U, unit) if one.U else f"{one.value:.6g} {unit}"
    if one.scatter is None:
        return shown
    return f"{shown}, {one.count} readings, s = {one.scatter:.2g}"
