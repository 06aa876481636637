"""Nonconformances of the part, which hold the unit: it is conditional at best until quality assurance has decided.

A technician notes one in the workflow (an event of the store, and a line of `unit.toml`). In the folder or attempt in
which it was noted the unit stays held: the disposition that quality assurance signs stands on that certificate. A later
attempt is held too until a disposition to use the unit as it is, to rework it or to measure again was signed; one to
return or to scrap it releases nothing.
"""

from collections.abc import Mapping, Sequence

from accept.store import Store
from accept.store.payloads import CertificateSigned, EntryUndone, StepNoted, UnitJudged, payload_of

MARK = "NONCONFORMANCE: "  # how its line in `unit.toml` begins
RELEASING = ("use-as-is", "rework", "measure-again")  # of the dispositions


def in_notes(notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the nonconformances among the notes of a unit folder, each with its step."""
    return [
        f"{step}: {line.removeprefix(MARK)}" for step, lines in notes.items() for line in lines if line.startswith(MARK)
    ]


def open_nonconformances(store: Store, serial: str, notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the nonconformances that hold a unit. notes: those of its folder. Raises StoreError."""
    here = in_notes(notes)
    last = store.latest(serial, UnitJudged.KIND)
    stated: Sequence[str] = () if last is None else UnitJudged.of(last).result.nonconformances
    if not stated and next(store.events(serial, StepNoted.KIND), None) is None:  # as for most units
        return here
    events = [(e, payload_of(e, StepNoted, EntryUndone, UnitJudged, CertificateSigned)) for e in store.events(serial)]
    undone = {payload.undoes for _, payload in events if isinstance(payload, EntryUndone)}
    notes_of = {
        event.seq: f"{payload.step}: {payload.text} ({event.who})"
        for event, payload in events
        if isinstance(payload, StepNoted) and payload.nonconformance
    }
    taken_back = {words for seq, words in notes_of.items() if seq in undone}
    noted: dict[str, bool] = {}  # words -> whether it was released since
    for event, payload in events:
        if event.seq in notes_of and event.seq not in undone:
            noted[notes_of[event.seq]] = False
        elif isinstance(payload, UnitJudged):  # what it states QA decides; some is of another bench's folder
            stated = payload.result.nonconformances
            noted = {words: False for words in stated if words not in taken_back} | noted
        elif isinstance(payload, CertificateSigned) and (decision := payload.disposition) is not None:
            released = decision.choice in RELEASING
            noted |= {words: True for words in stated if released and words in noted}
    return [*here, *(words for words, was_released in noted.items() if not was_released and words not in here)]
