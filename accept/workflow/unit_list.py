"""Units that the bench has seen in the workflow, newest first."""

from dataclasses import dataclass
from datetime import datetime

from accept.store import Store
from accept.store.payloads import AttemptStarted
from accept.workflow.state.unit_state import EnteredValue, FileLink, fold_run
from checks.acceptance import CHECKS


@dataclass(frozen=True)
class KnownUnit:
    """A serial, its last attempt, and how far that has come."""

    serial: str
    kind: str
    attempt: int
    verdict: str | None
    signed: int
    taken: int
    begun_by: str = ""
    begun: str = ""  # UTC, ISO 8601
    last: str = ""  # the last entry, in words
    notes: int = 0

    @property
    def handed_over(self) -> str:
        """Return who began it and when, the last entry, and how many notes there are."""
        when = datetime.fromisoformat(self.begun).astimezone() if self.begun else None
        words = [f"begun by {self.begun_by}{when:, %a %d %b %H:%M}" if when else ""]
        words.append(f"last entry {self.last}" if self.last else "")
        words.append(f"{self.notes} note{'s' if self.notes > 1 else ''}" if self.notes else "")
        return "; ".join(filter(None, words))

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
    events = list(store.events(serial))
    attempt = fold_run(serial, events).attempt
    if attempt is None:
        return None
    begun = [event for event in events if event.what == AttemptStarted.KIND][-1]
    states = attempt.steps.values()
    last = max((entry for state in states for entry in state.entries), key=lambda entry: entry.seq, default=None)
    return KnownUnit(
        serial,
        attempt.kind,
        attempt.number,
        attempt.verdict,
        len(attempt.signatures),
        sum(1 for state in states if state.entries),
        begun.who,
        begun.time,
        "" if last is None else _entry_words(last),
        sum(len(state.notes) for state in states),
    )


def _entry_words(entry: EnteredValue | FileLink) -> str:
    if isinstance(entry, FileLink):
        return entry.file
    declared = next((c.inputs[entry.input] for c in CHECKS.values() if entry.input in c.inputs), None)
    name = entry.input if declared is None else declared.label
    return f"{name}{'' if entry.index is None else f' {entry.index + 1}'} {entry.value:.6g} {entry.unit}".strip()
