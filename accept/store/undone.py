"""Events that were taken back, and whether a unit is known by those that stand."""

from collections.abc import Iterable, Sequence

from accept.store.event import Event
from accept.store.payloads import AttemptStarted, EntryUndone, StepNoted, UnitJudged

NAMING = (UnitJudged.KIND, AttemptStarted.KIND)  # the events that bring a unit into the store


def undone(events: Iterable[Event]) -> set[int]:
    """Return the numbers of the events that later ones took back. Raises StoreError.

    A nonconformance is not among them, whatever an event says: only a decision of quality assurance releases it.
    """
    stored = list(events)
    holding = {e.seq for e in stored if e.what == StepNoted.KIND and StepNoted.of(e).nonconformance}
    return {EntryUndone.of(event).undoes for event in stored if event.what == EntryUndone.KIND} - holding


def is_named(events: Sequence[Event]) -> bool:
    """Return whether the events of a unit bring it into the store: not if its beginning was taken back. Raises
    StoreError."""
    return bool({event.seq for event in events if event.what in NAMING} - undone(events))
