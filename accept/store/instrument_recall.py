"""Which units an instrument touched since a day: if it turns out to have been wrong, these are measured again."""

import datetime
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from accept.store import Event


@dataclass(frozen=True)
class Touch:
    """One event in which an instrument touched a unit. how: in words. time: UTC, ISO 8601."""

    unit: str
    time: str
    how: str
    seq: int


def touched(events: Iterable[Event], serial: str, since: datetime.date) -> list[Touch]:
    """Every touch of the instrument with this serial number on or after a day (UTC), in order."""
    first = since.isoformat()
    return [
        Touch(event.subject, event.time, how, event.seq)
        for event in events
        if event.time[:10] >= first
        for how in _how(event, serial)
    ]


def _how(event: Event, serial: str) -> Iterator[str]:
    data = event.data
    if event.what in ("captured", "capture_failed") and data.get("serial") == serial:
        yield f"{'measured' if event.what == 'captured' else 'tried'} {data.get('section')}"
    elif event.what == "unit_judged":
        rows: list[dict[str, Any]] = (data["result"].get("calibration") or {}).get("instruments", [])
        checks = [row["check"] for row in rows if row.get("serial") == serial]
        if checks:
            yield f"judged {', '.join(checks)}: {data['result']['verdict']}"
    elif serial in str(data.get("source", "")).split():  # the workflow names an instrument by model and serial number
        yield f"read {data.get('step')} {data.get('input')}"
