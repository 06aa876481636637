"""The line that is typed into."""

import asyncio
from typing import Any

from textual.message_pump import MessagePump
from textual.screen import Screen
from textual.widgets import Input


class TextEntry(Input):
    """An input of one row whose cursor stands still: a blinking one is traffic on a slow line."""

    def __init__(self, value: str = "", *, placeholder: str = "", secret: bool = False, id: str | None = None) -> None:
        super().__init__(
            value, placeholder=placeholder, password=secret, compact=True, max_length=1000, select_on_focus=True, id=id
        )
        self.cursor_blink = False


async def typed(*widgets: MessagePump) -> None:
    """Wait until every key that was typed is in its field: each takes its keys in its own time, and what is asked for
    before that would be cut short. Awaited in the action of a priority binding it holds back the keys behind."""
    for widget in widgets:
        taken = asyncio.Event()
        if widget.call_later(taken.set):
            await taken.wait()


async def letters_arrived(screen: Screen[Any]) -> None:
    """Wait as `typed` does for letters that no line takes: they go down to what has the focus and bubble up from there
    to the screen."""
    focused = screen.focused
    path = [] if focused is None else [widget for widget in focused.ancestors_with_self if widget is not screen.app]
    await typed(screen, *path)
