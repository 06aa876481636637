"""The newest measurement counts: what was measured before an attempt that was not accepted does not replace it.

A finding is superseded if one of its recordings is that of an attempt before one that was not accepted and that does
not hold it; so are typed values beside such recordings, those of a unit where all were typed and are the same, and
those in whose place others did not pass. Single values that were typed may be equal by chance. It is conditional until
quality assurance decides. An attempt that is void supersedes nothing, nor does an incomplete one in which the section
was not measured. What an earlier attempt holds as simulated does not become measured: it is held in the same way.
"""

import math
from collections.abc import Collection, Mapping, Sequence

from accept.base.documents.results import Information, UnitEntry
from accept.judging.copies import Channels, same_recording
from accept.store import Event
from accept.store.payloads import UnitJudged
from accept.units.samples import is_typed
from checks.acceptance import CHECKS
from checks.cause import Cause
from checks.verdict import Finding, UnitVerdict, Verdict

_UNREAD = {Cause.FILE_DAMAGED, Cause.IN_WORDS, Cause.CHANNEL_MISSING}  # nothing is known of what such a file holds
SAME = 1e-9  # relative: the same data judged twice, on whatever processor; two readings do not agree by so much


def measured_values(entry: UnitEntry, check: str = "") -> dict[str, float]:
    """Return the value of each quantity of a result that has one, of one check or of all."""
    rows: list[Information | Finding] = [*entry.information, *entry.findings]
    return {row.quantity: row.value for row in rows if row.value is not None and check in ("", row.check)}


def are_same(values: Mapping[str, float], others: Mapping[str, float]) -> bool:
    """Return whether all quantities that both have are equal: the same data, by whatever spec."""
    common = values.keys() & others.keys()
    return bool(common) and all(math.isclose(values[q], others[q], rel_tol=SAME) for q in common)


def superseded(judged: Sequence[tuple[Event, UnitJudged]], void: Collection[int], entry: UnitEntry) -> dict[str, str]:
    """Return check -> where its evidence was first judged, and which attempt superseded it. judged: the unit's
    judgements, in order; void: numbers of those that were declared void."""
    past = [(f"attempt {n}", e.time[:10], j.result) for n, (e, j) in enumerate(judged, 1) if e.seq not in void]
    accepted = all(result.verdict == UnitVerdict.ACCEPTED for _, _, result in past[1:])
    if accepted and (entry.simulated or not any(result.simulated for _, _, result in past)):  # as for most units
        return {}
    checks = {f.check: _records(entry, f.check) for f in entry.findings if f.value is not None}
    found = dict[str, str]()
    for check, records in sorted(checks.items(), key=lambda item: (not item[1], item[0])):  # recordings first
        evidence: list[Channels | None] = [*records] if records else [None]
        for record in evidence:
            held = [_holds(result, check, record, entry) for _, _, result in past]
            first = held.index(True) if True in held else len(held)
            for (number, _, result), same in zip(past, held, strict=True):
                if not same or not result.simulated or entry.simulated:
                    continue
                if record is not None or any(checks[other] for other in found) or _is_typed_again(entry, result):
                    found[check] = f"{check}: measured in {number}, which was simulated"
                    break
            if check in found:
                continue
            for (number, day, result), same in zip(past[first + 1 :], held[first + 1 :], strict=True):
                if same or result.verdict == UnitVerdict.ACCEPTED or not _speaks(result, check):
                    continue
                beside = any(checks[other] for other in found)  # a recording that is as old
                if record is not None or beside or _tells(entry, past[first][2], result, check):
                    rejected = f"{number}, which was {result.verdict} on {day}"
                    found[check] = f"{check}: measured in {past[first][0]}, before {rejected}"
    return found


def _records(entry: UnitEntry, check: str) -> list[Channels]:
    """Return the recordings that a check reads."""
    section = CHECKS[check].reads
    return [c for name, c in entry.samples.items() if name.partition("/")[0] == section and not is_typed(name)]


def _holds(result: UnitEntry, check: str, record: Channels | None, entry: UnitEntry) -> bool:
    """Return whether a judgement holds a recording, or without one the values of a check."""
    if record is None:
        return are_same(measured_values(entry, check), measured_values(result, check))
    return any(same_recording(record, other) for other in _records(result, check))


def _speaks(result: UnitEntry, check: str) -> bool:
    """Return whether a judgement says anything of a check: an incomplete one may not have come to it. Where nothing was
    recorded, as of a dead unit, there are no values and no sketch, but a file that was read."""
    if _records(result, check) or measured_values(result, check) or result.verdict != UnitVerdict.INCOMPLETE:
        return True
    mine = [f for f in result.findings if f.check == check and any(str(i.value) in result.inputs for i in f.inputs)]
    return any(f.cause is not None and not {one.cause for one in f.cause.all()} & _UNREAD for f in mine)


def _tells(entry: UnitEntry, first: UnitEntry, result: UnitEntry, check: str) -> bool:
    """Return whether typed values that are as before are no chance: others in their place did not pass, or all of a
    unit without any recording are so."""
    failed = any(f.check == check and f.verdict is not Verdict.PASS for f in result.findings)
    return failed or _is_typed_again(entry, first)


def _is_typed_again(entry: UnitEntry, first: UnitEntry) -> bool:
    """Return whether a unit without any recording has the values that it had."""
    typed = all(is_typed(name) for name in entry.samples)
    return typed and are_same(measured_values(entry), measured_values(first))
