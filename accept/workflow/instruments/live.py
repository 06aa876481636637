"""An instrument's live value: read again and again, in parallel with all else, until stopped."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

from accept.base.fault_log import PLEASE_REPORT
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.instruments.port import InstrumentPort, reading
from checks.declare import Measured
from hw.errors import InstrumentError

EVERY_S = 0.3  # a person reads no faster, and a settled reading takes longer than that on most instruments
AFTER_ERROR_S = 1.0  # until an instrument that did not answer is asked again
BROKEN = "the live value has stopped on an internal error; " + PLEASE_REPORT


@dataclass(frozen=True)
class Look:
    """One look at an instrument: its reading, or why it gives none."""

    measured: Measured | None = None
    error: str = ""


class Watch:
    """Looks at one instrument from a thread of its own until `stop`.

    The thread is a daemon: an instrument that keeps silent until its deadline does not hold up the end of the program.
    told : called from that thread, never after `stop` has returned but for a look that was under way.
    """

    def __init__(self, instrument: InstrumentPort, unit: str, told: Callable[[Look], None]) -> None:
        self._instrument, self._unit, self._told = instrument, unit, told
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"live {instrument.name}", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop looking; the result of a look under way is dropped."""
        self._over.set()

    def join(self, seconds: float) -> None:
        """Wait for the end of a look under way."""
        self._thread.join(seconds)

    def _run(self) -> None:
        ended = False
        try:
            while not self._over.is_set():
                seen = look(self._instrument, self._unit)
                self._tell(seen)
                self._over.wait(AFTER_ERROR_S if seen.error else EVERY_S)
            ended = True
        finally:
            if not ended:
                self._tell(Look(error=BROKEN))

    def _tell(self, seen: Look) -> None:
        if not self._over.is_set():
            self._told(seen)


def look(instrument: InstrumentPort, unit: str) -> Look:
    """Return the instrument's present reading, or its error."""
    try:
        return Look(reading(instrument, unit))
    except (InstrumentError, EntryError) as e:
        return Look(error=str(e))
