"""The same recording, read otherwise: judged before with another scale, channel, number beside it or setting, or from a
file that gave another value: scaled, cut or with another time.

The samples show what was measured, so a value that another number makes of them is no new measurement. If a finding was
not passed by the earlier reading, it is conditional at best until quality assurance decides; a void judgement does not
count (`void_attempts`).
"""

import math
from collections.abc import Iterator, Mapping, Sequence

from accept.judging.reservations.copies import Samples, judgement_of, same_recordings
from accept.judging.reservations.void_attempts import voids
from accept.judging.samples import is_typed, section_read_by
from accept.pictures.labels import CHANNELS, input_words
from accept.store import Event, Store
from accept.store.payloads import UnitJudged
from checks.acceptance import CHECKS
from checks.cause import Cause
from checks.verdict import Finding, UsedInput, Verdict

Rereading = Mapping[str, str]
"""words: how the earlier reading differs, and of which judgement; was: its verdict."""


def rereadings(
    store: Store, serial: str, samples: Samples, findings: Sequence[Finding], files: Mapping[str, str]
) -> dict[str, Rereading]:
    """Return quantity -> the last judgement in the store that read the same recording otherwise, one that did not pass
    before one that did. files: sha256 of each file that was read. A judgement of an earlier program does not state how
    it read. Raises StoreError."""
    own = {name: channels for name, channels in samples.items() if not is_typed(name)}
    found: dict[str, Rereading] = {}
    void: dict[str, set[int]] = {}
    for event in store.judgements_with(own):
        if event.what != UnitJudged.KIND:
            continue
        differences = dict(_differences(event, serial, own, findings, files))
        if differences and event.subject not in void:
            void[event.subject] = set(voids(store, event.subject))
        for quantity, reading in differences.items() if event.seq not in void.get(event.subject, ()) else ():
            if quantity not in found or reading["was"] != Verdict.PASS or found[quantity]["was"] == Verdict.PASS:
                found[quantity] = reading
    return found


def _differences(
    event: Event, serial: str, own: Samples, findings: Sequence[Finding], files: Mapping[str, str]
) -> Iterator[tuple[str, Rereading]]:
    """Yield the quantities that a judgement found in the same recordings, read otherwise."""
    result = judgement_of(event).result
    pairs = same_recordings(own, result.samples)
    then = {f.quantity: f for f in result.findings if f.inputs}
    for now in findings:
        before = then.get(now.quantity)
        shared = [(a, b) for a, b in pairs if a.partition("/")[0] == section_read_by(now.check)]
        if before is None or not shared or not now.inputs:
            continue
        changes = [*_changes(now.check, now.inputs, before.inputs), *(f"{a}, before {b}" for a, b in shared if a != b)]
        names = {i.name: str(i.value) for i in now.inputs if _is_record(now.check, i)}
        read = [names[a.partition("/")[2]] for a, _ in shared if a.partition("/")[2] in names]
        if not _is_same_value(now, before) and any(files.get(name) not in result.inputs.values() for name in read):
            changes.append(f"{' and '.join(read)} gives {_value(now)}, before {_value(before)}")
        if changes:
            whose = "" if event.subject == serial else f" of {event.subject}"
            judged = f"{before.verdict.replace('_', ' ')} on {event.time[:10]}{whose}"
            yield now.quantity, {"words": f"{', '.join(changes)} ({judged})", "was": str(before.verdict)}


def _is_same_value(now: Finding, before: Finding) -> bool:
    """Return whether two findings have one value, but for digits that a file was written without. A copy that was
    withheld had none for another reason."""
    withheld = before.cause is not None and Cause.SAMPLES_COPIED in {one.cause for one in before.cause.all()}
    if now.value is None or before.value is None:
        return now.value is None or withheld
    return math.isclose(now.value, before.value, rel_tol=1e-5)


def _value(finding: Finding) -> str:
    return "no result" if finding.value is None else f"{finding.value:.6g} {finding.unit}"


def _changes(check: str, now: Sequence[UsedInput], before: Sequence[UsedInput]) -> list[str]:
    ours, theirs = ({i.name: i for i in inputs if not _is_record(check, i)} for inputs in (now, before))
    return [
        f"{_words(check, name, ours)}, before {_words(check, name, theirs).removeprefix(_label(check, name))}"
        for name in dict.fromkeys([*ours, *theirs])
        if _read(ours.get(name)) != _read(theirs.get(name))
    ]


def _is_record(check: str, used: UsedInput) -> bool:
    return isinstance(used.value, str) and check in CHECKS and used.name in CHECKS[check].inputs


def _read(used: UsedInput | None) -> object:
    return None if used is None else (used.value, used.U)


def _label(check: str, name: str) -> str:
    declared = CHECKS[check].inputs.get(name)
    return f"{declared.label} " if declared is not None else ""


def _words(check: str, name: str, inputs: Mapping[str, UsedInput]) -> str:
    if name in inputs:
        return input_words(check, inputs[name])
    channel = name.removeprefix(CHANNELS)
    return f"{channel} is read as it is" if channel != name else f"{_label(check, name)}not stated"
