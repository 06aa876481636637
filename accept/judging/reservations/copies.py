"""One recording measures one thing: found under two serials, sections or attempts, it counts for none of them.

The samples do not show where they belong, so all copies are without a result until quality assurance decides, with a
reason (`accept store resolve`). The decision is an event, `copies_resolved`; the copies themselves follow from the
samples that the store holds of every judgement. The same folder judged again, or moved, is the same evidence and no
copy, but for what went over to another section; what it may replace says `superseded`. A set of typed readings that
equals that of another serial is a copy too (`accept.judging.samples`); for one serial they may be typed again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import PurePath
from typing import Any

from accept.judging.advice import concluded
from accept.judging.rules import withhold_copies
from accept.judging.samples import is_typed
from accept.store import TABLE, Event, Store
from accept.store.decisions import Opens, problem_here, recording_party, sign_decision
from accept.store.payloads import CopiesResolved, UnitJudged
from accept.units import attempt_number
from checks.signals import Sketch
from specs.errors import AcceptError

Channels = Mapping[str, str]
Samples = Mapping[str, Channels]
Copy = dict[str, Any]
"""sample: `section/input`; with: its copies, each serial and sample; withheld: whether it does not count;
resolved: the decision: by whom, when, why, and the unit that was measured (`measured`), None without one."""


class CopiesError(AcceptError, ValueError):
    """Copies that cannot be resolved; the text says why."""


def copies_of(store: Store, serial: str, folder: str | None, samples: Samples) -> list[Copy]:
    """Return which of a unit's samples exist elsewhere too: in the unit itself, or in any judgement of the store.
    folder: where the unit was judged; if None, judgements of its own serial are left out. Raises StoreError."""
    own: dict[str, dict[tuple[str, str], Channels]] = {name: {} for name in samples}
    for one, other in same_recordings(samples, samples):
        if one != other:
            own[one][serial, other] = samples[other]
    typed = {name: channels for name, channels in samples.items() if is_typed(name)}
    for event in (*store.judgements_with(_recordings(samples)), *store.judgements_with(typed, but=serial)):
        for name, other, theirs in _shared(event, serial, folder, samples):
            own[name][event.subject, other] = theirs
    said = list(store.events(what=CopiesResolved.KIND)) if any(own.values()) else []
    return [_copy(serial, name, samples[name], found, said) for name, found in sorted(own.items()) if found]


def same_recording(one: Channels, other: Channels) -> bool:
    """Return whether two records share a channel, under any name."""
    return bool(same_recordings({"": one}, {"": other}))


def same_recordings(ours: Samples, theirs: Samples) -> list[tuple[str, str]]:
    """Return the names, here and there, of all pairs of records that share a channel, under any name."""
    one, two = ({name: channels[TABLE] for name, channels in s.items() if TABLE in channels} for s in (ours, theirs))
    found = {(a, b) for a in one for b in two if one[a] == two[b]}
    here, there = ([(n, text) for n in s for text in s[n].values() if TABLE not in s[n]] for s in (ours, theirs))
    known, other = (_sketches(tuple(text for _, text in texts)) for texts in (here, there))
    found |= {(here[n][0], there[m][0]) for n, m in known.same(other)}
    return [(a, b) for a in ours for b in theirs if (a, b) in found]


# a batch, or a verification of many certificates, compares each with many
_sketches = lru_cache(maxsize=128)(Sketch.parse_all)
judgement_of = lru_cache(maxsize=128)(UnitJudged.of)


def _shared(event: Event, serial: str, folder: str | None, samples: Samples) -> list[tuple[str, str, Channels]]:
    """Return (own record, record of the event, its channels) of each pair that holds the same samples."""
    if event.what != UnitJudged.KIND or (event.subject == serial and folder is None):
        return []
    judged = judgement_of(event)
    theirs: Samples = judged.result.samples
    if event.subject == serial:  # what was typed of one unit stays true of it
        samples, theirs = _recordings(samples), _recordings(theirs)
    pairs = [(a, b, theirs[b]) for a, b in same_recordings(samples, theirs)]
    if event.subject == serial and _same_evidence(judged.path, str(folder), pairs, len(samples), len(theirs)):
        stayed = {a for a, b, _ in pairs if a == b}
        return [p for p in pairs if p[0] not in stayed and p[0].partition("/")[0] != p[1].partition("/")[0]]
    return pairs


def _recordings(samples: Samples) -> Samples:
    return {name: channels for name, channels in samples.items() if not is_typed(name)}


def _same_evidence(path: str, folder: str, pairs: Sequence[tuple[str, str, Channels]], ours: int, theirs: int) -> bool:
    """Return whether a unit's own earlier judgement was of the present evidence: the same folder, or one that was moved
    or extended. Two attempts of the workflow are always different evidence."""
    before, now = PurePath(path), PurePath(folder)
    if before == now:
        return True
    if None not in (attempt_number(before.name), attempt_number(now.name)):
        return False
    kept = {a for a, b, _ in pairs if a == b}
    return len(kept) in (ours, theirs)


def _copy(serial: str, name: str, own: Channels, found: Mapping[tuple[str, str], Channels], said: list[Event]) -> Copy:
    parties = {
        recording_party(serial, name, own),
        *(recording_party(who, sample, told) for (who, sample), told in found.items()),
    }
    read = ((event, CopiesResolved.of(event)) for event in reversed(said))
    decisions = ((e, d) for e, d in read if problem_here(CopiesResolved.KIND, resolved_content(d), d.signed) is None)
    event, decision = next(((e, d) for e, d in decisions if parties <= set(d.parties)), (None, None))
    copy: Copy = {"sample": name, "with": [{"serial": who, "sample": sample} for who, sample in sorted(found)]}
    if event is None or decision is None:
        return copy | {"withheld": True, "resolved": None}
    measured = [list(party) for party in decision.measured]
    told: dict[str, Any] = {"who": event.who, "time": event.time, "reason": decision.reason, "measured": measured}
    if decision.signed is not None:  # for a verification away from the bench
        told |= {"parties": resolved_content(decision)["parties"], "signed": decision.signed.to_json()}
    return copy | {"withheld": (serial, name) not in decision.measured, "resolved": told}


def withhold_others(store: Store, serial: str, copies: Sequence[Mapping[str, Any]], who: str) -> dict[str, int]:
    """Re-judge the other units that hold a copy if their last result does not state it: from then on it counts for them
    no more than for this one; a recording that was withheld once and counts again needs judging from its records.
    Returns serial -> number of the event. Raises StoreError."""
    changed = dict[str, int]()
    for other in sorted({w["serial"] for copy in copies for w in copy["with"]} - {serial}):
        last = store.latest(other, UnitJudged.KIND)
        if last is None:
            continue
        judged = UnitJudged.of(last)
        found = copies_of(store, other, judged.path, judged.result.samples)
        if found and found != list(judged.result.copies):
            why, again = f"a recording is also one of {serial}", replace(judged.result, copies=tuple(found))
            weaker = replace(judged, result=concluded(withhold_copies(again)), reason=why)
            changed[other] = store.write(weaker, other, who=who, spec=last.spec).seq
    return changed


def resolved_content(decision: CopiesResolved) -> dict[str, Any]:
    """Return the data of a decision about copies that quality assurance signs."""
    return {
        "parties": [list(party) for party in decision.parties],
        "measured": [list(party) for party in decision.measured],
        "reason": decision.reason,
    }


def settle_copies(store: Store, serial: str, measured: Sequence[str], reason: str, opens: Opens) -> list[Copy]:
    """Store to which unit shared recordings belong, as quality assurance decides and signs; returns them. measured:
    `SERIAL`, or `SERIAL:section/input`.

    Raises CopiesError if there is nothing to resolve, if the named unit has no such recording, or if more than one is
    named: a recording was measured at one unit. Raises DecisionError for a key of another role."""
    last = store.latest(serial, UnitJudged.KIND)
    judged = UnitJudged.of(last) if last else None
    samples: Samples = judged.result.samples if judged else {}
    found = [c for c in copies_of(store, serial, judged.path if judged else "", samples) if c["resolved"] is None]
    if not found:
        raise CopiesError(
            f"{serial}: none of its recordings is filed elsewhere too, or quality assurance has decided about all"
        )
    if not reason.strip():
        raise CopiesError("give a reason why one recording is filed in two places: --reason")
    parties = {(serial, c["sample"]) for c in found} | {(w["serial"], w["sample"]) for c in found for w in c["with"]}
    named = [word.partition(":") for word in measured]
    chosen = sorted(p for p in parties if any(p[0] == n and (not colon or p[1] == s) for n, colon, s in named))
    if not chosen or any(not any(p[0] == n and s in ("", p[1]) for p in parties) for n, _, s in named):
        known = ", ".join(f"{a}:{b}" for a, b in sorted(parties))
        raise CopiesError(f"--measured: name one or more of {known}")
    if len(units := sorted({unit for unit, _ in chosen})) > 1:
        raise CopiesError(f"--measured: one recording was measured at one unit, not at {' and '.join(units)}")
    told = sorted({recording_party(serial, c["sample"], samples[c["sample"]]) for c in found} | _parties(store, found))
    said, signer = CopiesResolved(tuple(told), tuple(chosen), " ".join(reason.split())), opens()
    signed = sign_decision(CopiesResolved.KIND, resolved_content(said), signer)
    store.write(replace(said, signed=signed), serial, who=signer.person)
    return found


def _parties(store: Store, found: Sequence[Copy]) -> set[tuple[str, str, str]]:
    there = set()
    wanted = {(w["serial"], w["sample"]) for c in found for w in c["with"]}
    for other in {who for who, _ in wanted}:
        for event in store.events(other, UnitJudged.KIND):
            for name, channels in UnitJudged.of(event).result.samples.items():
                if (other, name) in wanted:
                    there.add(recording_party(other, name, channels))
    return there
