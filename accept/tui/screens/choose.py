"""A choice in front of the screen: one of a list, by arrows and Enter or by its number."""

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Label, OptionList

NUMBERS = "123456789"


class Choice(ModalScreen[int | None]):
    """Dismisses with the place of what was chosen, None after Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Leave"),
        *(Binding(number, f"take({place})", show=False) for place, number in enumerate(NUMBERS)),
    ]

    def __init__(self, title: str, words: str, options: Sequence[str]) -> None:
        super().__init__()
        self._title, self._words, self._options = title, words, options

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog"):
            yield Label(self._title, classes="title", markup=False)
            yield Label(self._words, classes="words", markup=False)
            numbered = [
                f"{n}  {words}" if n <= len(NUMBERS) else f"   {words}" for n, words in enumerate(self._options, 1)
            ]
            yield OptionList(*numbered, markup=False, id="choices")
            yield Label("Enter or its number: choose    Esc: cancel", classes="quiet")

    def on_mount(self) -> None:
        self.set_focus(self.query_one(OptionList))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        self.action_take(event.option_index)

    def action_take(self, place: int) -> None:
        if self.is_current and place < len(self._options):
            self.dismiss(place)

    def action_leave(self) -> None:
        if self.is_current:
            self.dismiss(None)
