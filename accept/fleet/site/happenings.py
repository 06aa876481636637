"""What the store has of some days beside judgements: alarms, golden units, decisions of quality assurance, instruments
whose reference was missed, with the units that they touched since it was last right."""

import datetime
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from accept.base.names import shown_name
from accept.store import Event, Store, touched
from accept.store.decisions import words_of
from accept.store.payloads import (
    AttemptVoided,
    GoldenMissed,
    GoldenNamed,
    GoldenResolved,
    GoldenRetired,
    InstrumentChecked,
    NonconformanceDecided,
    payload_of,
)

ALARM, GOLDEN, DECISION, VOID, RECALL = "alarm", "golden unit", "decision", "void attempt", "recall"
KINDS = (
    GoldenNamed, GoldenRetired, GoldenMissed, GoldenResolved, NonconformanceDecided, AttemptVoided, InstrumentChecked,
)  # fmt: skip
_Row = dict[str, str]


def happenings(
    store: Store, since: datetime.date, until: datetime.date, trends: Mapping[str, Mapping[str, Sequence[Any]]]
) -> list[_Row]:
    """Return a row of day, kind, unit, person and words for each, by day. trends: as the page has them. Raises
    StoreError."""
    rows = [
        {"day": alarm["since"], "kind": ALARM, "unit": alarm["first"], "who": "", "words": alarm["words"]}
        for groups in trends.values()
        for group in groups.get("all", ())
        for alarm in group["alarms"]
    ]
    rows += [row for kind in KINDS for event in store.events(what=kind.KIND) for row in _of_event(event, store)]
    return sorted((r for r in rows if since.isoformat() <= r["day"] <= until.isoformat()), key=lambda row: row["day"])


def _of_event(event: Event, store: Store) -> Iterator[_Row]:
    unit, kind, words = event.subject, GOLDEN, ""
    match payload := payload_of(event):
        case GoldenNamed(expect=expected, reason=reason):
            words = f"named, expected {expected}{f': {reason}' if reason else ''}"
        case GoldenRetired(reason=reason):
            words = f"retired: {reason}"
        case GoldenMissed(serials=serials, reasons=reasons):
            unit = ", ".join(serials)
            words = f"the bench was stopped: {'; '.join(line for each in reasons.values() for line in each)}"
        case GoldenResolved(reason=reason):
            words = f"the bench may judge again: {reason}"
        case NonconformanceDecided():
            kind, words = DECISION, words_of(payload)
        case AttemptVoided(attempt=attempt):
            kind, words = VOID, f"attempt {attempt}: {payload.words}"
        case InstrumentChecked(passed=False, serial=str(serial)):
            kind, unit = RECALL, serial
            words = f"{payload.what} read as {payload.value:g} {payload.unit}, E_n {payload.E_n:.2g}; "
            words += _touched_since(store, event, serial)
    if words:
        who = shown_name(event.who, bool(payload and payload.typed))
        yield {"day": event.time[:10], "kind": kind, "unit": unit, "who": who, "words": words}


def _touched_since(store: Store, missed: Event, serial: str) -> str:
    """Return how many units the instrument touched between the day on which it was last right and this event."""
    checks = ((e, InstrumentChecked.of(e)) for e in store.events(what=InstrumentChecked.KIND) if e.seq < missed.seq)
    good = [event.time[:10] for event, check in checks if check.passed and check.serial == serial]
    since = max(good, default=datetime.date.min.isoformat())
    before = (event for event in store.events() if event.seq < missed.seq)
    units = {touch.unit for touch in touched(before, serial, datetime.date.fromisoformat(since))}
    when = f"since {since}, when it was last right" if good else "ever, as it was never right before"
    return f"{len(units)} units were touched by {serial} {when}"
