"""Advice on a finding without a pass: by its cause, which channel or record is meant, and what to do differently.

A cause without an entry needs no advice beside its sentence. The texts take the parameters of their cause.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from accept.base.documents.results import UnitRecord
from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, record_label
from checks.declare import Check, Series
from checks.verdict import Finding, Verdict, unit_verdict
from specs.units import CHANNEL_LABELS

_PLUG = "check the plug of {channel}, then record again"
_OFFSET = "check the acquisition settings: {channel} is stored with an offset; then record again"
_WHOLE_CYCLE = "begin at -20 V, go up to 150 V and record the whole cycle"
_TWO_STEPS = "add the mass once and remove it once, ten seconds apart, within one record; touch nothing else"

_GAP = "run the gap analysis: it tells what differs, the bench or the part"
_LOST = "close other programs on the recorder, or sample more slowly; then record again"
FILE_REFUSED = "copy, correct or export the file again, as its reason says"
ADVICE: Mapping[Cause, str] = {
    Cause.ENTRY_MISSING: "enter the {entry}",
    Cause.FILE_DAMAGED: "copy the file again, or record again",
    Cause.SAMPLES_NOT_FINITE: "record again; check the connection of {channel}",
    Cause.RECORD_SHORT: "record for at least {needed:g} s",
    Cause.OTHER_VARIANT: "if it is a {title}, its kind is '{kind}'; if not, record every channel",
    Cause.CHANNEL_NOT_EXPECTED: "if it is fixed, correct `kind`; if not, leave {channel} out of the record",
    Cause.CHANNEL_EMPTY: _PLUG,
    Cause.CHANNEL_CONSTANT: _PLUG,
    Cause.CHANNEL_DEAD: "check plug and supply of {channel}, then record again",
    Cause.CHANNEL_NOT_DRIVEN: "check plug and supply of {channel}, then record again",
    Cause.CHANNEL_CLIPPED: "set the range of {channel} higher, then record again",
    Cause.CHANNEL_REVERSED: "reverse the connection of {channel}, then record both bands again",
    Cause.CHANNELS_EXCHANGED: "exchange the plugs of {channel} and {other}, then record again",
    Cause.CHANNEL_SIZE: "check plug and range of {channel}, then record again",
    Cause.CHANNEL_STUCK: "check {channel}: it must move freely and stay within its range; then record again",
    Cause.CHANNEL_UNIT: "name the unit of {channel} in the file's header, or in [channels] of unit.toml",
    Cause.CHANNEL_SCALED: "state {channel} in [rig.channels] of the bench file and judge with it (--bench)",
    Cause.INPUT_NOT_STATED: "correct it, or state it in [values] of the bench file and judge with that file (--bench)",
    Cause.CHANNEL_HELD: "check plug and supply of {channel}, then record again",
    Cause.CHANNEL_SLIPPED: _LOST,
    Cause.SAMPLES_LOST: _LOST,
    Cause.CHANNEL_DISTURBED: "check the plug of {channel}, then record again",
    Cause.CLOCKS_APART: "record {channel} and {reference} with one clock: one recorder, or two that share their clock",
    Cause.SAMPLING_JITTER: "let one clock of hardware time every sample, then record again",
    Cause.CHANNEL_COPIED: "check that {channel} and {other} are on inputs of their own, then record again",
    Cause.CHANNEL_DELAYED: _OFFSET,
    Cause.CHANNEL_OFFSET: _OFFSET,
    Cause.CHANNEL_SCALE: "check the scale factors of {channel} and {other}",
    Cause.WRONG_GAIN: "check that both actuator stacks are connected, and the gain of the amplifier",
    Cause.DRIVE_BEHIND_AMPLIFIER: "record Va at the DAC, ahead of the amplifier",
    Cause.CONTRADICTION: "check that both are of this unit, and what was stated with them (scale, amplifier, resistor, "
    "added mass, payload); then measure both again",
    Cause.SAMPLES_COPIED: "record again; if it is this unit's own, quality assurance decides: "
    "accept store resolve SERIAL --measured SERIAL",
    Cause.PART_DOUBTED: "judge the part again, build in another one, or correct [parts] of the strut that it left",
    Cause.FOLDER_NAME: "rename the folder, or correct serial in unit.toml; or confirm the serial: accept report at a "
    "terminal",
    Cause.SERIAL_ALIKE: "correct serial in unit.toml, or confirm it: accept report at a terminal",
    Cause.NONCONFORMANCE: "sign; quality assurance countersigns with its disposition",
    Cause.SUPERSEDED: "measure it again",
    Cause.POINT_TWICE: "measure points {first} and {second} again",
    Cause.VOLTAGE_START: _WHOLE_CYCLE,
    Cause.VOLTAGE_TOP: _WHOLE_CYCLE,
    Cause.STROKE_AWAY: "check sign and mounting of {channel}, and the amplifier; then record again",
    Cause.STROKE_IN_NOISE: "check the mounting of {channel}, and the amplifier; then record again",
    Cause.STROKE_IMPLAUSIBLE: "check which stacks were driven and which file is which, the unit and the range of "
    "{channel}; then record again",
    Cause.STACKS_DIFFER: "check which stacks were driven, then record both again",
    Cause.GAUGE_DRIFT: "clamp {channel} firmly, let it warm up, then record again",
    Cause.SINE_SMALL: "drive Va with at least {needed:g} V, then record again",
    Cause.ONE_AMPLITUDE: "record at two amplitudes or more",
    Cause.STEP_COUNT: _TWO_STEPS,
    Cause.STEPS_SAME_WAY: _TWO_STEPS,
    Cause.STEP_PLATEAU: "wait longer before and after adding the mass",
    Cause.STEP_NOT_SETTLED: "put the mass down more gently and wait until it stands still",
    Cause.STEPS_DIFFER: "check that the mass stands firmly, then repeat both records",
    Cause.CIRCUITS_EXCHANGED: "exchange the files of the closed and the open circuit; check the added mass as well",
    Cause.NO_IMPACT: "check that hammer and analyser are connected",
    Cause.COHERENCE_LOW: "do not touch the bench; check plug and range of the channel named",
    Cause.RECORDS_DISAGREE: "check that both records are of this unit, on one bench with one setting",
    Cause.PAYLOAD_WRONG: "{mass} kg {how} than stated is on the bench: check the payload, measure again",
    Cause.PAYLOAD_DIFFERS: "measure with a payload of {expected:g} kg, or correct the payload entered",
    Cause.MODEL_MISFIT: _GAP,
    Cause.PRIOR_EXCEEDED: _GAP,
    Cause.PRIORS_EXCEEDED: _GAP,
    Cause.AXIAL_STIFFNESS: "check the payload on the bench; " + _GAP,
}
IMPACT_ADVICE: Mapping[str, str] = {
    "double hit": "hit once, briefly, and let the hammer spring back",
    "overload": "hit more softly, or use the next range of the force sensor",
    "too close": "let the vibration decay before the next hit",
    "already moving": "let the vibration decay before the next hit",
    "off level": "hit about equally hard each time",
    "low coherence": "hit the same point; check the signal of the vibrometer",
}


def advice(check: Check, finding: Finding) -> list[str]:
    """Return what to do about a finding, one line each; empty for a pass."""
    return _told(check, finding.verdict, finding.cause)


def stored_advice(finding: Mapping[str, Any]) -> list[str]:
    """Return the advice on a finding as results.json holds it, from the finding and this program alone; empty for
    checks of other packages and for causes of later versions."""
    if not CHECKS.is_own(finding["check"]):
        return []
    try:
        cause = None if finding.get("cause") is None else Reason.read(finding["cause"])
        return _told(CHECKS[finding["check"]], Verdict(finding["verdict"]), cause)
    except (KeyError, ValueError, TypeError):  # parameters that the sentences here do not know
        return []


def _told(check: Check, verdict: Verdict, cause: Reason | None) -> list[str]:
    known = [] if cause is None else lines(check, cause)
    failed = verdict is Verdict.FAIL and set(known) <= {ADVICE[Cause.CONTRADICTION]}
    return [check.failed, *known] if failed and check.failed else known  # a contradiction names two suspects


def first_advice(findings: Iterable[Finding]) -> str | None:
    """Return what to do first about a unit: what to correct at the bench, else the advice on its first failure; None if
    nothing is to be done."""
    found = list(findings)
    failed = [advice(CHECKS[f.check], f) for f in found if f.verdict is Verdict.FAIL]
    return action(found) or next((told[0] for told in failed if told), None)


def action(findings: Iterable[Finding]) -> str | None:
    """Return what to do at the bench about findings without a result, the first line for each of them; None if there is
    nothing to correct, or if a finding fails, which a repeated measurement would not change."""
    found = list(findings)
    if any(f.verdict is Verdict.FAIL for f in found):
        return None
    without = [f for f in found if f.verdict is Verdict.NO_RESULT and f.check in CHECKS]
    wrong = [lines(CHECKS[f.check], f.cause) for f in without if f.cause is not None]
    # a contradiction names two suspects and a misfit none; what names one comes first, and is enough
    named = [line for advised in wrong for line in advised[:1] if line not in (ADVICE[Cause.CONTRADICTION], _GAP)]
    return "; ".join(dict.fromkeys(named or [advised[0] for advised in wrong if advised])) or None


def concluded(record: UnitRecord) -> UnitRecord:
    """Return the record with the verdict and the action that follow from its findings."""
    verdict = unit_verdict(record.findings, bool(record.nonconformances))
    return replace(record, verdict=verdict, action=action(record.findings))


def lines(check: Check, reason: Reason) -> list[str]:
    """Return the advice on a reason and on its further causes, with the record that each names."""
    return list(dict.fromkeys(line for one in reason.all() for line in _lines(check, one)))


def record_advice(reason: Reason) -> list[str]:
    """Return the advice on why a record was refused before any check saw it."""
    return [ADVICE[each.cause].format(**_named(each)) for each in reason.all() if each.cause in ADVICE]


def _named(reason: Reason) -> dict[str, Any]:
    """Return the parameters of a reason, channels by their names."""
    return {k: CHANNEL_LABELS.get(v, v) if isinstance(v, str) else v for k, v in reason.parameters.items()}


def _lines(check: Check, reason: Reason) -> list[str]:
    parameters = _named(reason)
    if reason.cause is Cause.IMPACTS_BAD:
        found = [IMPACT_ADVICE[fault] for fault in parameters["faults"] if fault in IMPACT_ADVICE]
    elif reason.cause is Cause.IN_WORDS and reason.record:  # of a file that its reader refused
        found = [FILE_REFUSED]
    else:
        found = [ADVICE[reason.cause].format(**parameters)] if reason.cause in ADVICE else []
    declared = check.inputs.get(reason.record)
    where = f"{record_label(reason.record)}: " if isinstance(declared, Series) else ""
    return [f"{where}{words}" for words in found]
