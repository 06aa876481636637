"""A judgement that is stored and has no certificate: a kill or a time stamping authority that did not answer came
between, or no certificate was wanted then.

When its certificate is made later, nothing was measured or judged a second time: it is the same attempt, and replaces
what that attempt replaced.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from accept.base.version import code_sha256
from accept.certificate.contents.content import canonical
from accept.judging.result import UnitResult
from accept.store import Event, Store, UnitState, fold
from accept.units.unit_folder import UnitFolder
from specs.spec import Spec


@dataclass(frozen=True, eq=False)
class Uncertified:
    """Such a judgement, by the number of its event, and what was known of the unit before it."""

    seq: int
    before: UnitState | None


def last_of(events: Iterable[Event], unit: UnitFolder, spec: Spec, who: str) -> Uncertified | None:
    """The unit's last judgement where it has no certificate, was made by the same person, and of the same inputs, spec
    and code. events: all of the unit."""
    known = list(events)
    last = fold(known).units.get(unit.serial)
    if last is None or last.certificate is not None:
        return None
    if not last.unchanged(unit.input_hashes(), spec.sha256, code_sha256()):
        return None
    if next(event for event in known if event.seq == last.seq).who != who:
        return None
    return Uncertified(last.seq, fold(event for event in known if event.seq < last.seq).units.get(unit.serial))


def repeats(store: Store, serial: str, seq: int, result: UnitResult) -> bool:
    """Whether a result is the one that is stored, so that one certificate states both."""
    stored = next(store.events(serial, "unit_judged", after=seq - 1))
    return canonical(stored.data["result"]) == canonical(result.to_json())
