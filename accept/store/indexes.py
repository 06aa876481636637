"""Indexes beside the events: which judgements hold a recording or name a part, so that neither search reads all events.

They are made from the events and can be made again; `Store.check` compares them with the events. A key is a 63-bit hash
of the search term, so every event that an index finds must be read."""

import hashlib
import heapq
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from sqlalchemy import Connection, Table, delete, insert, select

from accept.base.spelling import spelling_key
from accept.store import tables
from accept.store.chain import ChainBreak
from accept.store.event import Event

JUDGED = "unit_judged"
TABLE = "table"  # channel name of a table's numbers
AT_ONCE = 400  # keys of one question, events of one page

_Row = tuple[int, int, int]  # number of the event, which of the INDEXES, key


def in_parts(keys: Sequence[int]) -> Iterator[Sequence[int]]:
    """Yield the keys, so many as one question may have."""
    return (keys[start : start + AT_ONCE] for start in range(0, len(keys), AT_ONCE))


@dataclass(frozen=True)
class EventIndex:
    """An index of the judgements by a kind of key.

    of: its content, in words. keys: of a judgement's result; it may raise any error on a result of another program.
    mark: occurs in the canonical JSON of every judgement with keys."""

    table: Table
    of: str
    keys: Callable[[Mapping[str, Any]], set[int]]
    mark: str

    def judgements_with(self, connection: Connection, keys: Iterable[int]) -> list[int]:
        """Return the numbers of the events that have one of these keys, in order."""
        k = self.table.c
        asked = (select(k.seq).where(k.key.in_(part)).distinct() for part in in_parts(sorted(keys)))
        return sorted({seq for question in asked for seq in connection.scalars(question)})

    def keys_of(self, connection: Connection, seq: int, among: Iterable[int]) -> set[int]:
        """Return which of these keys the index has for the event of this number."""
        k = self.table.c
        asked = (select(k.key).where(k.seq == seq, k.key.in_(part)) for part in in_parts(sorted(among)))
        return {key for question in asked for key in connection.scalars(question)}

    def held(self, connection: Connection) -> Iterator[tuple[int, int]]:
        """Yield (number of the event, key) of every row, in order; 0 for a number that is not an integer."""
        ordered = select(self.table.c.seq, self.table.c.key).order_by(self.table.c.seq, self.table.c.key)
        with connection.execute(ordered.execution_options(yield_per=10_000)) as rows:
            for seq, key in rows:
                yield (seq if type(seq) is int else 0), key


def sample_keys(samples: Mapping[str, Mapping[str, str]]) -> set[int]:
    """Return the keys of a result's samples. Raises ValueError if a text is not a sketch."""
    from checks.signals import Sketch  # loads numpy: only if a result has samples

    found: set[int] = set()
    for channels in samples.values():
        for channel, text in channels.items():
            found.update([Sketch.key(text.encode())] if channel == TABLE else Sketch.parse(text).keys())
    return found


def part_keys(parts: Iterable[Any]) -> set[int]:
    """Return the keys of serials of parts: one for all that differ only in capitals."""
    spelled = (spelling_key(part).encode("utf-8", "surrogatepass") for part in parts if isinstance(part, str))
    return {int.from_bytes(hashlib.sha256(one).digest()[:8], "big") >> 1 for one in spelled}


SAMPLES = EventIndex(tables.samples, "samples", lambda result: sample_keys(result.get("samples", {})), '"samples"')
PARTS = EventIndex(tables.parts, "parts", lambda result: part_keys(result.get("parts", {}).values()), '"parts":{"')
INDEXES = (SAMPLES, PARTS)


def add(connection: Connection, events: Iterable[Event]) -> None:
    """Add these events to the indexes."""
    rows = list(_rows(events))
    for which, index in enumerate(INDEXES):
        if mine := [{"key": key, "seq": seq} for seq, number, key in rows if number == which]:
            connection.execute(insert(index.table), mine)


def build(connection: Connection) -> None:
    """Build the indexes of all events anew. An event that was altered is left out."""
    for index in INDEXES:
        connection.execute(delete(index.table))
    e, after = tables.events.c, 0
    page = select(tables.events).where(e.what == JUDGED).order_by(e.seq).limit(AT_ONCE)
    while found := [Event(*row) for row in connection.execute(page.where(e.seq > after))]:
        add(connection, (event for event in found if event.intact))
        after = found[-1].seq


def problem(connection: Connection, events: Iterable[Event]) -> ChainBreak | None:
    """Return the first event for which an index is wrong, None if all are right. events: the whole store's."""
    held = heapq.merge(*(_numbered(which, index.held(connection)) for which, index in enumerate(INDEXES)))
    for due, there in zip_longest(_rows(events), held):
        if due != there:
            seq, which = min(row[:2] for row in (due, there) if row is not None)
            return ChainBreak(
                seq,
                f"the index of {INDEXES[which].of} is not that of event {seq}; restore a backup: "
                "the index is built again",
            )
    return None


def lacking(connection: Connection, event: Event) -> bool:
    """Return whether an index lacks a row of this event, which a search would then miss."""
    due: dict[int, set[int]] = {}
    for _, which, key in _rows([event]):
        due.setdefault(which, set()).add(key)
    return any(not keys <= INDEXES[which].keys_of(connection, event.seq, keys) for which, keys in due.items())


def _numbered(which: int, rows: Iterable[tuple[int, int]]) -> Iterator[_Row]:
    return ((seq, which, key) for seq, key in rows)


def _rows(events: Iterable[Event]) -> Iterator[_Row]:
    for event in events:
        marked = [pair for pair in enumerate(INDEXES) if event.what == JUDGED and pair[1].mark in event.payload]
        result = _result(event) if marked else {}
        for which, index in marked:
            yield from ((event.seq, which, key) for key in sorted(_keys(index, result)))


def _result(event: Event) -> Any:
    try:
        return json.loads(event.payload)["result"]
    except (KeyError, TypeError, ValueError):
        return {}


def _keys(index: EventIndex, result: Any) -> set[int]:
    try:
        return index.keys(result)
    except (KeyError, TypeError, AttributeError, ValueError):
        return set()  # an event of another program: nothing is found by it
