"""Keys and clicks in the order in which they came: each is handed on when all that the ones before it began is there.

A terminal sends a burst of keys faster than screens open: without this, a key reaches the screen that is being left, a
line that does not have the focus yet, or nothing at all.
"""

import asyncio
from contextlib import suppress

from textual.app import App, ScreenStackError
from textual.errors import NoWidget
from textual.events import Event, Key, MouseUp, Paste

from accept.tui.background.busy_screen import Working
from accept.tui.widgets.text_entry import letters_arrived, typed

_LOOK_S = 0.1  # between two looks whether the screen that is waited for was left


class InOrder(App[None]):
    """An application that holds keys until the screen is ready which they are meant for."""

    def __init__(self) -> None:
        super().__init__()
        self.pressed: asyncio.Queue[Event] = asyncio.Queue()
        self._handing_on: asyncio.Task[None] | None = None
        self._under_way = False  # a key was taken from the queue and is not handed on yet
        self._by_click: list[Key] | None = None  # keys that the click under way presses, None without one

    @property
    def keys_wait(self) -> bool:
        """Return whether keys wait for the screen which they are meant for."""
        return self._under_way or not self.pressed.empty()

    async def on_event(self, event: Event) -> None:
        """Queue what is typed, pasted or clicked; all else goes its way at once."""
        if not isinstance(event, Key | Paste | MouseUp) or event.is_forwarded or self.waits_for_nothing(event):
            await super().on_event(event)
            return
        self.pressed.put_nowait(event)
        if self._handing_on is None:
            self._handing_on = asyncio.create_task(self._hand_on())

    def simulate_key(self, key: str) -> None:
        """Press a key, as a click on its name does: it comes before what was typed after that click."""
        if self._by_click is None:
            super().simulate_key(key)
        else:
            self._by_click.append(Key(key, None))

    def waits_for_nothing(self, _: Event) -> bool:
        """Return whether a key acts before those that still wait."""
        return False

    def on_unmount(self) -> None:
        if self._handing_on is not None:
            self._handing_on.cancel()

    async def _hand_on(self) -> None:
        """Hand on one key after the other, beside the application's own messages: bindings and callbacks of the key
        before come through these."""
        while True:
            event = await self.pressed.get()
            self._under_way = True
            try:
                await self._come_to_rest()
                if isinstance(event, MouseUp):
                    await self._click(event)
                else:
                    await super().on_event(event)
                await self._come_to_rest()
            except Exception as error:  # noqa: BLE001 - as in the application's own loop: it ends the program, loudly
                self._handle_exception(error)
                return
            finally:
                self._under_way = False
                self.pressed.task_done()

    async def _click(self, event: MouseUp) -> None:
        """Hand on a click, then the keys that it presses."""
        self._by_click = pressed = list[Key]()
        with suppress(NoWidget, ScreenStackError):
            widget, _ = self.get_widget_at(event.x, event.y)
            await super().on_event(event)
            await typed(self.screen, *(each for each in widget.ancestors_with_self if each is not self))
        self._by_click = None
        for key in pressed:
            await super().on_event(key)

    async def _come_to_rest(self) -> None:
        """Wait until the screen in front is there, opens no other one, and has taken every key so far."""
        before: object = None
        with suppress(ScreenStackError):
            while before != (before := (self.screen, self.focused)):
                screen = self.screen
                await letters_arrived(screen)
                await typed(self)  # a key that no widget takes, and the answer of a question, go on there
                while isinstance(screen, Working) and screen is self.screen and not screen.ready.is_set():
                    with suppress(TimeoutError):
                        await asyncio.wait_for(screen.ready.wait(), _LOOK_S)
