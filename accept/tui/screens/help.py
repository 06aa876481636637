"""F1: what this screen is for, and every key."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from accept.tui.widgets.hanging import Hanging


class Help(ModalScreen[None]):
    """What a screen is for, and all its keys."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,f1,enter", "leave", "Back")]

    def __init__(self, title: str, text: str) -> None:
        super().__init__()
        self._title, self._text = title, text

    def compose(self) -> ComposeResult:
        with VerticalScroll(classes="dialog"):
            yield Static(self._title, classes="title", markup=False)
            yield Hanging(self._text)
            yield Static("\nEnter or Esc: close", classes="quiet")

    def action_leave(self) -> None:
        if self.is_current:
            self.dismiss(None)
