"""The chain of hashes: finds the first event that was altered, removed, inserted or moved.

It finds any change of any stored field, a missing event anywhere, an inserted or renumbered one. The end of the chain
has no event after it, so it is anchored three times: in the table `head`, in the file beside the database
(`store.head`), and in every copy of `Store.head()` that was written down. An intruder who rewrites every event from
some point on, and the table and the file too, is found only by comparison with a head that was kept elsewhere. Each
certificate carries the hash of its result, which is a second such record."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from accept.store.event import GENESIS, Event


@dataclass(frozen=True)
class StoreHead:
    """The last event: number and hash. A copy of it proves the content of the store up to that event."""

    seq: int
    hash: str

    def __str__(self) -> str:
        return f"{self.seq} {self.hash}"

    @classmethod
    def parse(cls, text: str) -> "StoreHead":
        """Return the head from `57 <hash>`, as `str` writes it. Raises ValueError for any other text."""
        seq, _, digest = text.strip().partition(" ")
        if not seq.isdecimal() or len(digest) != 64 or not set(digest) <= set("0123456789abcdef"):
            raise ValueError(
                f"{text.strip()[:80]!r} is not a head; expected the number of the event, a space and its SHA-256"
            )
        return cls(int(seq), digest)


START = StoreHead(0, GENESIS)


@dataclass(frozen=True)
class ChainBreak:
    """The first place where the chain is broken: the event's number, and the whole finding in words."""

    seq: int
    words: str

    def __str__(self) -> str:
        return self.words


def first_problem(events: Iterable[Event], head: StoreHead, anchors: Mapping[str, StoreHead]) -> ChainBreak | None:
    """Return the first break of the chain, None if it is unbroken.

    events : of the whole store, as read, by increasing number. head : the last event by the table `head`. anchors :
    holder -> head that was kept elsewhere; each was the last event once."""
    anchors = {"table head": head, **anchors}
    last, seen = START, {0: GENESIS}
    wanted = {anchor.seq for anchor in anchors.values()}
    for event in events:
        if problem := misfit(event, last):
            return problem
        last = StoreHead(event.seq, event.hash)
        if event.seq in wanted:
            seen[event.seq] = event.hash
    if problem := _end_problem(last, seen, anchors):
        return problem
    extra = head.seq + 1
    return (
        ChainBreak(extra, f"event {extra} was inserted: table head ends at {head.seq}") if last.seq > head.seq else None
    )


def misfit(event: Event, last: StoreHead) -> ChainBreak | None:
    """Return why this event cannot follow `last`, None if it can."""
    if event.seq > last.seq + 1:
        return ChainBreak(last.seq + 1, f"event {last.seq + 1} is missing: {event.name} follows event {last.seq}")
    if event.seq <= last.seq:
        return ChainBreak(event.seq, f"{event.name} was inserted: event {last.seq + 1} was due")
    if not event.intact:
        return ChainBreak(event.seq, f"{event.name} was altered: its content does not give its hash")
    if event.prev == last.hash:
        return None
    if last.seq == 0:
        return ChainBreak(
            event.seq, f"{event.name} was altered: it follows another event, but the store begins with it"
        )
    return ChainBreak(last.seq, f"event {last.seq} was altered with its hash: {event.name} follows another one")


def _end_problem(last: StoreHead, seen: Mapping[int, str], anchors: Mapping[str, StoreHead]) -> ChainBreak | None:
    cut = last.seq + 1
    for source, anchor in anchors.items():
        if anchor.seq > last.seq:
            return ChainBreak(cut, f"event {cut} is missing: {source} holds the hash of event {anchor.seq}")
    for source, anchor in anchors.items():
        if seen[anchor.seq] != anchor.hash:
            return ChainBreak(
                anchor.seq, f"event {anchor.seq} was altered, or one before it: {source} holds another hash"
            )
    return None
