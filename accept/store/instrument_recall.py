"""Recall of an instrument that was found wrong: the units to be measured again, since a day."""

import datetime
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from accept.store import Event
from accept.store.payloads import (
    CaptureFailed,
    ReadingFailed,
    RecordLinked,
    SectionCaptured,
    UnitJudged,
    ValueTaken,
    payload_of,
)


@dataclass(frozen=True)
class Touch:
    """One event in which an instrument touched a unit. how: in words. time: UTC, ISO 8601."""

    unit: str
    time: str
    how: str
    seq: int


def touched(events: Iterable[Event], serial: str, since: datetime.date, bench: str = "") -> list[Touch]:
    """Return every touch of the instrument with this serial number on or after a day (UTC), in order. serial "": every
    judgement of this bench, and those of before that name none."""
    first = since.isoformat()
    return [
        Touch(event.subject, event.time, how, event.seq)
        for event in events
        if event.time[:10] >= first
        for how in _how(event, serial, bench)
    ]


def _read(serial: object) -> str:
    """Return a serial number of an instrument as a person reads it: capitals and the number of blanks do not count."""
    return " ".join(str(serial or "").split()).casefold()


def _how(event: Event, serial: str, bench: str) -> Iterator[str]:
    wanted = _read(serial)
    match payload_of(event, SectionCaptured, CaptureFailed, UnitJudged, ValueTaken, RecordLinked, ReadingFailed):
        case UnitJudged(result=result, bench=at) if not serial:
            if at in ("", bench):
                yield f"judged: {result.verdict}"
        case _ if not wanted:
            return  # a blank names no instrument, also none that states no serial number
        case SectionCaptured(section, serial=of) if _read(of) == wanted:
            yield f"measured {section}"
        case CaptureFailed(section, serial=of) if _read(of) == wanted:
            yield f"tried {section}"
        case UnitJudged(result=result):
            rows: list[dict[str, Any]] = (result.calibration or {}).get("instruments", [])
            checks = [row["check"] for row in rows if _read(row.get("serial")) == wanted]
            if checks:
                yield f"judged {', '.join(checks)}: {result.verdict}"
        case (
            ValueTaken(step, input=name, source=source)
            | RecordLinked(step, input=name, source=source)
            | ReadingFailed(step, input=name, source=source)
        ):
            if f" {wanted} " in f" {_read(source)} ":  # an instrument is named by model and serial number
                yield f"read {step} {name}".rstrip()
