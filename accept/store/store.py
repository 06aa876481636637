"""The store: appends events under a lock, reads them back verified, and checks the whole chain."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import Connection, Engine, Row, Select, func, insert, select, update

from accept.base.names import KeyHolder
from accept.base.spelling import look_alike, look_key, spelling_key
from accept.base.version import code_sha256
from accept.store import indexes, tables
from accept.store.chain import START, ChainBreak, StoreHead, first_problem, misfit
from accept.store.engine import appending, reconnecting, reported, snapshot
from accept.store.event import Event, NewEvent, Overtaken, StoreError, sealed
from accept.store.folding import NAMING, is_named
from accept.store.payloads import Payload
from accept.store.seal import Anchor, Sealer, SignedHead, file_looks, rows_look

END_NOT_KEPT = (
    "no seal of it lies at this bench, so events that were removed from its end would not show: "
    "accept store check --head FILE compares it with an exported head or a certificate"
)
CLOCK_BACK_S = 300.0  # clocks of benches that share a store differ by seconds, not by minutes
_PAGE = 500  # events read at once; between pages no lock is held

T = TypeVar("T")


class Store:
    """An open event store; a context manager. May be shared by threads; other processes open their own."""

    def __init__(
        self, engine: Engine, where: str, anchor: Anchor | None, sealer: Sealer | None = None, file: Path | None = None
    ) -> None:
        """Take an open engine; `open_store` makes one. sealer: None for a store in memory. file: None for a server."""
        self.where = where
        self._engine, self._anchor, self.sealer, self._file = engine, anchor, sealer, file
        self._checked: StoreHead | None = None  # end of the chain as this program walked or wrote it
        self._made = 0.0  # when the chain was last walked whole [s]
        self._looks = ""  # state of the database then
        self._last_time = ""  # of the event that the last append followed

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the database. Seal the checked and written events if no other program wrote meanwhile."""
        head, file = self._checked, self._file
        undisturbed = head not in (None, START) and file is not None and self._looks == file_looks(file)
        self._engine.dispose()  # the log of writes goes into the file now
        if undisturbed and self.sealer and head and file:
            self.sealer.write(head, file_looks(file), self._made)

    @property
    def end_is_kept(self) -> bool:
        """Whether this bench keeps an earlier end of the chain, with which the present one is compared: beside the file
        of the database or, for a server, in its own folder."""
        written = self._file is not None or (self._anchor is not None and self._anchor.path.exists())
        return written or (self.sealer is not None and self.sealer.read(old_too=True) is not None)

    @property
    def is_made(self) -> bool:
        """Whether the store has its tables: a program that is killed before it makes them leaves a file without."""
        return self._ask(lambda connection: bool(tables.present(connection)))

    def verify(self, whole: bool = False) -> None:
        """Check the chain before it is used: whole, or from the last seal if the database is as it was sealed.

        Raises StoreError if it is broken: the store is then not used, and nothing is appended."""
        if not whole and self._unchanged_since_seal():
            return
        self._made = time.time()
        known = self.end_is_kept
        problem = self.check()
        if problem is not None:
            raise StoreError(
                f"{self.where}: integrity check failed: {problem}; it is not used. `accept store check` gives details, "
                "`accept store restore` takes a backup"
            )
        if not known and self.sealer is not None and self.head() != START:
            from accept.base.console import say  # loads rich: only for a warning

            say(f"warning: {self.where}: {END_NOT_KEPT}")

    def _unchanged_since_seal(self) -> bool:
        seal = self.sealer.read() if self.sealer else None
        if seal is None:
            return False
        before = file_looks(self._file) if self._file else ""

        def unchanged(connection: Connection) -> bool:
            head = _head_row(connection)
            looks = before or rows_look(connection, seal.head.seq)
            if head is None or looks != seal.looks or self._tail_problem(connection, seal.head, head) is not None:
                return False
            if self._file is None and tables.foreign_columns(connection):  # the seal of a file is of its tables too
                return False
            self._made = seal.made
            self._hold(connection, head, before)
            return True

        return self._ask(unchanged)

    def _hold(self, connection: Connection, head: StoreHead, looks: str) -> None:
        """Remember a check. A server's rows are sealed at once, in the transaction of the check."""
        self._checked, self._looks = head, looks
        if self.sealer and self._file is None:
            self.sealer.write(head, rows_look(connection, head.seq), self._made)

    def _tail_problem(self, connection: Connection, sealed: StoreHead, head: StoreHead) -> ChainBreak | None:
        """Return the first break of the chain after the sealed events, None if it is unbroken."""
        try:
            anchors = self._anchors(None)
        except ValueError as e:
            return ChainBreak(0, str(e))
        if missing := self._missing_anchor(head):
            return ChainBreak(0, f"{missing} is missing")
        last, kept = sealed, {a.seq: a for a in anchors.values()}
        ordered = select(tables.events).where(tables.events.c.seq >= sealed.seq).order_by(tables.events.c.seq)
        for number, event in enumerate(map(_event, connection.execute(ordered))):
            if number == 0:
                if not event.intact or _head_of(event) != sealed:
                    return ChainBreak(sealed.seq, f"event {sealed.seq} is not the one that was sealed")
                continue
            if problem := misfit(event, last):
                return problem
            if indexes.lacking(connection, event):  # appended by an accept without this index
                return ChainBreak(event.seq, f"an index lacks event {event.seq}")
            last = _head_of(event)
            if kept.get(last.seq, last) != last:
                return ChainBreak(last.seq, f"event {last.seq} is not the one that was kept")
        ends = [a for a in anchors.values() if a.seq >= last.seq and a != last]
        return ChainBreak(last.seq, "its end is not the one that was kept") if last != head or ends else None

    def _missing_anchor(self, head: StoreHead) -> str | None:
        """Return the name of the file that stands beside the file of every database, if it is missing. head: seen
        before this is asked, as the file is there before the first event is."""
        if self._file is None or self._anchor is None or head == START or self._anchor.read() is not None:
            return None
        return self._anchor.path.name

    def signed_head(self) -> SignedHead | None:
        """Return the last event with the bench's signature, for certificates and `accept store head`, event 0 for an
        empty store; None for a store in memory. Raises StoreError."""
        if self.sealer is None:
            return None
        head = self.head()
        with reported(self.where):
            return self.sealer.signed_head(head)

    @property
    def bench(self) -> str:
        """Return the public key of the bench that uses this store, "" for a store in memory. Raises StoreError."""
        if self.sealer is None:
            return ""
        with reported(self.where):
            return self.sealer.bench

    def append(self, what: str, subject: str, payload: Mapping[str, Any], *, who: str, spec: str = "") -> Event:
        """Append one event. When this returns, the event is on the disk: it survives a kill and a power cut.

        Raises StoreError if it cannot be stored (nothing is then half-stored), or if the end of the chain is damaged:
        nothing is built on a broken chain."""
        return self.append_many([NewEvent(what, subject, payload, spec)], who=who)[0]

    def write(
        self, payload: Payload, subject: str = "", *, who: str, spec: str = "", after: int | None = None
    ) -> Event:
        """Append the event of a payload, as `append` does, marked as typed unless `who` is a `KeyHolder`. subject: a
        unit's serial; after: number of the last event about it that was read, 0 for none. Raises StoreError, Overtaken
        if the store has a later one."""
        return self.write_all([payload], subject, who=who, spec=spec, after=after)[0]

    def write_all(
        self, payloads: Sequence[Payload], subject: str, *, who: str, spec: str = "", after: int | None = None
    ) -> list[Event]:
        """Append the events of all payloads in one transaction, or none of them, as `write` does."""
        marked = [replace(each, typed=not isinstance(who, KeyHolder)).about(subject, spec) for each in payloads]
        return self.append_many([replace(each, after=after) for each in marked], who=str(who))

    def append_many(self, entries: Sequence[NewEvent], *, who: str) -> list[Event]:
        """Append all entries in one transaction, or none of them, as `append` does. If the connection to a server is
        lost, it is made again, and nothing is appended twice. Raises also Overtaken: no other program appends between
        this comparison and the commit."""
        if not entries:
            return []
        tried: list[Event] = []
        ours = False  # no other program wrote: only events that this one checked and wrote are sealed

        def once() -> list[Event]:
            nonlocal ours
            with appending(self._engine) as connection:
                if not (tried and self._holds(connection, tried[-1])):
                    _check_followed(connection, entries)
                    end = self._end(connection)
                    ours = end == self._checked and self._file is not None and file_looks(self._file) == self._looks
                    tried[:] = self._put(connection, entries, who, end)
            return tried

        with reported(self.where):
            new = reconnecting(once)
            if self._anchor:
                self._anchor.write(_head_of(new[-1]))
            if ours and self._file:
                self._checked, self._looks = _head_of(new[-1]), file_looks(self._file)
        self._warn_of_clock(new[0])
        return new

    def _warn_of_clock(self, event: Event) -> None:
        """Warn that the clock was set back. The event is stored all the same: an event that was stored while the clock
        was a year ahead must not stop the bench for a year."""
        back = _seconds_back(self._last_time, event.time)
        if back > CLOCK_BACK_S:
            from accept.base.console import say  # loads rich: only for a warning

            say(
                f"warning: {event.name} lies {back / 60:.0f} min before the event before it; check this machine's clock"
            )

    def _put(self, connection: Connection, entries: Sequence[NewEvent], who: str, end: StoreHead) -> list[Event]:
        """Write entries after the last event, without a commit."""
        new = _chained(entries, who, end)
        if self._anchor and end == START:
            self._anchor.write(START)  # before the first event is there: from then on a missing file is a fault
        connection.execute(insert(tables.events), [asdict(event) for event in new])
        indexes.add(connection, new)
        connection.execute(update(tables.head).where(tables.head.c.id == 1).values(seq=new[-1].seq, hash=new[-1].hash))
        return new

    def _holds(self, connection: Connection, event: Event) -> bool:
        """Return whether an event was committed although its acknowledgement never came."""
        there = select(tables.events.c.hash).where(tables.events.c.seq == event.seq)
        return bool(connection.scalar(there) == event.hash)

    def events(self, subject: str | None = None, what: str | None = None, after: int = 0) -> Iterator[Event]:
        """Yield the events above number `after`, in order, of one subject or kind if given.

        Raises StoreError at an event whose hash is wrong."""
        wanted = _wanted(subject, what).order_by(tables.events.c.seq).limit(_PAGE)
        while page := self._read(wanted.where(tables.events.c.seq > after)):
            yield from page
            after = page[-1].seq

    def latest(self, subject: str, what: str) -> Event | None:
        """Return the last event of a kind about a subject, or None. Raises as `events`."""
        found = self._read(_wanted(subject, what).order_by(tables.events.c.seq.desc()).limit(1))
        return found[0] if found else None

    def newest(self, what: str, count: int, before: int | None = None, bench: str = "") -> list[Event]:
        """Return the last events of this kind, below a number if given, the newest first. bench: only those of which it
        is the bench, by its public key: others share the store. Raises as `events`."""
        wanted, seq = _wanted(None, what), tables.events.c.seq
        if bench:
            wanted = wanted.where(tables.events.c.payload.contains(f'"bench":"{bench}"', autoescape=True))
        return self._read((wanted if before is None else wanted.where(seq < before)).order_by(seq.desc()).limit(count))

    def last_of_each(self, what: str) -> Iterator[Event]:
        """Yield the last event of a kind about each subject, by subject, as of now. Raises as `events`."""
        e, now = tables.events.c, self.head().seq
        last = select(func.max(e.seq)).where(e.what == what, e.seq <= now).group_by(e.subject).order_by(e.subject)
        wanted, next_page = select(tables.events).order_by(e.subject), last.limit(_PAGE)
        while page := self._read(wanted.where(e.seq.in_(next_page))):
            yield from page
            next_page = last.where(e.subject > page[-1].subject).limit(_PAGE)

    def judgements_with(self, samples: Mapping[str, Mapping[str, str]], but: str = "") -> list[Event]:
        """Return the judgements with one of these samples by the index, in order, except those of the unit `but`.

        Raises as `events`, ValueError if a sample is not a sketch."""
        keys = indexes.sample_keys(samples)
        if not keys:
            return []
        numbers = self._ask(lambda connection: indexes.SAMPLES.judgements_with(connection, keys))
        wanted = select(tables.events).where(tables.events.c.subject != but)
        return [e for p in indexes.in_parts(numbers) for e in self._read(wanted.where(tables.events.c.seq.in_(p)))]

    def naming(self, part: str) -> list[str]:
        """Return the subjects, in order, with a judgement that may name this serial among its parts, in any capitals,
        by the index. Every such judgement counts, not only the last. Raises StoreError."""
        e, p = tables.events.c, tables.parts.c
        asked = select(e.subject).join_from(tables.parts, tables.events, p.seq == e.seq)
        asked = asked.where(p.key.in_(indexes.part_keys([part])))
        return self._ask(lambda connection: sorted(connection.scalars(asked.distinct())))

    def other_spelling(self, serial: str) -> str | None:
        """Return the stored serial that differs from this one only in capitals; None if this one is stored or no other
        is. Units taken off the list do not count. Raises StoreError."""
        known = self._alike(serial)
        same = [each for each in known if spelling_key(each) == spelling_key(serial)]
        return None if serial in known else min(same, default=None)

    def look_alikes(self, serial: str) -> list[str]:
        """Return the serials from which this one has to be told apart: those that were in the store before it, or are
        while it is not, and look like it. None if `other_spelling` refuses it. Raises StoreError."""
        known = self._alike(serial)
        if serial in known:
            return known[: known.index(serial)]
        return [] if any(spelling_key(each) == spelling_key(serial) for each in known) else known

    def _alike(self, serial: str) -> list[str]:
        """Return the known serials that look like this one, itself included, in order of their first event."""
        e = tables.events.c
        asked = select(e.subject).where(tables.LOOK == look_key(serial), e.what.in_(NAMING))
        asked = asked.group_by(e.subject).order_by(func.min(e.seq))
        found = self._ask(lambda connection: list(connection.scalars(asked)))
        if found in ([], [serial]):  # as for most: no events are read
            return found
        return [each for each in found if look_alike(each, serial) and is_named(list(self.events(each)))]

    @property
    def engine(self) -> Engine:
        return self._engine

    def holds(self, head: StoreHead) -> bool:
        """Return whether the store has this event, with this hash. Raises StoreError."""
        asked = select(tables.events.c.hash).where(tables.events.c.seq == head.seq)
        return head == START or self._ask(lambda connection: connection.scalar(asked)) == head.hash

    def keep_head(self, head: StoreHead) -> None:
        """Write the head's file after events were copied in as they are. Raises StoreError."""
        if self._anchor:
            self._anchor.write(head)

    def head(self) -> StoreHead:
        """Return number and hash of the last event. With a copy kept elsewhere, `check` detects any earlier change."""
        found = self._read(select(tables.events).order_by(tables.events.c.seq.desc()).limit(1))
        return _head_of(found[0]) if found else START

    def check(self, exported: StoreHead | None = None) -> ChainBreak | None:
        """Return the first altered, missing, inserted or moved event of the whole store, None if the chain is unbroken.

        exported : a head that was kept elsewhere. `accept.store.chain` lists which changes can be found."""
        try:
            anchors = self._anchors(exported)  # read before the events: they may only be ahead of it
        except ValueError as e:
            return ChainBreak(0, str(e))
        before = file_looks(self._file) if self._file else ""
        return self._ask(lambda connection: self._first_problem(connection, anchors, before))

    def _first_problem(
        self, connection: Connection, anchors: Mapping[str, StoreHead], before: str
    ) -> ChainBreak | None:
        """Walk the whole chain and return its first break; remember an unbroken one. before: state of the file."""
        if foreign := tables.foreign_columns(connection):
            return ChainBreak(0, f"the tables are not those of this store: {', '.join(foreign)}")
        row = _head_row(connection)
        if row is None:
            return ChainBreak(0, "the row of table head is missing or altered")
        if missing := self._missing_anchor(row):
            return ChainBreak(0, f"{missing} is missing: it stands beside every store")
        ordered = select(tables.events).order_by(tables.events.c.seq).execution_options(yield_per=_PAGE)
        with connection.execute(ordered) as rows:
            problem = first_problem(map(_event, rows), row, anchors)
        if problem is None and connection.dialect.name == "sqlite":  # no question finds what SQLite's own index lacks
            found = connection.exec_driver_sql("PRAGMA integrity_check(1)").scalar()
            words = f"the database does not agree with its own indexes: {found}"
            problem = None if found == "ok" else ChainBreak(0, words)
        if problem is None:
            with connection.execute(ordered) as rows:
                problem = indexes.problem(connection, map(_event, rows))
        if problem is None:
            self._hold(connection, row, before)
        return problem

    def latest_times(self, before: int) -> list[str]:
        """Return the latest time, not after now, of the events below a number, and the latest of all; none without
        events. Raises StoreError."""
        e, now = tables.events.c, datetime.now(UTC).isoformat(timespec="microseconds")
        asked = select(func.max(e.time)).where(e.seq < before)
        found = self._ask(lambda c: [c.scalar(each) for each in (asked.where(e.time <= now), asked)])
        return [each for each in dict.fromkeys(found) if each]

    def clock_set_back(self) -> list[tuple[str, float]]:
        """Return the events over `CLOCK_BACK_S` earlier than their predecessor, and the seconds. Raises StoreError."""
        e = tables.events.c

        def walked(connection: Connection) -> list[tuple[str, float]]:
            rows = connection.execute(select(e.seq, e.time, e.what, e.subject).order_by(e.seq))
            return [
                (f"event {row.seq} ({row.what} {row.subject})", back)
                for last, row in pairwise(rows)
                if (back := _seconds_back(last.time, row.time)) > CLOCK_BACK_S
            ]

        return self._ask(walked)

    def _anchors(self, exported: StoreHead | None) -> dict[str, StoreHead]:
        kept = {"the exported head": exported} if exported else {}
        if self._anchor and (head := self._anchor.read()):
            kept[self._anchor.path.name] = head
        if self.sealer and (sealed := self.sealer.read(old_too=True)):
            kept["the bench's seal"] = sealed.head
        return kept

    def _end(self, connection: Connection) -> StoreHead:
        """Return the event to follow. Raises StoreError if the end of the chain is not as it was left."""
        last = select(tables.events).order_by(tables.events.c.seq.desc()).limit(1)
        end = [_event(row) for row in connection.execute(last)]
        head = _head_of(end[0]) if end else START
        self._last_time = end[0].time if end else ""
        if (
            not all(event.intact for event in end)
            or _head_row(connection) != head
            or not self._anchored(connection, head)
        ):
            raise StoreError(f"{self.where}: its last events were altered or removed; see accept store check")
        return head

    def _anchored(self, connection: Connection, head: StoreHead) -> bool:
        if self._anchor is None:
            return True
        try:
            kept = self._anchor.read()
        except ValueError as e:
            raise StoreError(f"{self.where}: {e}") from e
        if kept is None:
            return head == START or self._file is None
        if kept in (head, START):
            return True
        there = select(tables.events.c.hash).where(tables.events.c.seq == kept.seq)
        return connection.scalar(there) == kept.hash

    def _ask(self, question: Callable[[Connection], T]) -> T:
        """Query a snapshot of the database, again if the server's connection is lost. Raises StoreError."""

        def once() -> T:
            with snapshot(self._engine) as connection:
                return question(connection)

        with reported(self.where):
            return reconnecting(once)

    def _read(self, wanted: Select[Any]) -> list[Event]:
        found = self._ask(lambda connection: [_event(row) for row in connection.execute(wanted)])
        for event in found:
            if not event.intact:
                raise StoreError(f"{self.where}: {event.name} was altered; see accept store check")
        return found


def _wanted(subject: str | None, what: str | None) -> Select[Any]:
    query = select(tables.events)
    if subject is not None:
        query = query.where(tables.events.c.subject == subject)
    return query if what is None else query.where(tables.events.c.what == what)


def _check_followed(connection: Connection, entries: Sequence[NewEvent]) -> None:
    e = tables.events.c
    for entry in entries:
        if entry.after is not None:
            last = connection.scalar(select(func.max(e.seq)).where(e.subject == entry.subject)) or 0
            if last > entry.after:
                raise Overtaken(f"{entry.what} {entry.subject}: event {last} came before it could be stored")


def _chained(entries: Sequence[NewEvent], who: str, last: StoreHead) -> list[Event]:
    new: list[Event] = []
    for entry in entries:
        now = datetime.now(UTC).isoformat(timespec="microseconds")
        new.append(sealed(last.seq + 1, now, who, entry, code_sha256(), last.hash))
        last = _head_of(new[-1])
    return new


def _seconds_back(earlier: str, later: str) -> float:
    """Return by how much a time lies before that of the preceding event [s], 0 if a text is not a time."""
    try:
        return (datetime.fromisoformat(earlier) - datetime.fromisoformat(later)).total_seconds()
    except (TypeError, ValueError):
        return 0.0


def _head_row(connection: Connection) -> StoreHead | None:
    row = connection.execute(select(tables.head.c.seq, tables.head.c.hash).where(tables.head.c.id == 1)).first()
    whole = row is not None and type(row.seq) is int and row.seq >= 0 and type(row.hash) is str
    return StoreHead(row.seq, row.hash) if row is not None and whole else None


def _head_of(event: Event) -> StoreHead:
    return StoreHead(event.seq, event.hash)


def _event(row: Row[Any]) -> Event:
    return Event(*tuple(row))


NOT_SEEN = (
    "not seen here: events that were rewritten together with all hashes after them, by a person with the bench's key; "
    "--head FILE compares with a head or a certificate that was kept elsewhere"
)


def check_lines(store: Store, exported: StoreHead | None = None) -> tuple[bool, list[str]]:
    """Return whether the store is unbroken, and the lines that state so or name the first broken place, and every place
    where the clock was set back. Raises StoreError."""
    kept = store.end_is_kept or exported is not None  # asked first: a check seals the events it saw
    problem = store.check(exported)
    if problem is not None:
        return False, [f"store: {store.where}: broken", str(problem)]
    head = store.head()
    against = f", and holds the exported event {exported.seq}" if exported else ""
    unkept = [] if kept else [f"warning: {END_NOT_KEPT}"]
    set_back = [
        f"warning: {name} was stored {seconds / 60:.0f} min before the event that it follows: the clock was set back"
        for name, seconds in store.clock_set_back()
    ]
    unseen = [] if exported else [NOT_SEEN]
    return True, [f"store: {head.seq} events, head {head.hash}: unbroken{against}", *unseen, *unkept, *set_back]
