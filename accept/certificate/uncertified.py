"""A judgement that is stored and has no certificate: a kill or a time stamping authority that did not answer came
between, or no certificate was wanted then.

When its certificate is made later, nothing was measured or judged a second time: it is the same attempt, and replaces
what that attempt replaced.
"""

from collections.abc import Iterable

from accept.base.version import code_sha256
from accept.certificate.contents.content import canonical
from accept.judging.result import UnitResult
from accept.store import Event, Store, UnitState, fold
from accept.units.unit_folder import UnitFolder
from specs.spec import Spec


def is_due(last: UnitState, unit: UnitFolder, spec: Spec, who: str) -> bool:
    """Whether the unit's last judgement has no certificate, was made by the same person, and of the same inputs, spec
    and code."""
    if last.certificate is not None or last.who != who:
        return False
    return last.unchanged(unit.input_hashes(), spec.sha256, code_sha256())


def before(events: Iterable[Event], last: UnitState) -> UnitState | None:
    """What was known of a unit when its last judgement was made. events: all of the unit."""
    return fold(event for event in events if event.seq < last.seq).units.get(last.serial)


def repeats(store: Store, serial: str, seq: int, result: UnitResult) -> bool:
    """Whether a result is the one that is stored, so that one certificate states both."""
    stored = next(store.events(serial, "unit_judged", after=seq - 1))
    return canonical(stored.data["result"]) == canonical(result.to_json())
