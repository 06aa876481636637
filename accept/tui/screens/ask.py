"""A question in front of the screen: one or more lines, answered or left with Escape."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label

from accept.tui.widgets.text_entry import TextEntry, typed


@dataclass(frozen=True)
class QuestionLine:
    """One line to type. secret: not shown."""

    label: str
    secret: bool = False
    value: str = ""


class Question(ModalScreen[list[str] | None]):
    """Dismisses with what was typed, None after Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [
        # Before the line itself gets it: what is typed behind Enter belongs to the next line.
        Binding("enter", "next", show=False, priority=True),
        Binding("escape", "leave", "Leave"),
        Binding("up", "app.focus_previous", show=False),
    ]

    def __init__(self, title: str, words: str | Text, lines: Sequence[QuestionLine]) -> None:
        super().__init__()
        self._title, self._words, self._lines = title, words, lines

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog"):
            yield Label(self._title, classes="title", markup=False)
            yield Label(self._words, classes="words", markup=False)
            for line in self._lines:
                yield Label(line.label, markup=False)
                yield TextEntry(line.value, secret=line.secret)
            way = "next field, then confirm" if len(self._lines) > 1 else "confirm"
            yield Label(f"Enter: {way}    Esc: cancel", classes="quiet")

    async def action_next(self) -> None:
        fields = list(self.query(Input))
        await typed(*fields)
        at = next((n for n, field in enumerate(fields) if field is self.focused), len(fields) - 1)
        if at + 1 < len(fields):
            self.set_focus(fields[at + 1])
        else:
            self._leave([field.value for field in fields])

    def action_leave(self) -> None:
        self._leave(None)

    def _leave(self, answer: list[str] | None) -> None:
        """Answer once, also if the key comes twice."""
        if self.is_current:
            self.dismiss(answer)
