"""F1: what this screen is for, and every key."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from accept.tui.widgets.hanging import Hanging


class Help(ModalScreen[bool]):
    """What a screen is for, and all its keys. Dismisses True if its further key was pressed."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,f1,enter", "leave", "Back"),
        Binding("f4", "leave(True)", show=False),
    ]

    def __init__(self, title: str, text: str, further: str = "") -> None:
        """Make the page. further: what F4 does on the screen behind, which it does from here too; "" for nothing."""
        super().__init__()
        self._title, self._text, self._further = title, text, further

    def compose(self) -> ComposeResult:
        with VerticalScroll(classes="dialog"):
            yield Static(self._title, classes="title", markup=False)
            yield Hanging(self._text)
            further = f"    F4: {self._further}" if self._further else ""
            yield Static(f"\nEnter or Esc: close{further}", classes="quiet")

    def action_leave(self, further: bool = False) -> None:
        if self.is_current and (self._further or not further):
            self.dismiss(further)
