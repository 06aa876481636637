"""A screen of one unit without a line to type into, on which a scanned serial goes to its unit."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol, cast

from textual.containers import VerticalScroll
from textual.events import Key

from accept.tui.background.busy_screen import KnowsPassphrases, Then, Working, after
from accept.workflow.bench import Workbench
from accept.workflow.entry.parse_entry import is_value
from accept.workflow.entry.shift import NOT_TAKEN, SigningShift
from accept.workflow.ports import Computation
from accept.workflow.session import Session
from accept.workflow.steps.unit_list import Queue

SHORTEST = 3  # letters of a serial that begins a unit from another screen: a stray key does not
_FORGOTTEN_S = 5.0  # after a letter: it was no scan


class OpensUnits(KnowsPassphrases, Protocol):
    """The application as a screen of one unit needs it: it opens others. queue: units, one after the other."""

    bench: Workbench | None
    session: Session | None
    queue: Queue | None
    shift: SigningShift

    async def next_unit(self, queue: Queue, words: str = "", goes_on: Queue | None = None) -> str:
        """Open the unit that waits behind this one, and go on with another queue; return why no other is open."""

    async def go_to(self, serial: str, kind: str, queue: Queue | None) -> None:
        """Leave this unit and open another one."""

    async def scanned(self, serial: str, queue: Queue | None) -> str:
        """Go to the unit of a serial; return why not."""

    async def go_to_step(self, name: str) -> None:
        """Open a step of this unit."""

    def step_screen(self, bench: Workbench, session: Session, name: str) -> "Scanning":
        """Return the screen of a step of a unit."""

    def load_summary(self) -> "Callable[[Workbench, Session], Scanning]":
        """Return the summary of a unit, whose imports take long: to be called in a thread."""

    async def is_serial(self, text: str) -> bool:
        """Return whether text is the serial of a unit that was begun here, or one by its spec's own pattern."""

    def may_be_secret(self, text: str) -> bool:
        """Return whether text is long enough for a passphrase and reads as no value."""


class Scanning(Working[bool | str]):
    """Collects letters until Enter, as a scanner sends them."""

    _scan = ""
    _last_letter = 0.0
    _asked_about = ""  # a number that may be the serial of a new unit: the next Enter begins it
    _unknown = ""  # what was typed last and no unit has as its serial: the same again is a new unit
    asks_passphrase = False  # a passphrase is what is typed here, and no value
    where_signed = "A passphrase: in the summary, after ^S"

    def __init__(self, bench: Workbench, session: Session) -> None:
        super().__init__()
        self.bench, self.session = bench, session

    def compute(self, work: Callable[[Computation], Any], then: Then, doing: str, failed: Then) -> None:
        """Send work on the unit to the other process as `send` does; until it has ended, `stop` stops it."""
        computation = self.bench.services.computation(self.session, lambda words: setattr(self, "progress", words))
        self.stop, ended = computation.cancel, partial(setattr, self, "stop", None)
        self.send(partial(work, computation), after(ended, then), doing, after(ended, failed))

    @property
    def bench_app(self) -> OpensUnits:
        return cast(OpensUnits, self.app)

    async def action_leave(self) -> None:
        """Go back once all is saved; what takes long is stopped first."""
        await self.saved()
        self.stop_or(lambda: self.leave(False))

    def action_page(self, way: int) -> None:
        """Scroll what is longer than its room."""
        for part in self.query(VerticalScroll):
            part.scroll_relative(y=way * max(1, part.size.height - 1), animate=False)

    def takes_scans(self) -> bool:
        return True

    def on_key(self, event: Key) -> None:
        """Take a letter of a serial; without a cursor in a line it means nothing else. It may be one of a passphrase
        that is typed too early: only a value that this screen takes is shown."""
        if event.character is not None and event.is_printable and self.takes_scans():
            event.stop()
            self._scan = self.scan + event.character
            self._last_letter = time.monotonic()
            goes = self.value_goes if not self.bench_app.may_be_secret(self._scan) and is_value(self._scan) else ""
            count = len(self._scan)
            letters = f"{count} letter{'s' * (count > 1)} of a serial. Enter: go to that unit. {self.where_signed}"
            self.say(f"{self._scan}   Enter: {goes}" if goes else letters)

    def say(self, words: str, role: str = "quiet") -> None:
        self._asked_about = ""
        super().say(words, role)

    def on_screen_suspend(self) -> None:
        self._asked_about = ""

    @property
    def value_goes(self) -> str:
        """Return where a value goes that is typed here, "" if nowhere."""
        return ""

    @property
    def scan(self) -> str:
        """Return the letters that came just now, "" without."""
        return self._scan if time.monotonic() - self._last_letter < _FORGOTTEN_S else ""

    async def action_take_scan(self) -> bool:
        """Go to the unit whose serial was scanned, or give the step a value that was typed. Returns whether there was
        anything."""
        text, confirmed = self.scan.strip(), self._asked_about
        self._scan = self._asked_about = ""
        if not (text or confirmed):
            return False
        await self.saved()
        unknown, self._unknown = self._unknown, ""
        known = not text or await self.bench_app.is_serial(text)
        if not known and await self.is_secret(text):
            self.say(NOT_TAKEN, "bad")
        elif not known and not self.asks_passphrase and is_value(text):
            await self._take_number(text)
        elif not known and text != unknown and len(text) >= SHORTEST:
            self._unknown = text
            self.say(f"No unit of that serial was begun here. Scan it again: begin it. {self.where_signed}", "bad")
        elif why := await self.bench_app.scanned(text or confirmed, self.bench_app.queue):
            self.say(why, "bad")
        return True

    async def _take_number(self, text: str) -> None:
        """Give a value to the step. Digits alone may be the serial of a new unit: that is asked, lest a value begin
        a unit or a serial become a value."""
        if text.isdigit() and len(text) >= SHORTEST:
            shown = "of that number" if self.bench_app.may_be_secret(text) else text
            self.say(f"No unit {shown} was begun here. Enter: begin it. A value: open its step first", "doubt")
            self._asked_about = text
        else:
            await self.take_value(text)

    async def take_value(self, text: str) -> None:
        """Say that nothing is done with a value: no step takes it here."""
        self.say(f"{text} was not saved: it is no serial of a unit here, and no step is open", "bad")
