"""Golden units: known good and known bad units that show, at the start of a shift, that the bench measures as before.

The values and uncertainties of a golden unit are fixed when it is named; only naming it again, with a reason, changes
them. Quality assurance signs every change but the first naming in a store: else a bench that has drifted gets its
drifted values as a reference. A bench whose golden units miss them judges nothing else until quality assurance has
signed why. All of it is events of the store; several benches may share one, and each is stopped for itself.
"""

import datetime
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from accept.base.documents.listings import GoldenCompared
from accept.base.documents.results import TYPED, Information
from accept.fleet.errors import FleetError
from accept.judging.reservations import same_recording
from accept.store import Event, Store
from accept.store.decisions import Opens, Signer, problem_here, sign_decision
from accept.store.payloads import (
    BenchStated,
    GoldenMet,
    GoldenMissed,
    GoldenNamed,
    GoldenResolved,
    GoldenRetired,
    Reference,
    UnitJudged,
)
from checks.verdict import Finding
from specs.errors import AcceptError

EXPECTED = ("accepted", "rejected")


class GoldenError(AcceptError, ValueError):
    """A unit that cannot be golden, or nothing to resolve; the text says why."""


class BenchStopped(GoldenError):
    """The golden units were missed: nothing is judged until this is resolved."""


@dataclass(frozen=True)
class Golden:
    """A golden unit. named: the event that fixed its reference; since: number of the one that made it golden."""

    serial: str
    expected: str
    reference: Mapping[str, Reference]
    named: Event
    since: int


def needs_signature(store: Store) -> bool:
    """Return whether quality assurance signs the next naming: any but the first one in this store."""
    return bool(_changes(store))


def name_golden(
    store: Store, serial: str, expected: str, who: str, reason: str = "", last: int = 1, signer: Signer | None = None
) -> None:
    """Make a judged unit a golden one, with the mean of its last judgements as its reference.

    reason: why the reference of a golden unit is changed; signer: of quality assurance, if `needs_signature`. Raises
    GoldenError if it was not judged as expected or lacks a signature, DecisionError for another role's key."""
    if expected not in EXPECTED:
        raise GoldenError(f"'{expected}' is not a verdict of a golden unit; write {' or '.join(EXPECTED)}")
    judged = [UnitJudged.of(event) for event in store.events(serial, UnitJudged.KIND)][-last:]
    if not judged:
        raise GoldenError(f"{serial} was never judged: judge it first, on a bench that is known to be right")
    if len(judged) < last:
        raise GoldenError(f"{serial} was judged {len(judged)} times, not {last}")
    for each in judged:
        if each.result.verdict != expected:
            raise GoldenError(f"{serial} was last {each.result.verdict}, not {expected}")
    if serial in goldens(store) and not reason.strip():
        raise GoldenError(f"{serial} is a golden unit: say why its reference is changed: --reason")
    if signer is None and needs_signature(store):
        raise GoldenError("quality assurance signs every naming of a golden unit but the first one")
    said = GoldenNamed(
        expected, reference_of(judged), " ".join(reason.split()), signed_changes=True, after=_last(store, serial)
    )
    if signer is not None:
        said = replace(said, signed=sign_decision(GoldenNamed.KIND, _change(serial, said), signer))
    store.write(said, serial, who=who if signer is None else signer.person)


def reference_of(judged: "list[UnitJudged]") -> dict[str, Reference]:
    """Return the reference from the judgements of one unit: of each quantity the mean, and the largest U, which
    includes their common part."""
    found: dict[str, Reference] = {}
    for name, first in values_of(judged[-1]).items():
        rows = [values_of(each).get(name) for each in judged]
        known = [row for row in rows if row is not None and row.value is not None]
        if first.value is None or len(known) < len(judged):
            continue
        uncertain = [row.U for row in known if row.U is not None]
        U = max(uncertain) if len(uncertain) == len(known) else None
        mean = math.fsum(row.value for row in known if row.value is not None) / len(known)
        found[name] = Reference(mean, U, first.unit, len(known))
    return found


def values_of(judged: UnitJudged) -> dict[str, Information | Finding]:
    """Return the rows of a judgement, findings and information, by quantity."""
    return {row.quantity: row for row in judged.result.rows}


def retire(store: Store, serial: str, reason: str, opens: Opens) -> None:
    """Make a golden unit an ordinary one, by a decision that quality assurance signs. Raises GoldenError without a
    reason, or if the unit is not golden, DecisionError for a key of another role."""
    if serial not in goldens(store):
        raise GoldenError(f"{serial} is not a golden unit")
    if not reason.strip():
        raise GoldenError("say why it is retired: --reason")
    said, signer = GoldenRetired(" ".join(reason.split()), _last(store, serial)), opens()
    signed = sign_decision(GoldenRetired.KIND, _change(serial, said), signer)
    store.write(replace(said, signed=signed), serial, who=signer.person)


def goldens(store: Store, until: float = math.inf) -> dict[str, Golden]:
    """Return every golden unit by serial, before an event. If an earlier program named it, its reference is the values
    of its last judgement before that. A change without a valid signature counts only if an earlier program made it."""
    found: dict[str, Golden] = {}
    for event in (each for each in _counted(store) if each.seq < until):
        if event.what == GoldenRetired.KIND:
            found.pop(event.subject, None)
            continue
        named = GoldenNamed.of(event)
        reference = named.reference
        if not reference:
            before = [e for e in store.events(event.subject, UnitJudged.KIND) if e.seq < event.seq]
            reference = reference_of([UnitJudged.of(before[-1])]) if before else {}
        since = found[event.subject].since if event.subject in found else event.seq
        found[event.subject] = Golden(event.subject, named.expect, reference, event, since)
    return found


def not_counted(judgements: int, serials: Iterable[str]) -> str:
    """Return the words for judgements that no question about the process counts, "" for none."""
    named = ", ".join(sorted(set(serials)))
    return f"{judgements} judgements of golden units are not counted: {named}" if judgements else ""


def resolve(store: Store, reason: str, opens: Opens) -> None:
    """Let this bench judge again, by a decision that quality assurance signs. Raises GoldenError without a reason, or
    if nothing is to be resolved, DecisionError for a key of another role."""
    if not reason.strip():
        raise GoldenError("say what was wrong with the bench and what was done: --reason")
    stop = stopped_by(store)
    if stop is None:
        raise GoldenError("nothing to resolve: this bench is not stopped")
    said, signer = GoldenResolved(" ".join(reason.split()), store.bench, stop.seq), opens()
    signed = sign_decision(GoldenResolved.KIND, _content(said), signer)
    store.write(GoldenResolved(said.reason, said.bench, said.missed, signed), who=signer.person)


def last_resolved(store: Store, bench: str = "", until: float = math.inf) -> int:
    """Return the number of the last event that lifted a stop of a bench, by default of this one, 0 without one. until:
    events of this number and later ones do not count."""
    bench = bench or store.bench
    stops = [e.seq for e in store.events(what=GoldenMissed.KIND) if GoldenMissed.of(e).bench in ("", bench)]
    lifted = 0
    for event in store.events(what=GoldenResolved.KIND):
        said = GoldenResolved.of(event)
        present = max((seq for seq in stops if seq < event.seq), default=0)
        for_this = said.missed == present and said.bench in ("", bench)  # and not for a stop before
        if for_this and event.seq < until and problem_here(GoldenResolved.KIND, _content(said), said.signed) is None:
            lifted = event.seq
    return lifted


def stopped_by(store: Store) -> Event | None:
    """Return the event that stopped this bench and was not resolved since; None otherwise. Only a signed decision lifts
    a stop, not a later check that passes."""
    stops = _stops(store)
    return stops[-1] if stops else None


def _stops(store: Store, bench: str = "", until: float = math.inf) -> list[Event]:
    """Return the misses of a bench since it was last let go on, in order."""
    later = store.events(what=GoldenMissed.KIND, after=last_resolved(store, bench, until))
    return [e for e in later if e.seq < until and GoldenMissed.of(e).bench in ("", bench or store.bench)]


def missed(store: Store) -> Mapping[str, list[str]] | None:
    """Return the deviations that stopped this bench, by golden unit; None if it is not stopped."""
    stop = stopped_by(store)
    if stop is None:
        return None
    return {serial: list(problems) for serial, problems in GoldenMissed.of(stop).reasons.items()}


def check_may_judge(store: Store, serial: str, bench: str = "", until: float = math.inf) -> None:
    """Raise BenchStopped if a bench, by default this one, missed its golden units before an event; they are judged."""
    stops = _stops(store, bench, until)
    known = goldens(store, until).get(serial) if stops else None
    if not stops or (known is not None and known.since < stops[0].seq):
        return  # named while the bench was trusted, not to get past the stop
    problems = GoldenMissed.of(stops[-1]).reasons
    words = "; ".join(f"{golden}: {', '.join(differences)}" for golden, differences in problems.items())
    lifted = store.events(what=GoldenResolved.KIND, after=stops[-1].seq)
    unsigned = any(GoldenResolved.of(event).signed is None for event in lifted)
    why = "; an earlier version stored that this was resolved, without a signature" if unsigned else ""
    raise BenchStopped(
        f"{serial}: not judged, because the bench missed its golden units ({words}){why}; "
        "find out why, then quality assurance signs: accept golden resolve --reason '...'"
    )


def _changes(store: Store) -> list[Event]:
    """Return every naming and retiring, in order, whether it counts or not."""
    events = [*store.events(what=GoldenNamed.KIND), *store.events(what=GoldenRetired.KIND)]
    return sorted(events, key=lambda e: e.seq)


def _last(store: Store, serial: str) -> int:
    """Return the number of the last naming or retiring of a unit, 0 without one."""
    return max((event.seq for event in _changes(store) if event.subject == serial), default=0)


def _counted(store: Store) -> list[Event]:
    """Return the changes that count: the first naming, those that earlier programs stored, and those signed for the
    state that they changed, so that a signature of before does not count once more."""
    changes = _changes(store)
    marks = [*store.events(what=GoldenMet.KIND), *store.events(what=GoldenMissed.KIND), *changes]
    marks = [e for e in marks if e.data.get("signed_changes") or e.data.get("signed")]
    this_program = next(store.events(what=BenchStated.KIND), None)  # earlier ones store no such event
    since = min((e.seq for e in (*marks, *([this_program] if this_program else []))), default=math.inf)
    counted, last = [], dict[str, int]()
    for event in changes:
        said = GoldenNamed.of(event) if event.what == GoldenNamed.KIND else GoldenRetired.of(event)
        if said.signed is None:
            counts = event.seq < since or event is changes[0]
        else:
            signed_now = said.after == last.get(event.subject, 0)
            counts = signed_now and problem_here(event.what, _change(event.subject, said), said.signed) is None
        if counts:
            counted.append(event)
        last[event.subject] = event.seq
    return counted


def _change(serial: str, said: GoldenNamed | GoldenRetired) -> dict[str, Any]:
    return {"serial": serial, **replace(said, signed=None).to_json()}


def _content(said: GoldenResolved) -> dict[str, Any]:
    return {"bench": said.bench, "missed": said.missed, "reason": said.reason}


def check(store: Store, since: datetime.datetime, who: str) -> list[GoldenCompared]:
    """Compare every golden unit's judgements by this bench since `since` (UTC) with its reference, and store the
    outcome. Every judgement counts, so that a further try does not hide a miss; after a decision only those that follow
    it. One of recordings or readings from before that is no measurement.

    Raises FleetError if no unit is golden."""
    named = goldens(store)
    if not named:
        raise FleetError("no golden unit is named: accept golden name SERIAL --expect accepted")
    after, bench = last_resolved(store), store.bench
    found = []
    for golden in named.values():
        judged, before = _recent(store, golden.serial, since, after, bench)
        new = any(not _is_of(each, before) for each in judged)
        found.append(replace(_check_golden(golden, judged), measured=new))
    missed = {c.serial: c.problems for c in found if c.problems}
    if missed:
        store.write(GoldenMissed(tuple(sorted(missed)), missed, bench, signed_changes=True), who=who)
    elif all(c.measured for c in found):
        store.write(GoldenMet(tuple(sorted(named)), bench, signed_changes=True), who=who)
    return found


def _recent(
    store: Store, serial: str, since: datetime.datetime, after: int, bench: str
) -> tuple[list[UnitJudged], list[UnitJudged]]:
    """Return the judgements of a unit by this bench since a time and after an event, and all before these. Those of a
    program that did not store the bench count for every bench."""
    judged, before = list[UnitJudged](), list[UnitJudged]()
    for event in store.events(serial, UnitJudged.KIND):
        each, is_recent = UnitJudged.of(event), datetime.datetime.fromisoformat(event.time) >= since
        (judged if is_recent and event.seq > after and each.bench in ("", bench) else before).append(each)
    return judged, before


def _is_of(judged: UnitJudged, before: Sequence[UnitJudged]) -> bool:
    """Return whether one of the recordings of a judgement, or without any all of its readings, are of earlier ones."""
    samples = judged.result.samples
    told = {name: own for name, own in samples.items() if not name.endswith(f"/{TYPED}")} or samples
    return any(
        same_recording(own, each.result.samples[name])
        for each in before
        for name, own in told.items()
        if name in each.result.samples
    )


def _check_golden(golden: Golden, judged: Sequence[UnitJudged]) -> GoldenCompared:
    problems: list[str] = []
    for each in judged:
        verdict, rows = each.result.verdict, values_of(each)
        wrong = [] if verdict == golden.expected else [f"{verdict}, expected {golden.expected}"]
        wrong += [words for name, r in golden.reference.items() if (words := _difference(name, r, rows.get(name)))]
        problems += [words for words in wrong if words not in problems]
    return GoldenCompared(golden.serial, golden.expected, bool(judged), tuple(problems))


def _difference(name: str, reference: Reference, row: Any) -> str | None:
    """Return what is wrong with a value, None if it is the reference within both uncertainties. A missing value is
    wrong; a quantity without reference has nothing to be compared with."""
    unit = reference.unit
    if row is None or row.value is None or not math.isfinite(row.value):
        return f"{name}: no value, {reference.value:.6g} {unit} is its reference"
    U = math.hypot(row.U or 0.0, reference.U or 0.0)
    if row.U is None and reference.U is None:
        return None  # neither is known: nothing to compare by
    distance = abs(row.value - reference.value)
    if distance <= U:
        return None
    return (
        f"{name}: {row.value:.6g} {unit}, {reference.value:.6g} {unit} is its reference; "
        f"they differ by {distance:.2g} {unit}, both uncertainties together allow {U:.2g} {unit}"
    )
