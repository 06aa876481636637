"""A nonconformance of the part holds the unit: it is conditional at best until quality assurance has decided.

A technician notes it in the workflow (an event of the store, and a line of `unit.toml`). In the folder or attempt in
which it was noted the unit stays held: the disposition that quality assurance signs stands on that certificate. A later
attempt is held too until a disposition to use the unit as it is, to rework it or to measure again was signed; one to
return or to scrap it releases nothing.
"""

from collections.abc import Mapping, Sequence

from accept.store import Store
from accept.store.indexes import JUDGED

MARK = "NONCONFORMANCE: "  # how its line in `unit.toml` begins
NOTED, UNDONE, SIGNED = "step_noted", "entry_undone", "certificate_signed"
RELEASING = ("use-as-is", "rework", "measure-again")  # of the dispositions


def in_notes(notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the nonconformances among the notes of a unit folder, each with its step."""
    return [
        f"{step}: {line.removeprefix(MARK)}" for step, lines in notes.items() for line in lines if line.startswith(MARK)
    ]


def open_nonconformances(store: Store, serial: str, notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the nonconformances that hold a unit. notes: those of its folder. Raises StoreError."""
    here = in_notes(notes)
    last = store.latest(serial, JUDGED)
    stated: Sequence[str] = () if last is None else last.data["result"].get("nonconformances", ())
    if not stated and next(store.events(serial, NOTED), None) is None:  # as for most units
        return here
    events = list(store.events(serial))
    undone = {event.data["undoes"] for event in events if event.what == UNDONE}
    notes_of = {
        event.seq: f"{event.data['step']}: {event.data['text']} ({event.who})"
        for event in events
        if event.what == NOTED and event.data["nonconformance"]
    }
    taken_back = {words for seq, words in notes_of.items() if seq in undone}
    noted: dict[str, bool] = {}  # words -> whether it was released since
    for event in events:
        data = event.data
        if event.seq in notes_of and event.seq not in undone:
            noted[notes_of[event.seq]] = False
        elif event.what == JUDGED:  # about what it states quality assurance decides; some is of another bench's folder
            stated = data["result"].get("nonconformances", ())
            noted = {words: False for words in stated if words not in taken_back} | noted
        elif event.what == SIGNED and (data.get("disposition") or {}).get("choice") in RELEASING:
            noted |= {words: True for words in stated if words in noted}
    return [*here, *(words for words, released in noted.items() if not released and words not in here)]
