"""Opening a unit, with what the rest of the bench knows about it."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from accept.judging import consistent
from accept.judging.reservations import measured_values, open_nonconformances
from accept.store import Store
from accept.store.payloads import UnitJudged
from accept.workflow.entry.passphrase_guard import refuse_passphrases
from accept.workflow.session import Session
from specs.bench import BenchFile
from specs.spec import Spec

UNITS = 20  # whose median is usual, so that a drift of the bench is seen at the bench
_LOOKED_AT = 60  # judgements: some are of the same unit, or of another kind


def earlier_units(store: Store, kind: str, but: str = "") -> list[Mapping[str, float]]:
    """Return what the last units of a kind measured, each unit once, the newest first. but: serial of the unit that is
    compared with them. Raises StoreError."""
    values: list[Mapping[str, float]] = []
    serials = {but}
    for event in store.newest(UnitJudged.KIND, _LOOKED_AT):
        if event.subject in serials or len(serials) > UNITS:
            continue
        result = UnitJudged.of(event).result
        if result.kind == kind:
            serials.add(event.subject)
            values.append(measured_values(result))
    return values


def open_session(
    store: Store,
    home: Path,
    spec: Spec,
    operator: str,
    serial: str,
    stated: BenchFile | None = None,
    training: bool = False,
    simulated: bool = False,
) -> Session:
    """Open a unit. stated: the bench file whose calibrations stand behind the findings, None without one. training: the
    unit is simulated, and signed with keys that are of no bench. simulated: so are its instruments.

    Raises EntryError if the serial is not valid, UnitBusy, StoreError, OSError."""
    return Session(
        store, home, spec, operator, serial, partial(refuse_passphrases, home), stated, training, simulated,
        held=partial(open_nonconformances, store, serial), weigh=consistent,
        before=earlier_units(store, spec.kind, but=serial),
    )  # fmt: skip
