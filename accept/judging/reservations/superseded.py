"""What an earlier attempt holds against a finding: it is conditional until quality assurance decides.

The newest measurement counts: a finding is superseded if one of its recordings is that of an attempt before one that
was not accepted and that does not hold it; so are typed values beside such recordings, those of a unit where all were
typed and are the same, and those in whose place others did not pass. Single values that were typed may be equal by
chance. An attempt that is void supersedes nothing, nor does an incomplete one in which the section was not measured.
What an earlier attempt holds as simulated does not become measured, nor does what it holds of a unit with
another part become that of this one: it is held in the same way.

A doubt stays with its evidence: a finding that did not pass in an earlier attempt does not pass by the same recordings
or values, whatever was deleted or replaced since, nor by values that were typed in place of its recordings. If the
spec requires it no longer, the unit is held by what else it shares with that attempt. Doubts that the store raises
itself are its own to raise again. A spec that quality assurance approved since judges the same data anew.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from datetime import datetime
from typing import NamedTuple

from accept.base.documents.results import UnitRecord
from accept.base.plain_text import listed
from accept.judging.reservations.copies import Channels, same_recording
from accept.judging.samples import is_typed, section_read_by
from accept.store import Event
from accept.store.payloads import UnitJudged
from accept.units import UNIT_FILE
from checks.cause import Cause
from checks.verdict import Finding, UnitVerdict, Verdict

_UNREAD = {Cause.FILE_DAMAGED, Cause.IN_WORDS, Cause.CHANNEL_MISSING}  # nothing is known of what such a file holds
# Doubts that the store raises itself, from what it knows of the unit by its serial: as long as they last.
_OF_STORE = {Cause.SUPERSEDED, Cause.NONCONFORMANCE, Cause.READ_OTHERWISE, Cause.SERIAL_ALIKE, Cause.FOLDER_NAME}
SAME = 1e-9  # relative: the same data judged twice, on whatever processor; two readings do not agree by so much


def measured_values(entry: UnitRecord, check: str = "") -> dict[str, float]:
    """Return the value of each quantity of a result that has one, of one check or of all."""
    return {row.quantity: row.value for row in entry.rows if row.value is not None and check in ("", row.check)}


def are_same(values: Mapping[str, float], others: Mapping[str, float]) -> bool:
    """Return whether all quantities that both have are equal: the same data, by whatever spec."""
    common = values.keys() & others.keys()
    return bool(common) and all(math.isclose(values[q], others[q], rel_tol=SAME) for q in common)


class Approval(NamedTuple):
    """Approval of a spec by quality assurance. spec: as events name it; time: ISO 8601. seq: number of its event; 0:
    the store has none."""

    spec: str
    time: str
    seq: int = 0

    def revises(self, event: Event) -> bool:
        """Return whether the spec is another version of that of a judgement, approved since."""
        name, _, sha256 = (event.spec or "").partition("@")
        by_clock = datetime.fromisoformat(self.time) > datetime.fromisoformat(event.time)
        since = self.seq > event.seq if self.seq else by_clock
        return since and self.spec.startswith(f"{name}@") and self.spec != f"{name}@{sha256}"


def superseded(
    judged: Sequence[tuple[Event, UnitJudged]],
    void: Collection[int],
    entry: UnitRecord,
    approval: Approval | None = None,
) -> dict[str, str]:
    """Return check -> what earlier attempts hold against it. judged: the unit's judgements, in order; void: numbers of
    those that were declared void; approval: of the spec that the unit is judged by."""
    counted = [(n, event, payload.result) for n, (event, payload) in enumerate(judged, 1) if event.seq not in void]
    older = _older([(f"attempt {n}", event.time[:10], result) for n, event, result in counted], entry)
    same = [dict(entry.inputs) == dict(r.inputs) and _bench(entry) == _bench(r) for _, _, r in counted]
    revised = [s and approval is not None and approval.revises(e) for s, (_, e, _) in zip(same, counted, strict=True)]
    held = _inherited([(f"attempt {n} of {e.time[:10]}", r) for n, e, r in counted], revised, entry)
    return {
        check: f"{check}: {'; '.join(w[check] for w in (held, older) if check in w)}" for check in {**older, **held}
    }


def _older(past: Sequence[tuple[str, str, UnitRecord]], entry: UnitRecord) -> dict[str, str]:
    """Return check -> where its evidence was first judged, and which attempt superseded it."""
    accepted = all(result.verdict == UnitVerdict.ACCEPTED for _, _, result in past[1:])
    if accepted and not any(_unlike(result, entry, result.parts) for _, _, result in past):  # as for most units
        return {}
    checks = {f.check: _records(entry, f.check) for f in entry.findings if f.value is not None}
    found = dict[str, dict[str, str]]()  # each in words of its own: what QA concedes of one does not hold for both
    for check, records in sorted(checks.items(), key=lambda item: (not item[1], item[0])):  # recordings first
        evidence: list[Channels | None] = [*records] if records else [None]
        for record in evidence:
            held = [_holds(result, check, record, entry) for _, _, result in past]
            first = held.index(True) if True in held else len(held)
            parts: Mapping[str, str] = {}  # with which it was measured: as they were first named
            for (number, _, result), same in zip(past, held, strict=True):
                parts = {**result.parts, **parts} if same else parts
                if not same or not (how := _unlike(result, entry, parts)):
                    continue
                if record is not None or any(checks[other] for other in found) or _is_typed_again(entry, result):
                    found.setdefault(check, {})["with"] = f"measured in {number}, {how}"
                    break
            for (number, day, result), same in zip(past[first + 1 :], held[first + 1 :], strict=True):
                if same or result.verdict == UnitVerdict.ACCEPTED or not _speaks(result, check):
                    continue
                beside = any(checks[other] for other in found)  # a recording that is as old
                if record is not None or beside or _tells(entry, past[first][2], result, check):
                    rejected = f"{number}, which was {result.verdict} on {day}"
                    found.setdefault(check, {})["before"] = f"measured in {past[first][0]}, before {rejected}"
    return {check: "; ".join(words.values()) for check, words in found.items()}


def _unlike(result: UnitRecord, entry: UnitRecord, parts: Mapping[str, str]) -> str:
    """Return how what an earlier attempt holds is of something else than this unit, "" if it is not: it was simulated,
    or measured with parts that were exchanged or left out since."""
    if result.simulated and not entry.simulated:
        return "which was simulated"
    other = [f"{name} {part}" for name, part in sorted(parts.items()) if entry.parts.get(name) != part]
    return f"with {listed(other)}" if other else ""


def _inherited(past: Sequence[tuple[str, UnitRecord]], revised: Sequence[bool], entry: UnitRecord) -> dict[str, str]:
    """Return check -> the last attempt in which it did not pass, and how its evidence is used again. revised: whether
    the spec was since."""
    found = dict[str, str]()
    for i, (number, result) in reversed([*enumerate(past)]):
        for finding in () if revised[i] else result.findings:
            check = finding.check
            if check in found or not _is_doubted(finding, result, entry):
                continue
            if how := _used_again(finding, result, entry, [later for _, later in past[i + 1 :]]):
                was, changes = finding.verdict.replace("_", " "), ", ".join(_changes(entry, result))
                found[check] = f"{was} in {number}, and {how}" + (f"; {changes}" if changes else "")
    return found


def _is_doubted(finding: Finding, result: UnitRecord, entry: UnitRecord) -> bool:
    """Return whether a finding of an earlier attempt did not pass by more than the store would hold against it now."""
    if finding.verdict is Verdict.PASS:
        return False
    causes = set() if finding.cause is None else {one.cause for one in finding.cause.all()}
    of_store = _OF_STORE | ({Cause.PART_DOUBTED} if result.parts == entry.parts else set())
    if section_read_by(finding.check) in {copy["sample"].partition("/")[0] for copy in entry.copies}:
        of_store |= {Cause.SAMPLES_COPIED}
    return not causes or not causes <= of_store


def _used_again(finding: Finding, result: UnitRecord, entry: UnitRecord, later: Sequence[UnitRecord]) -> str:
    """Return how a finding of an earlier attempt would be better now by the same evidence, "" if it would not. later:
    the attempts since; one that measured it anew settles it, unless its recordings are used again."""
    now, check = next((f for f in entry.findings if f.quantity == finding.quantity), None), finding.check
    held = now is not None and now.cause is not None and {one.cause for one in now.cause.all()} == {Cause.SUPERSEDED}
    passes = now is not None and (now.verdict is Verdict.PASS or held)
    if passes and _is_new(entry, result, finding):
        return ""
    if passes and _is_recorded(entry, check):
        names = [name for name, sha256 in _files(entry, check).items() if sha256 in result.inputs.values()]
        return f"its recordings ({listed(names)}) are used again" if names else "its recordings are used again"
    if any(_passes_anew(each, finding, result) for each in later):
        return ""
    if passes:
        return "is typed now" if _is_recorded(result, check) else "its typed values are used again"
    if not finding.required or (now is not None and now.required):
        return ""
    shared = set(entry.inputs.values()) & set(result.inputs.values())
    if not shared and all(_is_new(entry, result, f) for f in entry.findings):
        return ""
    return f"the spec does not require {finding.quantity} now, and what else was measured is used again"


def _passes_anew(later: UnitRecord, finding: Finding, result: UnitRecord) -> bool:
    """Return whether a later attempt measured a finding anew, with a pass that no concession gave."""
    passes = any(f.quantity == finding.quantity and f.verdict is Verdict.PASS for f in later.findings)
    return passes and not later.dispositions and _is_new(later, result, finding)


def _is_new(entry: UnitRecord, result: UnitRecord, finding: Finding) -> bool:
    """Return whether the evidence of a finding is not that of an earlier attempt, nor typed in place of a recording."""
    check, values = finding.check, (measured_values(entry), measured_values(result))
    if are_same(*({finding.quantity: v[finding.quantity]} if finding.quantity in v else {} for v in values)):
        return False
    if not _is_recorded(entry, check):
        return not _is_recorded(result, check) and _entries(entry, check) != _entries(result, check)
    shared = set(_files(entry, check).values()) & set(_files(result, check).values())
    return not shared and not shares_recording(entry, result, check)


def shares_recording(entry: UnitRecord, result: UnitRecord, check: str) -> bool:
    """Return whether two results were judged, in what a check reads, by the same recording."""
    return any(same_recording(a, b) for a in _records(entry, check) for b in _records(result, check))


def _entries(result: UnitRecord, check: str) -> list[tuple[str, str]]:
    used = {
        u.name: str(u.value) for f in result.findings if f.check == check for u in f.inputs if u.source == UNIT_FILE
    }
    return sorted(used.items())


def _files(result: UnitRecord, check: str) -> dict[str, str]:
    stated = (str(used.value) for f in result.findings if f.check == check for used in f.inputs)
    return {name: result.inputs[name] for name in stated if name in result.inputs}


def _is_recorded(result: UnitRecord, check: str) -> bool:
    return bool(_files(result, check) or _records(result, check))


def _changes(entry: UnitRecord, result: UnitRecord) -> list[str]:
    """Return what an earlier attempt had and this one has not, or has otherwise."""
    gone = [name for name in result.inputs if name not in entry.inputs]
    changed = [name for name, sha256 in result.inputs.items() if entry.inputs.get(name, sha256) != sha256]
    words = [f"{listed(names)} {was}" for names, was in ((gone, "is gone"), (changed, "was changed")) if names]
    return words if _bench(entry) == _bench(result) else [*words, "the bench file is another one or gone"]


def _bench(result: UnitRecord) -> object:
    return (result.calibration or {}).get("sha256")


def _records(entry: UnitRecord, check: str) -> list[Channels]:
    section = section_read_by(check)
    return [c for name, c in entry.samples.items() if name.partition("/")[0] == section and not is_typed(name)]


def _holds(result: UnitRecord, check: str, record: Channels | None, entry: UnitRecord) -> bool:
    """Return whether a judgement holds a recording, or without one the values of a check."""
    if record is None:
        return are_same(measured_values(entry, check), measured_values(result, check))
    return any(same_recording(record, other) for other in _records(result, check))


def _speaks(result: UnitRecord, check: str) -> bool:
    """Return whether a judgement says anything of a check: an incomplete one may not have come to it. Where nothing was
    recorded, as of a dead unit, there are no values and no sketch, but a file that was read."""
    if _records(result, check) or measured_values(result, check) or result.verdict != UnitVerdict.INCOMPLETE:
        return True
    mine = [f for f in result.findings if f.check == check] if _files(result, check) else []
    return any(f.cause is not None and not {one.cause for one in f.cause.all()} & _UNREAD for f in mine)


def _tells(entry: UnitRecord, first: UnitRecord, result: UnitRecord, check: str) -> bool:
    """Return whether typed values that are as before are no chance: others in their place did not pass, or all of a
    unit without any recording are so."""
    failed = any(f.check == check and f.verdict is not Verdict.PASS for f in result.findings)
    return failed or _is_typed_again(entry, first)


def _is_typed_again(entry: UnitRecord, first: UnitRecord) -> bool:
    """Return whether a unit without any recording has the values that it had."""
    typed = all(is_typed(name) for name in entry.samples)
    return typed and are_same(measured_values(entry), measured_values(first))
