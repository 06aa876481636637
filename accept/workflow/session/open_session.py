"""Opening a unit, with what the rest of the bench knows about it."""

from collections import defaultdict
from functools import partial
from pathlib import Path
from statistics import median

from accept.judging import consistent
from accept.judging.reservations import measured_values, open_nonconformances
from accept.store import Store
from accept.store.payloads import UnitJudged
from accept.workflow.entry.passphrase_guard import refuse_passphrases
from accept.workflow.session import Session
from specs.bench import BenchFile
from specs.spec import Spec

UNITS = 20  # of which the median is usual, so that a drift of the bench is seen at the bench
FEWEST = 5  # values; fewer say nothing
_LOOKED_AT = 60  # judgements: some are of the same unit, or of another kind


def usual_values(store: Store, kind: str, but: str = "") -> dict[str, float]:
    """Return the median of each quantity over the last judgements of units of a kind, each unit once. but: serial of
    the unit that is compared with them. Raises StoreError."""
    values, serials = defaultdict[str, list[float]](list), {but}
    for event in store.newest(UnitJudged.KIND, _LOOKED_AT):
        if event.subject in serials or len(serials) > UNITS:
            continue
        result = UnitJudged.of(event).result
        if result.kind == kind:
            serials.add(event.subject)
            for quantity, value in measured_values(result).items():
                values[quantity].append(value)
    return {quantity: median(found) for quantity, found in values.items() if len(found) >= FEWEST}


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
        usual=usual_values(store, spec.kind, but=serial),
    )  # fmt: skip
