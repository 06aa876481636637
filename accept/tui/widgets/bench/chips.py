"""One of a few choices, all of them in sight."""

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.binding import Binding, BindingType
from textual.events import Click
from textual.message import Message
from textual.widgets import Static


class Chips(Static, can_focus=True):
    """Holds the choice as `value`, which may be none of the options before they are known."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "turn(-1)", show=False),
        Binding("right,space", "turn(1)", show=False),
    ]

    class Changed(Message):
        """A person has chosen another one."""

    def __init__(self, value: str = "", *, id: str | None = None) -> None:
        super().__init__("", id=id, markup=False)
        self.options: Sequence[str] = ()
        self.value = value

    def show(self, options: Sequence[str], value: str) -> None:
        if (self.options, self.value) != (options, value):
            self.options, self.value = options, value
            self.update(Text("  ").join(self._chip(option) for option in options))

    def _chip(self, option: str) -> Text:
        return Text(f" ◉ {option} ", "reverse bold") if option == self.value else Text(f" ○ {option} ")

    def action_turn(self, way: int) -> None:
        if self.options:
            at = self.options.index(self.value) if self.value in self.options else -way
            self._choose(self.options[(at + way) % len(self.options)])

    def on_click(self, event: Click) -> None:
        at = 0
        for option in self.options:
            at += len(option) + 6  # mark, blanks beside it, and those between two
            if event.get_content_offset_capture(self).x < at:
                self._choose(option)
                return

    def _choose(self, option: str) -> None:
        if option != self.value:
            self.show(self.options, option)
            self.post_message(self.Changed())
