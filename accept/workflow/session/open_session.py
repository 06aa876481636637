"""Opening a unit, with what the rest of the bench knows about it."""

from functools import partial
from pathlib import Path

from accept.judging.nonconformance import open_nonconformances
from accept.store import Store
from accept.workflow.entry.passphrase_guard import refuse_passphrases
from accept.workflow.session import Session
from accept.workflow.state.usual_values import usual_values
from specs.bench import BenchFile
from specs.spec import Spec


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
        held=partial(open_nonconformances, store, serial), usual=usual_values(store, spec.kind, but=serial),
    )  # fmt: skip
