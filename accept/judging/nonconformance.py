"""Nonconformances of the part, which hold the unit: it is conditional at best until quality assurance has decided.

A technician notes one in the workflow (an event of the store, and a line of `unit.toml`). In the folder or attempt in
which it was noted the unit stays held: the disposition that quality assurance signs stands on that certificate. A later
attempt is held too until a disposition to use the unit as it is, to rework it or to measure again was signed; one to
return or to scrap it releases nothing.

An attempt that quality assurance declared void does not become good by being judged once more: one with the same values
is held in the same way.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from accept.base.documents.results import Information, UnitEntry
from accept.judging.decisions import DecisionError, Signer, problem_here, sign_decision
from accept.judging.voids import Void, voids
from accept.store import Store
from accept.store.payloads import (
    AttemptVoided,
    CertificateSigned,
    Decision,
    NonconformanceDecided,
    StepNoted,
    UnitJudged,
    payload_of,
)
from checks.verdict import Finding

DISPOSITION = "disposition"  # the kind of decision that is signed
MARK = "NONCONFORMANCE: "  # how its line in `unit.toml` begins
RELEASING = ("use-as-is", "rework", "measure-again")  # of the dispositions
SAME = 1e-9  # relative: the same data judged twice, on whatever processor; two readings do not agree by so much
Values = Mapping[str, float]  # by quantity


def in_notes(notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the nonconformances among the notes of a unit folder, each with its step."""
    return [
        f"{step}: {line.removeprefix(MARK)}" for step, lines in notes.items() for line in lines if line.startswith(MARK)
    ]


def measured_values(entry: UnitEntry) -> dict[str, float]:
    """Return the value of each quantity of a result that has one."""
    rows: list[Information | Finding] = [*entry.information, *entry.findings]
    return {row.quantity: row.value for row in rows if row.value is not None}


def open_nonconformances(
    store: Store, serial: str, notes: Mapping[str, Sequence[str]], values: Values | None = None
) -> list[str]:
    """Return the nonconformances that hold a unit. notes: those of its folder. values: of the judgement that is asked
    about; None: a void attempt holds the unit only if its last judgement states so. Raises StoreError."""
    here = in_notes(notes)
    last = store.latest(serial, UnitJudged.KIND)
    stated: Sequence[str] = () if last is None else UnitJudged.of(last).result.nonconformances
    void = voids(store, serial)
    if not stated and not void and next(store.events(serial, StepNoted.KIND), None) is None:  # as for most units
        return here
    kinds = (StepNoted, UnitJudged, CertificateSigned, NonconformanceDecided, AttemptVoided)
    events = [(e, payload_of(e, *kinds)) for e in store.events(serial)]
    judged = {event.seq: payload for event, payload in events if isinstance(payload, UnitJudged)}
    of_void = {
        _words_of(each): (each.judged in judged and _are_same(values, measured_values(judged[each.judged].result)))
        for each in void.values()
    }
    if values is None:
        of_void = {words: words in stated for words in of_void}
    notes_of = {
        event.seq: f"{payload.step}: {payload.line(event.who)}"
        for event, payload in events
        if isinstance(payload, StepNoted) and payload.nonconformance
    }
    noted: dict[str, bool] = {}  # words -> whether it was released since
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
                noted |= {words: True for words in about if words in noted}
            counted.add(decision)
    return [
        *here,
        *(w for w, released in noted.items() if not released and w not in here and of_void.get(w, True)),
    ]


def _signed_text(serial: str, given: CertificateSigned | NonconformanceDecided, decision: Decision) -> str:
    """Return what a disposition is about, and who signed it when."""
    by = (decision.signed.person, decision.signed.time) if decision.signed is not None else ()
    return repr((_content_of(serial, given, decision), by))


def _words_of(void: Void) -> str:
    return f"attempt {void.attempt}, with the same values, was declared void: {void.words}"


def _are_same(values: Values | None, void: Values) -> bool:
    """Return whether all quantities that both judgements have are equal: the same data, by whatever spec."""
    common = (values or {}).keys() & void.keys()
    return bool(common) and all(math.isclose((values or {})[q], void[q], rel_tol=SAME) for q in common)


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
    content = _content_of(serial, given, given.disposition)
    return problem_here(DISPOSITION, content, given.disposition.signed) is None


def _content_of(serial: str, given: CertificateSigned | NonconformanceDecided, decision: Decision) -> dict[str, Any]:
    if isinstance(given, CertificateSigned):
        return content_of(serial, decision, given.before)
    return content_of(serial, decision, None, given.nonconformances)
