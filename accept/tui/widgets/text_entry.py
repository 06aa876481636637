"""The line that is typed into."""

import asyncio
from contextlib import suppress
from typing import Any

from textual.events import Paste
from textual.message_pump import MessagePump
from textual.screen import Screen
from textual.widgets import Input

_LOOK_S = 0.5  # between two looks whether what is waited for was closed


class TextEntry(Input):
    """An input of one row whose cursor stands still: a blinking one is traffic on a slow line."""

    def __init__(self, value: str = "", *, placeholder: str = "", secret: bool = False, id: str | None = None) -> None:
        super().__init__(
            value, placeholder=placeholder, password=secret, compact=True, max_length=1000, select_on_focus=True, id=id
        )
        self.cursor_blink = False

    def _on_paste(self, event: Paste) -> None:
        """Take every line of what is pasted, in one: the library keeps the first alone. A column of eight heights is
        eight values, and what takes one value refuses them."""
        event.prevent_default().stop()
        lines = filter(None, map(str.strip, event.text.replace("\t", " ").splitlines()))
        super()._on_paste(Paste(" ".join(lines)))


async def typed(*pumps: MessagePump) -> None:
    """Wait until every message so far was handled there, one after the other; one that is closed is passed."""
    for pump in pumps:
        taken = asyncio.Event()
        while pump.call_later(taken.set):
            with suppress(TimeoutError):
                await asyncio.wait_for(taken.wait(), _LOOK_S)
                break


async def letters_arrived(screen: Screen[Any]) -> None:
    """Wait as `typed` does for letters that no line takes: they go down to the focus and bubble up to the screen."""
    focused = screen.focused
    path = [] if focused is None else [widget for widget in focused.ancestors_with_self if widget is not screen.app]
    await typed(screen, *path)
