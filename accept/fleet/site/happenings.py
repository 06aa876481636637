"""What the store has of some days beside judgements: alarms, golden units, decisions of quality assurance, instruments
whose reference was missed, with the units that they touched since it was last right."""

import datetime
from collections.abc import Mapping, Sequence
from typing import Any

from accept.base.names import shown_name
from accept.fleet.golden_chart import GoldenTrend
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
    Payload,
)

_GOLDEN = "golden unit"
KINDS: dict[type[Payload], str] = {
    GoldenNamed: _GOLDEN, GoldenRetired: _GOLDEN, GoldenMissed: _GOLDEN, GoldenResolved: _GOLDEN,
    NonconformanceDecided: "decision", AttemptVoided: "void attempt", InstrumentChecked: "recall",
}  # fmt: skip
ALARM, WATCHED = "alarm", "to be watched"  # what rings (`accept.fleet.rings`), and what its own chart alone finds rare
_Row = dict[str, str]


def happenings(
    store: Store,
    since: datetime.date,
    until: datetime.date,
    trends: Mapping[str, Mapping[str, Sequence[Any]]],
    goldens: Sequence[GoldenTrend],
) -> list[_Row]:
    """Return a row of day, kind, unit, person and words for each, by day. trends: as the page has them; goldens: charts
    of golden units, of which those count that were off on these days. Raises StoreError."""
    days = since.isoformat(), until.isoformat()
    rows = [
        _alarm(alarm["rings"], alarm["since"], alarm["first"], alarm["words"])
        for groups in trends.values()
        for group in groups.get("all", ())
        for alarm in group["alarms"]
        if days[0] <= alarm["since"] <= days[1]
    ]
    for each in goldens:
        for alarm, doubt in zip(each.chart.alarms, each.doubts, strict=True):
            if doubt.is_between(since, until):
                begun = max(days[0], f"{each.rows['day'].iloc[alarm.first]:%Y-%m-%d}")
                rows.append(_alarm(alarm.rings, begun, each.serial, f"golden unit {each.words(alarm)}"))
    for what, kind in KINDS.items():
        for event in (e for e in store.events(what=what.KIND) if days[0] <= e.time[:10] <= days[1]):
            unit, words = _told(payload := what.of(event), event, store)
            who = shown_name(event.who, payload.typed)
            if words:
                rows.append({"day": event.time[:10], "kind": kind, "unit": unit, "who": who, "words": words})
    return sorted(rows, key=lambda row: row["day"])


def _alarm(rings: bool, day: str, unit: str, words: str) -> _Row:
    return {"day": day, "kind": ALARM if rings else WATCHED, "unit": unit, "who": "", "words": words}


def _told(payload: Payload, event: Event, store: Store) -> tuple[str, str]:
    """Return unit and words of an event, "" for an instrument that was right."""
    match payload:
        case GoldenNamed(expect=expected, reason=reason):
            return event.subject, f"named, expected {expected}{f': {reason}' if reason else ''}"
        case GoldenRetired(reason=reason):
            return event.subject, f"retired: {reason}"
        case GoldenMissed(serials=serials, reasons=reasons):
            words = "; ".join(line for each in reasons.values() for line in each)
            return ", ".join(serials), f"the bench was stopped: {words}"
        case GoldenResolved(reason=reason):
            return event.subject, f"the bench may judge again: {reason}"
        case NonconformanceDecided():
            return event.subject, words_of(payload)
        case AttemptVoided(attempt=attempt):
            return event.subject, f"attempt {attempt}: {payload.words}"
        case InstrumentChecked(passed=False, instrument=name, serial=serial):
            missed = f"{payload.what} read as {payload.value:g} {payload.unit}, E_n {payload.E_n:.2g}; "
            unknown = "which units it touched is not known: it states no serial number"
            return serial or name, missed + (_touched_since(store, event, serial) if serial else unknown)
    return "", ""


def _touched_since(store: Store, missed: Event, serial: str) -> str:
    """Return how many units the instrument touched between the day on which it was last right and this event."""
    checks = ((e, InstrumentChecked.of(e)) for e in store.events(what=InstrumentChecked.KIND) if e.seq < missed.seq)
    good = [event.time[:10] for event, check in checks if check.passed and check.serial == serial]
    since = max(good, default=datetime.date.min.isoformat())
    before = (event for event in store.events() if event.seq < missed.seq)
    units = {touch.unit for touch in touched(before, serial, datetime.date.fromisoformat(since))}
    when = f"since {since}, when it was last right" if good else "ever, as it was never right before"
    return f"{len(units)} units were touched by {serial} {when}"
