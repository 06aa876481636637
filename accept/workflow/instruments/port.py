"""The port through which the workflow reads instruments: a value and its unit, for one input of one check."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from accept.workflow.entry.parse_entry import EntryError
from checks.declare import Measured
from hw.instruments import scaled
from specs.units import UnitMismatch, factor


class InstrumentPort(Protocol):
    """The interface of an instrument to the workflow."""

    @property
    def name(self) -> str:
        """Return the name by which it is found in the store."""
        ...

    @property
    def short_name(self) -> str:
        """Return the name that stands beside its value."""
        ...

    @property
    def offer(self) -> str:
        """Return what a reading takes from it, behind "take"."""
        ...

    def read(self) -> tuple[float, str]:
        """Return a settled value and its unit. Raises InstrumentError."""
        ...

    def uncertainty(self, value: float) -> float | None:
        """Return the expanded uncertainty of a value, both in the input's unit; None if only the spec states one."""
        ...

    def evidence(self) -> Mapping[str, Any]:
        """Return what is stored beside a reading: the instrument, and the traffic of its line."""
        ...


class Instruments(Protocol):
    """The instruments at hand."""

    def serving(self, check: str, name: str, index: int | None) -> InstrumentPort | None:
        """Return the instrument that reads this input, None if it is typed."""
        ...

    def recording(self, check: str) -> Any:
        """Return the `BenchInstrument` that measures a check as a whole, None without one."""
        ...

    @property
    def staged(self) -> Any:
        """Return the operator of a simulated bench, None at a real one."""
        ...


@dataclass(frozen=True)
class NoInstruments:
    """No instruments: everything is typed."""

    def serving(self, _check: str, _name: str, _index: int | None) -> InstrumentPort | None:
        return None

    def recording(self, _check: str) -> Any:
        return None

    @property
    def staged(self) -> Any:
        return None


def reading(instrument: InstrumentPort, unit: str) -> Measured:
    """Return one reading in `unit`. Raises InstrumentError, EntryError for a reading of another kind."""
    value, given = instrument.read()
    try:
        here = scaled(value, factor(given, unit))
    except UnitMismatch as e:
        raise EntryError(f"{instrument.name}: {e}") from e
    return Measured(here, instrument.uncertainty(here))
