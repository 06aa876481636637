"""One line of a form on the screen."""

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Static

from accept.pictures.words import pretty
from accept.store.payloads import StepJudged
from accept.tui.widgets.limit_bar import after_number, alike, numbers
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.dialogue.step_state import FieldPlace
from accept.workflow.state.unit_state import StepState
from accept.workflow.steps.plan import WorkflowStep, is_needed
from accept.workflow.steps.section import repeated
from checks.declare import Scalar
from checks.rounding import rounded

SAVED = "▪"  # what is saved is not yet judged: no mark of a verdict


class Field(Vertical):
    """One line: label, typed text and saved value (of a file below each other); then a refusal, or a question."""

    def __init__(self, place: FieldPlace) -> None:
        optional = not (is_needed(place.declared) or place.among_optional)
        super().__init__(classes=f"field{' file' * place.is_file}{' optional' * optional}")
        self.place = place
        self._shown: object = None
        self._course = ""
        self.input: Input = TextEntry(placeholder=pretty(place.hint))

    def compose(self) -> ComposeResult:
        label = Label(pretty(self.place.label), classes="label", markup=False)
        if self.place.is_file:
            yield label
        with Horizontal(classes="entry"):
            if not self.place.is_file:
                yield label
            yield self.input
            yield Static("", classes="stored", markup=False)
        yield Static("", classes="course", markup=False)
        yield Static("", classes="reason", markup=False)

    def on_input_changed(self, event: Input.Changed) -> None:
        """Give a line its room when something is typed in it; before, what is saved stands in one column."""
        self.set_class(bool(event.value), "typing")

    def show(self, text: str, stored: str, reason: str, kind: str, *, takes: bool, course: str = "") -> None:
        """Show a line: what is typed and what is saved; the words below and their kind, which colours them; whether
        Enter takes a record; how a saved record runs, and its age."""
        if self.input.value != text:
            self.input.value = text
        if course != self._course:
            self._course = course
            self.query_one(".course", Static).update(course, layout=False)
        if self._shown == (shown := (stored, reason, kind, takes)):
            return
        self._shown = shown
        blank = "\N{NO-BREAK SPACE}" if self.place.is_file else " "  # a long name begins beside its mark
        self.query_one(".stored", Static).update(f"{SAVED}{blank}{stored}" if stored else "")
        self.query_one(".reason", Static).update(pretty(reason))
        hint = "Enter: take it" if takes else "" if kind == "proposed" else pretty(self.place.hint)
        self.input.placeholder = "" if stored else hint  # what is saved takes its room
        self.set_class(bool(stored), "has-stored")
        for one in ("refused", "doubted", "proposed"):
            self.set_class(kind == one, one)


def stored_words(place: FieldPlace, step: WorkflowStep, state: StepState, judgement: StepJudged | None = None) -> str:
    """Return the stored entry of a place, "" for none. judgement: the one that the screen shows above it."""
    if place.is_file:
        link = state.link(place.declared.name)
        return link.file if link else ""
    key = place.declared.name if isinstance(place.declared, Scalar) else ""
    judged = {f.quantity: f.U for f in judgement.findings if f.U} if judgement is not None else {}
    one, unit = repeated(state.readings(*place.key), step.asked, key), after_number(place.unit)
    if one is None:
        return ""
    if place.index is not None:
        shown = f"{_aligned(place, step, state, one.value)}{unit}"
    elif (judged_U := judged.get(key)) is not None:  # of its finding, which stands above with the same digits
        shown = f"{rounded(one.value, judged_U)}{unit}"
    else:
        shown = numbers(one.value, one.U, place.unit) if one.U else f"{one.value:.6g}{unit}"
    return shown if one.scatter is None else f"{shown}, {one.count} readings, s = {one.scatter:.2g}"


def _aligned(place: FieldPlace, step: WorkflowStep, state: StepState, value: float) -> str:
    """Return a value of a list with as many decimals as the others of it, so that the points stand below each other."""
    name, size = place.declared.name, getattr(place.declared, "size", 0)
    taken = [repeated(state.readings(name, index), step.asked, "") for index in range(size)]
    return f"{alike(value, [one.value for one in taken if one is not None], 6):>7}"
