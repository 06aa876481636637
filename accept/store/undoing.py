"""Undone events, and whether a unit is known by the remaining ones."""

from collections.abc import Iterable, Sequence

from accept.store.event import Event
from accept.store.payloads import AttemptStarted, EntryUndone, StepNoted, UnitJudged

NAMING = (UnitJudged.KIND, AttemptStarted.KIND)  # the events that bring a unit into the store


def undone(events: Iterable[Event]) -> set[int]:
    """Return the numbers of undone events. Raises StoreError.

    A nonconformance is never undone: only a decision of quality assurance releases it; nor is a judgement."""
    stored = list(events)
    holding = {e.seq for e in stored if e.what == StepNoted.KIND and StepNoted.of(e).nonconformance}
    holding |= {e.seq for e in stored if e.what == UnitJudged.KIND}
    return {EntryUndone.of(event).undoes for event in stored if event.what == EntryUndone.KIND} - holding


def is_named(events: Sequence[Event]) -> bool:
    """Return whether the events put the unit on the list: not if its beginning was undone. Raises StoreError."""
    return bool({event.seq for event in events if event.what in NAMING} - undone(events))
