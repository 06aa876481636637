"""A question in front of the screen: one or more lines, answered or left with Escape."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, cast

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label

from accept.tui.background.busy_screen import KnowsPassphrases
from accept.tui.widgets.text_entry import TextEntry
from accept.workflow.shift import NOT_TAKEN

Check = Callable[[int, list[str]], str]


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


class Question(ModalScreen[list[str] | None]):
    """Dismisses with what was typed, None after Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [
        # Before the line itself gets it: what is typed behind Enter belongs to the next line.
        Binding("enter", "next", show=False, priority=True),
        Binding("escape", "leave", "Leave"),
        Binding("up", "app.focus_previous", show=False),
    ]

    def __init__(
        self, title: str, words: str | Text, lines: Sequence[QuestionLine], check: Check = lambda _, __: ""
    ) -> None:
        """Make the question. check: called at Enter, in a thread, with the place of the line and all lines; returns why
        the line cannot stay so, "" if it can. The question stays until nothing is wrong: at the last line every line is
        asked about, since the cursor may have come there without Enter."""
        super().__init__()
        self._title, self._words, self._lines, self._check = title, words, lines, check
        self._checking = False

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog"):
            yield Label(self._title, classes="title", markup=False)
            yield Label(self._words, classes="words", markup=False)
            for line in self._lines:
                yield Label(line.label, markup=False)
                yield TextEntry(line.value, secret=line.secret)
            yield Label("", id="wrong", classes="bad", markup=False)
            way = "next field, then confirm" if len(self._lines) > 1 else "confirm"
            yield Label(f"Enter: {way}    Esc: cancel", classes="quiet")

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
            self._leave([field.value for field in fields])

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
        """Take away why the last answer was refused: it is not that of what stands there now."""
        if not self._checking:
            self.query_one("#wrong", Label).update("")

    def action_leave(self) -> None:
        self._leave(None)

    def _leave(self, answer: list[str] | None) -> None:
        """Answer once, also if the key comes twice."""
        if self.is_current:
            self.dismiss(answer)
