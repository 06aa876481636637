"""Which judgements hold a recording: an index beside the events, so that a copy is found without reading them all.

It is made of the events and can be made again of them; `Store.check` holds it against them.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from sqlalchemy import Connection, insert, select

from accept.store import tables
from accept.store.event import Event

JUDGED = "unit_judged"
TABLE = "table"  # the channel under which a table's numbers stand
AT_ONCE = 400  # keys of one question


def keys_of(samples: Mapping[str, Mapping[str, str]]) -> set[int]:
    """Keys of a result's samples. Raises ValueError for what is no sketch."""
    from checks.signals.sketch import Sketch, key_of  # loads numpy: only where there are samples

    found: set[int] = set()
    for channels in samples.values():
        for channel, text in channels.items():
            found.update([key_of(text.encode())] if channel == TABLE else Sketch.parse(text).keys())
    return found


def rows_of(events: Iterable[Event]) -> Iterator[dict[str, int]]:
    """What the index holds of these events."""
    for event in events:
        yield from ({"key": key, "seq": event.seq} for key in sorted(_keys(event)))


def add(connection: Connection, events: Iterable[Event]) -> None:
    """Put these events into the index."""
    rows = list(rows_of(events))
    if rows:
        connection.execute(insert(tables.samples), rows)


def judgements_with(connection: Connection, keys: Iterable[int]) -> list[int]:
    """Numbers of the events that share a key, in order."""
    wanted, found = sorted(keys), set[int]()
    for start in range(0, len(wanted), AT_ONCE):
        chosen = tables.samples.c.key.in_(wanted[start : start + AT_ONCE])
        found.update(connection.scalars(select(tables.samples.c.seq).where(chosen).distinct()))
    return sorted(found)


def held(connection: Connection) -> Iterator[tuple[int, int]]:
    """(number of the event, key) of every row, in order."""
    ordered = select(tables.samples.c.seq, tables.samples.c.key).order_by(tables.samples.c.seq, tables.samples.c.key)
    for row in connection.execute(ordered.execution_options(yield_per=10_000)):
        yield row[0], row[1]


def _keys(event: Event) -> set[int]:
    if event.what != JUDGED or '"samples"' not in event.payload:
        return set()
    try:
        result: dict[str, Any] = json.loads(event.payload)["result"]
        return keys_of(result.get("samples", {}))
    except (KeyError, TypeError, AttributeError, ValueError):
        return set()  # an event of another program: nothing is found by it
