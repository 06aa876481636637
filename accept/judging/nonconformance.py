"""Nonconformances of the part, which hold the unit: it is conditional at best until quality assurance has decided.

A technician notes one in the workflow (an event of the store, and a line of `unit.toml`). In the folder or attempt in
which it was noted the unit stays held: the disposition that quality assurance signs stands on that certificate. A later
attempt is held too until a disposition to use the unit as it is, to rework it or to measure again was signed; one to
return or to scrap it releases nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from accept.judging.decisions import DecisionError, Signer, problem_here, sign_decision
from accept.store import Store
from accept.store.payloads import (
    CertificateSigned,
    Decision,
    EntryUndone,
    NonconformanceDecided,
    SignedBy,
    StepNoted,
    UnitJudged,
    payload_of,
)

DISPOSITION = "disposition"  # the kind of decision that is signed
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
    kinds = (StepNoted, EntryUndone, UnitJudged, CertificateSigned, NonconformanceDecided)
    events = [(e, payload_of(e, *kinds)) for e in store.events(serial)]
    undone = {payload.undoes for _, payload in events if isinstance(payload, EntryUndone)}
    notes_of = {
        event.seq: f"{payload.step}: {payload.text} ({event.who})"
        for event, payload in events
        if isinstance(payload, StepNoted) and payload.nonconformance
    }
    taken_back = {words for seq, words in notes_of.items() if seq in undone}
    noted: dict[str, bool] = {}  # words -> whether it was released since
    signed: list[SignedBy | None] = []
    for event, payload in events:
        if event.seq in notes_of and event.seq not in undone:
            noted[notes_of[event.seq]] = False
        elif isinstance(payload, UnitJudged):  # what it states QA decides; some is of another bench's folder
            stated = payload.result.nonconformances
            noted = {words: False for words in stated if words not in taken_back} | noted
        elif isinstance(payload, CertificateSigned | NonconformanceDecided) and payload.disposition is not None:
            about = payload.nonconformances if isinstance(payload, NonconformanceDecided) else stated
            if _releases(serial, payload) and payload.disposition.signed not in signed:  # a signature counts once
                noted |= {words: True for words in about if words in noted}
            signed.append(payload.disposition.signed)
    return [*here, *(words for words, was_released in noted.items() if not was_released and words not in here)]


def content_of(
    serial: str, decision: Decision, certificate: str | None, nonconformances: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the data of a disposition that quality assurance signs. certificate: sha256 of the one that was
    countersigned with it."""
    about = {"certificate": certificate} if certificate is not None else {"nonconformances": list(nonconformances)}
    return {"serial": serial, "choice": decision.choice, "reason": decision.reason} | about


def decide(store: Store, serial: str, decision: Decision, signer: Signer) -> list[str]:
    """Store the disposition of a unit that nonconformances hold, signed by quality assurance, and return them. Raises
    DecisionError if nothing holds the unit, or for a key of another role, StoreError."""
    held = open_nonconformances(store, serial, {})
    if not held:
        raise DecisionError(f"{serial}: no nonconformance in the store holds it")
    signed = sign_decision(DISPOSITION, content_of(serial, decision, None, held), signer)
    store.write(NonconformanceDecided(tuple(held), replace(decision, signed=signed)), serial, who=signer.person)
    return held


def _releases(serial: str, given: CertificateSigned | NonconformanceDecided) -> bool:
    """Return whether a disposition lets the unit pass, and quality assurance signed it."""
    if given.disposition is None or given.disposition.choice not in RELEASING:
        return False
    if isinstance(given, CertificateSigned):
        content = content_of(serial, given.disposition, given.before)
    else:
        content = content_of(serial, given.disposition, None, given.nonconformances)
    return problem_here(DISPOSITION, content, given.disposition.signed) is None
