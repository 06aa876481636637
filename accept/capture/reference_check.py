"""The daily reference of an instrument: read a certified artefact, compare, keep the result in the store.

It reveals a factor, a scaling, a held display or a drift, which no protocol reports. E_n is the difference over the
uncertainties of artefact and instrument together; at most 1 passes ([ISO13528] 9.7, with the artefact's value as the
assigned one)."""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from typing import Any

from accept.store import Event, Store
from accept.store.payloads import InstrumentChecked
from specs.bench import BenchFile, InstrumentEntry, ReferenceEntry

CHECKED = InstrumentChecked.KIND


@dataclass(frozen=True)
class ReferenceCheck:
    """One comparison. time: ISO 8601, UTC; value: mean of the readings; all in `unit`. U: of the instrument at that
    value, U_reference: of the artefact, both expanded (k = 2)."""

    instrument: str
    serial: str | None
    time: str
    what: str
    certificate: str
    unit: str
    reference: float
    U_reference: float
    value: float
    U: float
    readings: tuple[float, ...]

    @property
    def E_n(self) -> float:
        return (self.value - self.reference) / math.hypot(self.U, self.U_reference)

    @property
    def passed(self) -> bool:
        return bool(abs(self.E_n) <= 1.0)  # False for NaN too

    def to_json(self) -> dict[str, Any]:
        return asdict(self) | {"readings": list(self.readings), "E_n": self.E_n, "passed": self.passed}


def compared(name: str, entry: InstrumentEntry, artefact: ReferenceEntry, readings: Sequence[float]) -> ReferenceCheck:
    """Return the comparison of readings in the artefact's unit. Raises ValueError without a stated accuracy: an unknown
    accuracy is not zero."""
    if entry.accuracy is None:
        raise ValueError(f"[instruments.{name}] states no accuracy: how far it may be off is unknown")
    value = statistics.fmean(readings)
    return ReferenceCheck(
        name, entry.serial, datetime.now(UTC).isoformat(timespec="seconds"), artefact.what, artefact.certificate,
        artefact.unit, artefact.value, artefact.U, value, entry.accuracy.at(value), tuple(readings),
    )  # fmt: skip


def keep(store: Store, check: ReferenceCheck, evidence: dict[str, Any], who: str) -> Event:
    """Store a comparison with the bytes on the line. Raises StoreError."""
    event = InstrumentChecked(**asdict(check), E_n=check.E_n, passed=check.passed, evidence=evidence)
    return store.write(event, who=who)


def history(events: Iterable[Event], name: str, serial: str | None) -> list[ReferenceCheck]:
    """Return the comparisons of one instrument in order, without those of another instrument of the same name."""
    checks = (InstrumentChecked.of(event) for event in events if event.what == CHECKED)
    return [
        ReferenceCheck(**{field.name: getattr(check, field.name) for field in fields(ReferenceCheck)})
        for check in checks
        if (check.instrument, check.serial) == (name, serial)
    ]


def days_checked(store: Store, bench: BenchFile) -> dict[str, list[tuple[str, float]]]:
    """Return instrument -> (day in UTC, E_n) of every comparison, in order. Raises StoreError."""
    events = list(store.events(what=CHECKED))
    return {
        name: [(check.time[:10], check.E_n) for check in history(events, name, entry.serial)]
        for name, entry in bench.instruments.items()
    }
