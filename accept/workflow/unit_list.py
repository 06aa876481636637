"""Units that the bench has seen in the workflow, newest first."""

from dataclasses import dataclass

from accept.store import Store
from accept.store.payloads import AttemptStarted
from accept.workflow.state.unit_state import fold_run


@dataclass(frozen=True)
class KnownUnit:
    """A serial, its last attempt, and how far that has come."""

    serial: str
    kind: str
    attempt: int
    verdict: str | None
    signed: int
    taken: int

    @property
    def words(self) -> str:
        end = {0: "not signed", 1: "signed", 2: "signed and countersigned"}[min(self.signed, 2)]
        state = f"{self.verdict}, {end}" if self.verdict else f"{self.taken} step{'s' if self.taken != 1 else ''} begun"
        return f"attempt {self.attempt}: {state}"


def known_units(store: Store) -> list[KnownUnit]:
    """Return every unit with an attempt. Raises StoreError."""
    last = {event.subject: event.seq for event in store.events(what=AttemptStarted.KIND)}
    serials = sorted(last, key=lambda serial: -last[serial])
    found = (known_unit(store, serial) for serial in serials)
    return [unit for unit in found if unit is not None]


def known_unit(store: Store, serial: str) -> KnownUnit | None:
    """Return the entry of one serial, None for a new one. Raises StoreError."""
    attempt = fold_run(serial, store.events(serial)).attempt
    if attempt is None:
        return None
    taken = sum(1 for state in attempt.steps.values() if state.entries)
    return KnownUnit(serial, attempt.kind, attempt.number, attempt.verdict, len(attempt.signatures), taken)
