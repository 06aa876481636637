"""Nonconformances of the part, which hold the unit: it is conditional at best until quality assurance has decided.

A technician notes one in the workflow (an event of the store, and a line of `unit.toml`). The store keeps it, whatever
becomes of that line. Quality assurance signs what is to be done about it, and every later result of the unit states
that: to use the unit as it is (a concession) releases it; to rework it or to measure again does once it was measured
again; to return or to scrap it does not. A decision is about the nonconformances that it names: one that is noted
later holds the unit, and what is outside its limits stays so.

An attempt that quality assurance declared void does not become good by being judged once more: one with the same values
is held in the same way. So is what an earlier attempt holds against its evidence (`superseded`).
Only the disposition to use it as it is releases what was measured before.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from accept.base.documents.results import CONCESSION, UnitRecord
from accept.judging.reservations.superseded import Approval, are_same, measured_values, shares_recording, superseded
from accept.judging.reservations.void_attempts import voids
from accept.store import Event, Store
from accept.store.decisions import (
    DISPOSITION,
    DecisionError,
    Opens,
    Signer,
    in_notes,
    problem_here,
    sign_decision,
    signed_content,
)
from accept.store.payloads import (
    AttemptStarted,
    AttemptVoided,
    CertificateSigned,
    Disposition,
    NonconformanceDecided,
    StepNoted,
    UnitJudged,
    payload_of,
)
from checks.cause import Cause
from checks.verdict import Finding, UnitVerdict, Verdict

RELEASING = (CONCESSION, "rework", "measure-again")  # of the dispositions


@dataclass(frozen=True)
class Standing:
    """Nonconformances and decisions of a unit at one time. open: nonconformances that hold a unit. decided: what
    quality assurance decided about its nonconformances, with a valid signature, in order; released: those by which one
    of them holds it no more. superseded: check -> the open one of what earlier attempts hold against its evidence."""

    open: tuple[str, ...]
    decided: tuple[NonconformanceDecided, ...] = ()
    released: tuple[NonconformanceDecided, ...] = ()
    superseded: Mapping[str, str] = field(default_factory=dict)


def open_nonconformances(store: Store, serial: str, notes: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the nonconformances that hold a unit, as `standing`."""
    return standing(store, serial, notes).open


def standing(
    store: Store,
    serial: str,
    notes: Mapping[str, Sequence[str]],
    entry: UnitRecord | None = None,
    until: int | None = None,
    past: Sequence[Event] | None = None,
    approval: Approval | None = None,
) -> Standing:
    """Return which nonconformances hold a unit and what was decided about them.

    notes: of `unit.toml`, by check. entry: the result in question; None: void attempts, earlier measurements and what
    is to be measured again hold the unit only if its last judgement states so. until: number of the last event whose
    judgement is compared with it. past: its events; None: read them. approval: of the spec. Raises StoreError."""
    read = [*store.events(serial)] if past is None else past
    judged = {event.seq: (event, UnitJudged.of(event)) for event in read if event.what == UnitJudged.KIND}
    results = [payload.result for _, payload in judged.values()]
    void = voids(store, serial)
    known = [j for j in judged.values() if until is None or j[0].seq <= until]
    older = superseded(known, void, entry, approval) if entry is not None else {}
    noted = any(event.what == StepNoted.KIND for event in read)
    if not (void or older or noted or any(r.nonconformances or r.dispositions for r in results)):  # as for most units
        return Standing(tuple(in_notes(notes)))
    kinds = (StepNoted, AttemptStarted, CertificateSigned, NonconformanceDecided, AttemptVoided)
    stated = results[-1].nonconformances if results else ()
    values = None if entry is None else measured_values(entry)
    before = {words: False for result in results for words in result.superseded.values()}
    before |= dict.fromkeys(older.values(), True)  # measured before -> whether this judgement shows it
    before |= {
        _words_of(each): each.judged in judged
        and are_same(values or {}, measured_values(judged[each.judged][1].result))
        for each in void.values()
    }
    if values is None:
        before = {words: words in stated for words in before}
    found = _Decisions(serial, [event.hash for event, _ in judged.values()])
    for words in older.values():
        found.hold(words)
    for event in read:
        payload = judged[event.seq][1] if event.seq in judged else payload_of(event, *kinds)
        if isinstance(payload, StepNoted) and payload.nonconformance:
            found.hold(f"{payload.step}: {payload.line(event.who)}", anew=True)
        elif isinstance(payload, AttemptVoided) and (each := void.get(payload.judged)) is not None:
            found.hold(_words_of(each))
        elif isinstance(payload, UnitJudged | AttemptStarted | CertificateSigned | NonconformanceDecided):
            found.follow(payload)
    holding = [w for w in dict.fromkeys([*in_notes(notes), *found.held]) if before.get(w, True)]
    by = {w: found.releasing(w, entry, stated, w in before) for w in holding}
    open_ones = tuple(w for w, decided in by.items() if decided is None)
    return Standing(
        open_ones,
        tuple(found.given),
        tuple(d for d in found.given if any(decided is d for decided in by.values())),
        {check: words for check, words in older.items() if words in open_ones},
    )


class _Decisions:
    """The decisions about the nonconformances of a unit, from its events in their order.

    held: words -> the last decision since they were noted, the judgement before it, None if the unit was not judged,
    and whether an attempt was begun since that does not state them. given: every decision that counts. judged: hashes
    of the unit's judgements."""

    def __init__(self, serial: str, judged: Collection[str]) -> None:
        self.serial, self.judged = serial, judged
        self.held: dict[str, tuple[NonconformanceDecided, UnitRecord | None, bool] | None] = {}
        self.given: list[NonconformanceDecided] = []
        self._seen = set[str]()  # decisions by what was signed: one can be written in another way and hold still
        self._last: UnitRecord | None = None
        self._stated: tuple[str, ...] = ()
        self._certified: dict[str, tuple[str, ...]] = {}  # sha256 of a certificate -> what its judgement states

    def hold(self, words: str, anew: bool = False) -> None:
        """Note a nonconformance. anew: what was decided about the same words before is not about this one."""
        if anew or words not in self.held:
            self.held[words] = None

    def follow(self, payload: UnitJudged | AttemptStarted | CertificateSigned | NonconformanceDecided) -> None:
        match payload:
            case UnitJudged(result=result):  # what it states QA decides; some is of another bench's folder
                self._last, self._stated = result, result.nonconformances
                for words in self._stated:
                    self.hold(words)
                    self.held[words] = (known := self.held[words]) and (*known[:2], False)
            case AttemptStarted():
                self.held = {words: known and (*known[:2], True) for words, known in self.held.items()}
            case CertificateSigned(disposition=None):
                self._certified.setdefault(payload.sha256, self._stated)  # a file that is named again has not changed
            case CertificateSigned(disposition=Disposition() as decision):
                about = self._certified.get(payload.before or "", ())
                if any((known := self.held.get(w)) is None or not _same(known[0].disposition, decision) for w in about):
                    self._decide(NonconformanceDecided(about, decision, payload.before))
            case NonconformanceDecided(certificate=None):  # with one, its names are not signed
                self._decide(payload)

    def _decide(self, given: NonconformanceDecided) -> None:
        """Count a decision once, if quality assurance signed it for this store."""
        signed, content = given.disposition.signed, signed_content(self.serial, given)
        what = repr((content, signed and (signed.person, signed.time)))
        own = given.judged in ("", *self.judged)
        if own and what not in self._seen and problem_here(DISPOSITION, content, signed) is None:
            self.given.append(given)
            self.held |= {words: (given, self._last, False) for words in given.nonconformances if words in self.held}
            self._seen.add(what)

    def releasing(
        self, words: str, entry: UnitRecord | None, stated: Sequence[str], before_it: bool
    ) -> NonconformanceDecided | None:
        """Return the last decision about a nonconformance if it releases a unit with this result: to use it as it is
        does, to rework it or to measure it again only once it was measured again, and not by a recording of before.
        before_it: what it is about was measured before, which only the first one releases."""
        decided, last, begun = self.held.get(words) or (None, None, False)
        if decided is None or decided.disposition.choice not in RELEASING:
            return None
        if decided.disposition.choice == CONCESSION:
            return decided
        if before_it or (last is None and not begun):
            return None
        if entry is None:
            return decided if begun or words not in stated else None
        if last is not None and shares_recording(entry, last, words.partition(":")[0]):
            return None
        is_as_before = last is not None and are_same(measured_values(entry), measured_values(last))
        return decided if begun or not is_as_before else None


def concessions(store: Store, serial: str | None = None) -> dict[int, str]:
    """Return number of a judgement's event -> the concession by which its unit passes, of one unit or of all: it was
    accepted with it, or it is the last one and nothing else speaks against it. Raises StoreError."""
    found = {}
    for unit in dict.fromkeys(event.subject for event in store.events(serial, NonconformanceDecided.KIND)):
        judged = [(event.seq, UnitJudged.of(event).result) for event in store.events(unit, UnitJudged.KIND)]
        if not judged:
            continue
        for seq, entry in judged:
            if entry.verdict == UnitVerdict.ACCEPTED:
                found[seq] = _conceded([NonconformanceDecided.from_json(d) for d in entry.dispositions])
        seq, entry = judged[-1]
        if not entry.nonconformances or entry.verdict != UnitVerdict.CONDITIONAL:
            continue
        now = standing(store, unit, {}, entry)
        if not now.open and all(not f.required or f.verdict is Verdict.PASS or is_only_held(f) for f in entry.findings):
            found[seq] = _conceded(now.released)
    return {seq: words for seq, words in found.items() if words}


def _conceded(decided: Sequence[NonconformanceDecided]) -> str:
    return "; ".join(
        f"{', '.join(d.nonconformances)}: {d.disposition.reason} ({d.disposition.signed.person}, "
        f"{d.disposition.signed.time[:10]})"
        for d in decided
        if d.disposition.choice == CONCESSION and d.disposition.signed is not None
    )


def is_only_held(finding: Finding) -> bool:
    """Return whether a finding would pass without the nonconformance that holds the unit: earlier programs made every
    finding of such a unit conditional."""
    return (
        finding.verdict is Verdict.CONDITIONAL
        and finding.cause is not None
        and {one.cause for one in finding.cause.all()} == {Cause.NONCONFORMANCE}
    )


def _same(one: Disposition, other: Disposition) -> bool:
    """Return whether two decisions are one, signed about a certificate and about what it states."""
    persons = [d.signed and d.signed.person for d in (one, other)]
    return (one.choice, one.reason, persons[0]) == (other.choice, other.reason, persons[1])


def _words_of(void: AttemptVoided) -> str:
    return f"attempt {void.attempt}, with the same values, was declared void: {void.words}"


def decide(
    store: Store, serial: str, decision: Disposition, opens: Opens, shown: Sequence[str] | None = None
) -> Sequence[str]:
    """Store a signed decision of quality assurance about all nonconformances that hold a unit, and return these. shown:
    those that the person saw, None for all. Raises DecisionError without one, with another one, or for a key of another
    role, StoreError."""
    if not open_nonconformances(store, serial, {}):
        raise DecisionError(f"{serial}: no nonconformance in the store holds it")
    signer, held = opens(), open_nonconformances(store, serial, {})
    if new := [words for words in held if shown is not None and words not in shown]:
        raise DecisionError(f"{serial}: nothing was decided, because another nonconformance holds it now: {new[0]}")
    store.write(decided(store, serial, decision, signer, held), serial, who=signer.person)
    return held


def decided(
    store: Store, serial: str, decision: Disposition, signer: Signer, about: Sequence[str]
) -> NonconformanceDecided:
    """Return a decision about nonconformances as quality assurance signs it, for this store. Raises DecisionError for a
    key of another role, StoreError."""
    last = store.latest(serial, UnitJudged.KIND)
    given = NonconformanceDecided(tuple(about), decision, judged="" if last is None else last.hash)
    signed = sign_decision(DISPOSITION, signed_content(serial, given), signer)
    return replace(given, disposition=replace(decision, signed=signed))
