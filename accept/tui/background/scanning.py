"""A screen without a line to type into, on which a scanned serial goes to its unit."""

import time
from typing import Protocol, TypeVar, cast

from textual.events import Key

from accept.tui.background.busy_screen import Working
from accept.workflow.shift import SigningShift
from accept.workflow.unit_list import Queue

T = TypeVar("T")
_FORGOTTEN_S = 5.0  # after a letter: it was no scan


class OpensUnits(Protocol):
    """What a screen of one unit asks the application for: other units. queue: what is done at one after the other."""

    queue: Queue | None
    shift: SigningShift

    async def next_unit(self, queue: Queue, words: str = "", goes_on: Queue | None = None) -> str:
        """Open the unit that waits behind this one, and go on with another queue from there; return why no other is
        open."""
        ...

    async def scanned(self, serial: str, queue: Queue | None) -> str:
        """Go to the unit of a serial; return why not."""
        ...


class Scanning(Working[T]):
    """Collects letters until Enter, as a scanner sends them."""

    _scan = ""
    _last_letter = 0.0

    @property
    def bench_app(self) -> OpensUnits:
        """Return the application, which opens other units."""
        return cast(OpensUnits, self.app)

    def takes_scans(self) -> bool:
        """Return whether letters are a serial."""
        return True

    def on_key(self, event: Key) -> None:
        """Take a letter of a serial; without a cursor in a line it means nothing else."""
        if event.character is not None and event.is_printable and self.takes_scans():
            event.stop()
            self._scan = self.scan + event.character
            self._last_letter = time.monotonic()
            self.say(f"Serial: {self._scan}   Enter: go to that unit")

    @property
    def scan(self) -> str:
        """Return the letters that came just now, "" without."""
        return self._scan if time.monotonic() - self._last_letter < _FORGOTTEN_S else ""

    async def action_take_scan(self) -> None:
        await self.take_scan()

    async def take_scan(self) -> bool:
        """Go to the unit whose serial was scanned. Returns whether one was."""
        serial, self._scan = self.scan.strip(), ""
        if not serial:
            return False
        await self.saved()
        if why := await self.bench_app.scanned(serial, self.bench_app.queue):
            self.say(why, "bad")
        return True
