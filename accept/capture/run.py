"""What a capture works with, and how it takes its readings."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from accept.capture.journal import Journal
from accept.capture.operator_actions import Hands
from accept.store import Store
from hw.errors import Implausible, InstrumentError, SettingsError
from hw.instruments import Instrument, Reading
from hw.instruments.driver import Sampling
from specs.bench import InstrumentEntry

Say = Callable[[str], None]
PAUSES_S = (0.3, 2.0)  # before another attempt: a disturbed line is soon silent, a plug takes a moment to be found
SYNC_S = 1.0  # what moves is on the disk within so long


@dataclass(frozen=True)
class Run:
    """What a capture works with."""

    folder: Path
    instrument: Instrument
    entry: InstrumentEntry
    hands: Hands
    store: Store
    who: str
    say: Say = lambda _: None


@dataclass(frozen=True)
class Captured:
    """What a capture puts into the unit folder: entries of the section, files by name; notes in words."""

    entries: dict[str, Any]
    files: dict[str, bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


class Take:
    """Takes readings for what is named, and keeps them."""

    def __init__(self, run: Run, journal: Journal) -> None:
        self._run, self._journal = run, journal

    def __call__(self, what: str) -> Reading:
        """A settled reading, with a few attempts. Raises InstrumentError, OSError."""
        for pause_s in PAUSES_S:
            try:
                return self._journal.keep(what, self._run.instrument.read())
            except InstrumentError as e:
                self._run.say(f"{what}: {e}; once more")
                time.sleep(pause_s)
        return self._journal.keep(what, self._run.instrument.read())

    def moving(
        self, what: str, until_s: float, most_gap_s: float, at: Callable[[float], None]
    ) -> list[tuple[float, float]]:
        """Return (time since the first [s], value in SI) of something that moves, as quickly as answers come; `at` is
        called with the time before each. One error ends it, and so does the first gap that is too long: what came
        before is no record. Raises InstrumentError, OSError."""
        instrument, link = self._run.instrument, self._run.instrument.link
        if not isinstance(instrument, Sampling) or link is None:
            words = "cannot follow what moves; an ids3010 can, or the rig records it (accept hw pickup)"
            raise SettingsError(f"{instrument.name}: {words}")
        came: list[tuple[float, float]] = []
        start = synced = link.clock()
        while (now := link.clock() - start) < until_s:
            at(now)
            reading = instrument.sample()
            when = link.clock()
            self._journal.keep(what, reading, sync=(due := when - synced > SYNC_S))
            synced = when if due else synced
            if came and (gap := when - start - came[-1][0]) > most_gap_s:
                words = f"at most {most_gap_s:g} s are allowed; is the network or this computer busy?"
                raise Implausible(f"{what}, {now:.1f} s: {gap:.2g} s went by between two readings, {words}")
            came.append((when - start, reading.value))
        self._journal.sync()
        return came
