"""In front of the screen: a question of one or more lines, a choice, and the page behind F1."""

import asyncio
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeVar, cast

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Input, Label, OptionList, Static

from accept.tui.background.busy_screen import KnowsPassphrases
from accept.tui.widgets.hanging import Hanging, Hung
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.entry.shift import NOT_TAKEN

NUMBERS = "123456789"  # keys of a choice
_KEYS = {"Enter": "enter", "Esc": "escape", "F10": "f10"}
_NAMED = re.compile(r"(Enter|Esc|F10)\b[^:]*: ")
Check = Callable[[int, list[str]], str]
T = TypeVar("T")


@dataclass(frozen=True)
class QuestionLine:
    """One line to type. secret: not shown."""

    label: str
    secret: bool = False
    value: str = ""


def required(words: str) -> Check:
    """Return a check that no line is empty. words: the message for an empty line."""
    return lambda place, given: "" if given[place].strip() else words


def which_unit(doubt: str) -> "Question":
    """Return the question for the serial of a unit that may be another one. doubt: why."""
    return Question("Which unit is it?", doubt, [QuestionLine("Serial number on its label")])


def pressed(words: str) -> Text:
    """Return the last line of a question, in which a click presses the key that is named before it."""
    text, named = Text(words), list(_NAMED.finditer(words))
    for n, one in enumerate(named):
        end = named[n + 1].start() if n + 1 < len(named) else len(words)
        text.stylize(Style.from_meta({"@click": f"app.simulate_key('{_KEYS[one[1]]}')"}), one.start(), end)
    return text


class InFront(ModalScreen[T | None]):
    """Asks below a title and words. Dismisses with the answer, None after Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "Leave")]

    def __init__(self, title: str, words: str | Text) -> None:
        super().__init__()
        self._title, self._words = title, words

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog") as dialog:
            dialog.border_title = Content(self._title)
            yield Label(self._words, classes="words", markup=False)
            yield from self.asked()

    def asked(self) -> ComposeResult:
        raise NotImplementedError

    def answer(self, answer: T | None) -> None:
        """Answer once, also if the key comes twice."""
        if self.is_current:
            self.dismiss(answer)

    def action_leave(self) -> None:
        self.answer(None)


class Question(InFront[list[str]]):
    """Takes lines that are typed."""

    BINDINGS: ClassVar[list[BindingType]] = [
        # Before the line itself gets it: what is typed behind Enter belongs to the next line.
        Binding("enter", "next", show=False, priority=True),
        Binding("up", "app.focus_previous", show=False),
    ]

    def __init__(
        self, title: str, words: str | Text, lines: Sequence[QuestionLine], check: Check = lambda _, __: ""
    ) -> None:
        """Make the question. check: called at Enter, in a thread, with the place of the line and all lines; returns why
        the line cannot stay so, "" if it can. The question stays until nothing is wrong: at the last line every line is
        asked about, since the cursor may have come there without Enter."""
        super().__init__(title, words)
        self._lines, self._check, self._row = lines, check, 0
        self._checking = False

    def beside(self, row: int) -> None:
        """Put the question on the right, below a row of the screen behind it; not on a narrow terminal."""
        self.add_class("beside")
        self._row = row

    def on_mount(self) -> None:
        if self.has_class("beside", "-wide"):
            self.query_one(".dialog").styles.margin = (self._row, 0, 2, 0)

    def asked(self) -> ComposeResult:
        for line in self._lines:
            yield Label(line.label, classes="asked", markup=False)
            yield TextEntry(line.value, secret=line.secret)
        yield Label("", id="wrong", classes="bad", markup=False)
        way = "next field, then confirm" if len(self._lines) > 1 else "confirm"
        yield Label(pressed(f"Enter: {way}    Esc: cancel"), classes="quiet keys")

    async def action_next(self) -> None:
        fields = list(self.query(Input))
        at = next((n for n, field in enumerate(fields) if field is self.focused), len(fields) - 1)
        if self._checking:
            return
        self._checking = True
        try:
            at, wrong = await asyncio.to_thread(self._first_wrong, at, [field.value for field in fields])
        finally:
            self._checking = False
        if not self.is_current:  # left meanwhile
            return
        if wrong:
            self.set_focus(fields[at])
            if wrong == NOT_TAKEN:
                with fields[at].prevent(Input.Changed):  # which would take away why
                    fields[at].value = ""
            fields[at].select_all()
            self.app.bell()
        self.query_one("#wrong", Label).update(f"✗ {wrong}" if wrong else "")
        if not wrong and at + 1 < len(fields):
            self.set_focus(fields[at + 1])
        elif not wrong:
            self.answer([field.value for field in fields])

    def _first_wrong(self, at: int, given: list[str]) -> tuple[int, str]:
        """Return the first line that cannot stay so and why, the present one and "" if all can. A passphrase is taken
        by no line that shows it. Called in a thread."""
        is_secret = cast(KnowsPassphrases, self.app).is_secret
        for place in range(len(given)) if at + 1 == len(given) else (at,):
            if not self._lines[place].secret and is_secret(given[place]):
                return place, NOT_TAKEN
            if wrong := self._check(place, given):
                return place, wrong
        return at, ""

    def on_input_changed(self) -> None:
        """Clear the reason of the last refusal: it was about another text."""
        if not self._checking:
            self.query_one("#wrong", Label).update("")


class Choice(InFront[int]):
    """Takes the place of one of several options."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *(Binding(number, f"take({place})", show=False) for place, number in enumerate(NUMBERS)),
    ]

    def __init__(self, title: str, words: str, options: Sequence[str], leave: str = "cancel") -> None:
        """Make the question. leave: what Escape does."""
        super().__init__(title, words)
        self._options, self._leave = options, leave

    def asked(self) -> ComposeResult:
        numbered = [f"{n if n <= len(NUMBERS) else ' '}  {words}" for n, words in enumerate(self._options, 1)]
        yield OptionList(*(Hung(Text(words)) for words in numbered), markup=False, id="choices")
        yield Label(pressed(f"Enter or its number: choose    Esc: {self._leave}"), classes="quiet keys")

    def on_mount(self) -> None:
        self.set_focus(self.query_one(OptionList))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        self.action_take(event.option_index)

    def action_take(self, place: int) -> None:
        if place < len(self._options):
            self.answer(place)


class Help(ModalScreen[bool]):
    """The purpose of a screen, and all its keys. Dismisses True if its further key was pressed."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,enter", "leave", "Back"),
        Binding("f1", "leave", show=False),
        Binding("f10,f4", "leave(True)", show=False),
    ]

    def __init__(self, title: str, text: str, further: str = "") -> None:
        """Make the page. further: what F10 does on the screen behind, which it does from here too; "" for nothing."""
        super().__init__()
        self._title, self._text, self._further = title, text, further

    def compose(self) -> ComposeResult:
        with VerticalScroll(classes="dialog") as dialog:
            dialog.border_title = Content(self._title)
            yield Hanging(self._text)
            further = f"    F10: {self._further}" if self._further else ""
            yield Static(pressed(f"\nEnter or Esc: close{further}"), classes="quiet keys")

    def action_leave(self, further: bool = False) -> None:
        if self.is_current and (self._further or not further):
            self.dismiss(further)
