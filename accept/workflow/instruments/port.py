"""The port through which the workflow reads instruments: a value and its unit for one input, once or live."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from accept.base.fault_log import PLEASE_REPORT
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.instruments.fault_words import fault_words
from checks.declare import Measured
from hw.errors import InstrumentError
from hw.instruments import scaled
from specs.units import UnitMismatch, factor

EVERY_S = 0.3  # a person reads no faster, and a settled reading takes longer than that on most instruments
AFTER_ERROR_S = 1.0  # until an instrument that did not answer is asked again
BROKEN = "the live value has stopped on an internal error; " + PLEASE_REPORT


class InstrumentPort(Protocol):
    """The interface of an instrument to the workflow."""

    @property
    def name(self) -> str:
        """Return the name by which it is found in the store."""

    @property
    def short_name(self) -> str:
        """Return the name that stands beside its value."""

    @property
    def offer(self) -> str:
        """Return what a reading takes from it, behind "take"."""

    def read(self) -> tuple[float, str]:
        """Return a settled value and its unit. Raises InstrumentError."""

    def uncertainty(self, value: float) -> float | None:
        """Return the expanded uncertainty of a value, both in the input's unit; None if only the spec states one."""

    def evidence(self) -> Mapping[str, Any]:
        """Return what is stored beside a reading: the instrument, and the traffic of its line."""


class Instruments:
    """The instruments at hand; there are none here: everything is typed. staged: the operator of a simulated bench,
    None at a real one, where a person acts."""

    staged: Any = None

    def serving(self, check: str, name: str, index: int | None) -> InstrumentPort | None:  # noqa: ARG002
        """Return the instrument that reads this input, None if it is typed."""
        return None

    def recording(self, check: str) -> Any:  # noqa: ARG002
        """Return the `BenchInstrument` that measures a check as a whole, None without one."""
        return None

    @property
    def answering(self) -> Mapping[str, bool | None]:
        """Return whether each instrument answered when it was asked last, None for one not asked yet. Asks nothing."""
        return {}

    def close(self) -> None:
        """Release the instruments."""


def reading(instrument: InstrumentPort, unit: str) -> Measured:
    """Return one reading in `unit`. Raises InstrumentError, EntryError for a reading of another kind."""
    value, given = instrument.read()
    try:
        here = scaled(value, factor(given, unit))
    except UnitMismatch as e:
        raise EntryError(f"{instrument.name}: {e}") from e
    return Measured(here, instrument.uncertainty(here))


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
    except InstrumentError as e:
        return Look(error=fault_words(e))
    except EntryError as e:
        return Look(error=str(e))
