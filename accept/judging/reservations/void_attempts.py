"""Attempts that quality assurance declared void: a wrong lead, a typing error, another unit on the bench.

A void judgement stays in the store and in the history. It counts in no yield, chart or set, no certificate of it is
valid, and it makes no earlier judgement valid again: the unit is judged once more.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from accept.store import Event, Store, StoreHead
from accept.store.decisions import Opens, problem_here, sign_decision
from accept.store.payloads import AttemptVoided, UnitJudged
from specs.errors import AcceptError


class VoidError(AcceptError, ValueError):
    """An attempt that cannot be declared void; the text says why."""


def void(store: Store, serial: str, attempt: int, reason: str, opens: Opens) -> str:
    """Declare an attempt void, by a decision that quality assurance signs, and return the verdict that it had.

    Raises VoidError without a reason, for an attempt that does not exist or is void already, DecisionError for a key of
    another role, StoreError."""
    if not reason.strip():
        raise VoidError("say why the attempt is void: --reason")
    judged = list(store.events(serial, UnitJudged.KIND))
    if not judged:
        raise VoidError(f"no judgement of a unit '{serial}' in the store; `accept list` shows all serials")
    if not 1 <= attempt <= len(judged):
        raise VoidError(f"{serial} was judged {len(judged)} times; attempt {attempt} does not exist")
    event = judged[attempt - 1]
    if event.seq in voids(store, serial):
        raise VoidError(f"attempt {attempt} of {serial} is void already")
    said, signer = AttemptVoided(attempt, event.seq, " ".join(reason.split()), event=event.hash), opens()
    signed = sign_decision(AttemptVoided.KIND, _content(serial, said), signer)
    store.write(replace(said, signed=signed), serial, who=signer.person)
    return str(UnitJudged.of(event).result.verdict)


def voids(store: Store, serial: str | None = None) -> dict[int, AttemptVoided]:
    """Return number of a judgement's event -> the decision that it is void, of one unit or of all. A decision without a
    valid signature of quality assurance does not count, nor one about an event of another store. Raises StoreError."""
    said = [AttemptVoided.of(event) for event in counted(store, store.events(serial, AttemptVoided.KIND))]
    return {each.judged: each for each in said}


def counted(store: Store, events: Iterable[Event]) -> Iterator[Event]:
    """Yield events of this store but for decisions on void attempts that do not count: a store takes any event, and
    `accept.store.fold` believes it. Raises StoreError."""
    for event in events:
        if event.what == AttemptVoided.KIND:
            said = AttemptVoided.of(event)
            own = not said.event or store.holds(StoreHead(said.judged, said.event))
            content = _content(event.subject, said)
            if not own or problem_here(AttemptVoided.KIND, content, said.signed, weakens=True) is not None:
                continue
        yield event


def _content(serial: str, said: AttemptVoided) -> dict[str, Any]:
    bound = {"event": said.event} if said.event else {}
    return {"serial": serial, "attempt": said.attempt, "judged": said.judged, "reason": said.reason, **bound}
