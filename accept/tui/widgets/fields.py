"""One line of a form for each place where a value or a file goes, made from what the check declares."""

from collections.abc import Iterator
from dataclasses import dataclass

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Static

from accept.tui.widgets.limit_bar import numbers
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.state.unit_state import StepState
from accept.workflow.steps.plan import WorkflowStep, is_needed
from accept.workflow.steps.section import Repeated, repeated
from checks.declare import CsvTable, Form, Scalar, Series, Vector
from checks.declare import Input as Declared


@dataclass(frozen=True)
class Place:
    """Where one value or file goes; index: place in a vector."""

    declared: Declared
    index: int | None = None

    @property
    def is_file(self) -> bool:
        return isinstance(self.declared, Series | CsvTable)

    @property
    def unit(self) -> str:
        return "" if self.is_file else str(getattr(self.declared, "unit", ""))

    @property
    def label(self) -> str:
        declared = self.declared
        words = declared.label if self.index is None else f"{getattr(declared, 'item', 'value')} {self.index + 1}"
        needed = "" if is_needed(declared) else " (optional)"
        return words + needed

    @property
    def hint(self) -> str:
        """What an empty field shows."""
        if self.is_file:
            return "F2: choose a file"
        default = getattr(self.declared, "default", None)
        return f"{default:g} {self.unit}" if default is not None else self.unit


def places(form: Form) -> Iterator[Place]:
    """The places of a form, one per value that is typed or file that is linked."""
    for declared in form.inputs:
        if isinstance(declared, Vector):
            yield from (Place(declared, index) for index in range(declared.size))
        else:
            yield Place(declared)


class Field(Vertical):
    """Label, what is typed, and beside it what is stored or why it was refused."""

    def __init__(self, place: Place, step: WorkflowStep, state: StepState) -> None:
        super().__init__(classes="field")
        self.place, self._step, self._state = place, step, state

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield Label(self.place.label, classes="label", markup=False)
            yield TextEntry(placeholder=self.place.hint)
            yield Static("", classes="stored", markup=False)
        yield Static("", classes="reason", markup=False)

    def on_mount(self) -> None:
        self.show(self._state)

    @property
    def input(self) -> Input:
        return self.query_one(Input)

    def show(self, state: StepState) -> None:
        """Show what is stored for this place."""
        words = stored_words(self.place, self._step, state)
        self._put(".stored", f"✓ {words}" if words else "")

    def refuse(self, reason: str) -> None:
        """Say why nothing was stored; what was typed stays."""
        self._put(".reason", f"✗ {reason}")
        self.add_class("refused")

    def accept(self) -> None:
        """What was typed is stored: the field is free for a correction."""
        self._put(".reason", "")
        self.remove_class("refused")
        for line in self.query(Input):
            line.value = ""

    def _put(self, where: str, words: str) -> None:
        """Into a part of this field, unless the form was changed meanwhile and the field is gone."""
        for part in self.query(where).results(Static):
            part.update(words)


def stored_words(place: Place, step: WorkflowStep, state: StepState) -> str:
    """What is stored for a place, "" for nothing."""
    if place.is_file:
        link = state.link(place.declared.name)
        return link.file if link else ""
    key = place.declared.name if isinstance(place.declared, Scalar) else ""
    one = repeated(state.readings(place.declared.name, place.index), step.asked, key)
    return _value_words(one, place.unit) if one else ""


def _value_words(one: Repeated, unit: str) -> str:
    if one.scatter is None:
        return f"{one.value:.6g} {unit}" + (f" ± {one.U:.2g}" if one.U is not None else "")
    shown = numbers(one.value, one.U, unit) if one.U else f"{one.value:.6g} {unit}"
    return f"{shown}, {one.count} readings, s = {one.scatter:.2g}"
