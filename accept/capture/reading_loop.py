"""The readings of a recipe: a few attempts at each, and every one on the disk before the next is asked for."""

import json
import os
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hw.errors import Implausible, InstrumentError, SettingsError
from hw.instruments import Instrument, Reading, Sampling

Say = Callable[[str], None]
PAUSES_S = (0.3, 2.0)  # before another attempt: a disturbed line is soon silent, a plug takes a moment to be found
SYNC_S = 1.0  # a moving value is on the disk within this time
FOLDER = "readings"


class Journal:
    """An open journal of a run. Each line holds a purpose, a reading and its raw bytes."""

    def __init__(self, unit_folder: Path, section: str) -> None:
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S%f")
        self.path = unit_folder / FOLDER / f"{section}-{stamp}.jsonl"
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = open(self.path, "xb")  # noqa: SIM115 - closed by `close`
        self.lines: list[dict[str, Any]] = []

    def close(self) -> None:
        self._file.close()

    def keep(self, what: str, reading: Reading, sync: bool = True) -> Reading:
        """Append a reading. On return it is on the disk; without `sync`, with the next one. Raises OSError."""
        line = {
            "what": what,
            "value": reading.value,
            "unit": reading.unit,
            "t": reading.t,
            "more": dict(reading.more),
            "settings": dict(reading.settings),
            "raw": [raw.decode("latin-1") for raw in reading.raw],
        }
        self._file.write(json.dumps(line).encode() + b"\n")
        if sync:
            self.sync()
        self.lines.append(line)
        return reading

    def sync(self) -> None:
        """Wait until all that was written is on the disk. Raises OSError."""
        self._file.flush()
        os.fsync(self._file.fileno())


class CaptureStopped(InstrumentError):
    """The technician stopped the capture."""


class ReadingLoop:
    """Takes readings for a named purpose, and keeps them. stopped: set when the technician stops the capture."""

    def __init__(
        self, instrument: Instrument, journal: Journal, say: Say, stopped: threading.Event | None = None
    ) -> None:
        self._instrument, self._journal, self._say, self._stopped = instrument, journal, say, stopped

    def __call__(self, what: str) -> Reading:
        """Return a settled reading, after a few attempts at most. Raises InstrumentError, OSError."""
        for pause_s in PAUSES_S:
            self._go_on()
            try:
                return self._journal.keep(what, self._instrument.read())
            except InstrumentError as e:
                self._say(f"{what}: {e}; once more")
                time.sleep(pause_s)
        return self._journal.keep(what, self._instrument.read())

    def moving(
        self, what: str, until_s: float, most_gap_s: float, at: Callable[[float], None]
    ) -> list[tuple[float, float]]:
        """Return (time since the first [s], value in SI) of a moving value, as quickly as answers come; `at` is called
        with the time before each. One error or too long a gap ends it: the readings before are not a record. Raises
        InstrumentError, OSError."""
        instrument, link = self._instrument, self._instrument.link
        if not isinstance(instrument, Sampling) or link is None:
            words = "cannot follow what moves; an ids3010 can, or the rig records it (accept hw pickup)"
            raise SettingsError(f"{instrument.name}: {words}")
        readings: list[tuple[float, float]] = []
        start = synced = link.clock()
        while (now := link.clock() - start) < until_s:
            self._go_on()
            at(now)
            reading = instrument.sample()
            when = link.clock()
            self._journal.keep(what, reading, sync=(due := when - synced > SYNC_S))
            synced = when if due else synced
            if readings and (gap := when - start - readings[-1][0]) > most_gap_s:
                words = f"at most {most_gap_s:g} s are allowed; is the network or this computer busy?"
                raise Implausible(f"{what}, {now:.1f} s: {gap:.2g} s went by between two readings, {words}")
            readings.append((when - start, reading.value))
        self._journal.sync()
        return readings

    def _go_on(self) -> None:
        if self._stopped is not None and self._stopped.is_set():
            raise CaptureStopped("stopped; nothing was entered")
