"""The events that bring a unit into the store, and whether they still stand."""

from collections.abc import Iterable

from accept.store.event import Event
from accept.store.payloads import AttemptStarted, EntryUndone, UnitJudged, payload_of

NAMING = (UnitJudged.KIND, AttemptStarted.KIND)


def is_named(events: Iterable[Event]) -> bool:
    """Return whether the events of a unit bring it into the store: not if its beginning was taken back. Raises
    StoreError."""
    naming, undone = set[int](), set[int]()
    for event in events:
        if event.what in NAMING:
            naming.add(event.seq)
        elif isinstance(payload := payload_of(event, EntryUndone), EntryUndone):
            undone.add(payload.undoes)
    return bool(naming - undone)
