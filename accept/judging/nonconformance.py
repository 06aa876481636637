"""Nonconformances of the part, which hold the unit: it is conditional at best until quality assurance has decided.

A technician notes one in the workflow (an event of the store, and a line of `unit.toml`). In the folder or attempt in
which it was noted the unit stays held: the disposition that quality assurance signs stands on that certificate. A later
attempt is held too until a disposition to use the unit as it is, to rework it or to measure again was signed; one to
return or to scrap it releases nothing.

An attempt that quality assurance declared void does not become good by being judged once more: one with the same values
is held in the same way. So is what was measured before an attempt that was not accepted (`accept.judging.superseded`).
Only the disposition to use it as it is releases what was measured before.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from accept.base.documents.results import UnitEntry
from accept.judging.decisions import DecisionError, Signer, problem_here, sign_decision
from accept.judging.superseded import are_same, measured_values, superseded
from accept.judging.voids import Void, voids
from accept.store import Event, Store
from accept.store.payloads import (
    AttemptVoided,
    CertificateSigned,
    Decision,
    NonconformanceDecided,
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


def open_nonconformances(
    store: Store,
    serial: str,
    notes: Mapping[str, Sequence[str]],
    entry: UnitEntry | None = None,
    until: datetime | None = None,
    past: Sequence[Event] | None = None,
) -> tuple[list[str], dict[str, str]]:
    """Return the nonconformances that hold a unit, and check -> the one of them that holds only its findings. notes:
    those of its folder. entry: of the judgement that is asked about; None: what was measured before holds the unit only
    if its last judgement states so. until: later judgements supersede nothing. past: the unit's events, if they
    were read before. Raises StoreError."""
    here = in_notes(notes)
    events_of = store.events if past is None else lambda _, what: iter([e for e in past if e.what == what])
    judgements = [(e, UnitJudged.of(e)) for e in events_of(serial, UnitJudged.KIND)]
    stated: Sequence[str] = judgements[-1][1].result.nonconformances if judgements else ()
    void = voids(store, serial)
    known = [j for j in judgements if until is None or datetime.fromisoformat(j[0].time) <= until]
    older = superseded(known, void, entry) if entry is not None else {}
    noted_here = next(events_of(serial, StepNoted.KIND), None) is not None
    if not (stated or void or older or noted_here):  # as for most units
        return here, {}
    kinds = (StepNoted, UnitJudged, CertificateSigned, NonconformanceDecided, AttemptVoided)
    events = [(e, payload_of(e, *kinds)) for e in (store.events(serial) if past is None else past)]
    values = None if entry is None else measured_values(entry)
    before = {words: False for _, judged in judgements for words in judged.result.superseded.values()}
    before |= dict.fromkeys(older.values(), True)  # measured before -> whether it is what is asked about
    for one in void.values():
        same = [j for e, j in judgements if e.seq == one.judged]
        before[_words_of(one)] = bool(values and same) and are_same(values or {}, measured_values(same[0].result))
    if values is None:
        before = {words: words in stated for words in before}
    notes_of = {
        event.seq: f"{payload.step}: {payload.line(event.who)}"
        for event, payload in events
        if isinstance(payload, StepNoted) and payload.nonconformance
    }
    noted = dict.fromkeys(older.values(), False)  # words -> whether it was released since
    counted = set[str]()  # decisions by what was signed: a signature can be written in another way and hold still
    for event, payload in events:
        if event.seq in notes_of:
            noted[notes_of[event.seq]] = False
        elif isinstance(payload, AttemptVoided) and (each := void.get(payload.judged)) is not None:
            noted.setdefault(_words_of(each), False)
        elif isinstance(payload, UnitJudged):  # what it states QA decides; some is of another bench's folder
            stated = payload.result.nonconformances
            noted = dict.fromkeys(stated, False) | noted
        elif isinstance(payload, CertificateSigned | NonconformanceDecided) and payload.disposition is not None:
            about = payload.nonconformances if isinstance(payload, NonconformanceDecided) else stated
            decision = _signed_text(serial, payload, payload.disposition)
            if _releases(serial, payload) and decision not in counted:  # a signature counts once
                as_it_is = payload.disposition.choice == "use-as-is"
                noted |= {words: True for words in about if words in noted and (as_it_is or words not in before)}
            counted.add(decision)
    held = [w for w, released in noted.items() if not released and w not in here and before.get(w, True)]
    return [*here, *held], {check: words for check, words in older.items() if words in held}


def _signed_text(serial: str, given: CertificateSigned | NonconformanceDecided, decision: Decision) -> str:
    """Return what a disposition is about, and who signed it when."""
    by = (decision.signed.person, decision.signed.time) if decision.signed is not None else ()
    return repr((_content_of(serial, given, decision), by))


def _words_of(void: Void) -> str:
    return f"attempt {void.attempt}, with the same values, was declared void: {void.words}"


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
    held, _ = open_nonconformances(store, serial, {})
    if not held:
        raise DecisionError(f"{serial}: no nonconformance in the store holds it")
    signed = sign_decision(DISPOSITION, content_of(serial, decision, None, held), signer)
    store.write(NonconformanceDecided(tuple(held), replace(decision, signed=signed)), serial, who=signer.person)
    return held


def _releases(serial: str, given: CertificateSigned | NonconformanceDecided) -> bool:
    """Return whether a disposition lets the unit pass, and quality assurance signed it."""
    if given.disposition is None or given.disposition.choice not in RELEASING:
        return False
    content = _content_of(serial, given, given.disposition)
    return problem_here(DISPOSITION, content, given.disposition.signed) is None


def _content_of(serial: str, given: CertificateSigned | NonconformanceDecided, decision: Decision) -> dict[str, Any]:
    if isinstance(given, CertificateSigned):
        return content_of(serial, decision, given.before)
    return content_of(serial, decision, None, given.nonconformances)
