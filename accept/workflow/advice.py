"""What to do about a result that is none: which record to repeat, and what to do differently.

A table of the words in which the checks say what is wrong with the data. A reason that no entry knows is shown as it
is: the advice is an addition, never the only word.
"""

from collections.abc import Mapping
from typing import Any

from accept.workflow.state.step_judgement import StepJudgement
from checks.declare import Check, Series

ADVICE: tuple[tuple[str, str], ...] = (
    ("double hit", "hit once, short, and let the hammer spring back"),
    ("overload", "hit softer, or take the force sensor's next range"),
    ("too close", "let it ring out before the next hit"),
    ("already moving", "let it ring out before the next hit"),
    ("off level", "hit about equally hard each time"),
    ("no impact", "look whether hammer and analyser are connected"),
    ("coherence is below", "keep hands off the bench, look at that channel's plug and range"),
    ("low coherence", "hit the same point, and look at the vibrometer's signal"),
    ("polarity turned", "look at that channel's plug, then record both bands again"),
    ("exchanged", "look at the plugs of these two channels, then record again"),
    ("nowhere follows", "look at that channel's plug, then record again"),
    ("nothing was recorded", "look at that channel's plug, then record again"),
    ("flickers by its finest step", "look at that channel's plug and range, then record again"),
    ("samples behind", "the channels were stored with an offset: look at the recording, then record again"),
    ("samples ahead", "the channels were stored with an offset: look at the recording, then record again"),
    ("s or more are needed", "record for longer"),
    ("mass steps found", "set the mass on once and take it off once, ten seconds apart, and touch nothing else"),
    ("go the same way", "set the mass on, then take it off, within one record"),
    ("the two steps differ", "look whether the mass stood firm, then repeat both records"),
    ("does not settle", "wait longer after setting the mass"),
    ("of quiet record", "wait longer before and after setting the mass"),
    ("does not follow the voltage", "look at gauge and amplifier, then record again"),
    ("V starts at", "begin at -20 V and record the whole cycle"),
    ("V reaches", "go up to 150 V and record the whole cycle"),
    ("is clipped", "set that channel's range higher, then record again"),
    ("damaged or cut", "the file is not whole: copy it again, or record again"),
    ("finite number", "the file holds numbers that are none: record again"),
    ("not stated", "give the value that is named"),
)


def advice(check: Check, judgement: StepJudgement) -> tuple[str, ...]:
    """What to do, a line each, from the reasons of all findings that did not get a value."""
    reasons = [str(f["reason"]) for f in judgement.findings if _without_value(f)]
    return tuple(dict.fromkeys(line for reason in reasons for line in lines(check, reason)))


def lines(check: Check, reason: str) -> list[str]:
    """Advice on one reason, with the record that it names."""
    found = list(dict.fromkeys(words for fault, words in ADVICE if fault in reason))
    record = _record(check, reason)
    if record is None:
        return found
    return [f"repeat '{record.label}': {words}" for words in found]


def _without_value(finding: Mapping[str, Any]) -> bool:
    return finding["verdict"] == "no_result" and bool(finding["reason"])


def _record(check: Check, reason: str) -> Series | None:
    """The record that a reason begins with the name of."""
    declared = check.inputs.get(reason.partition(":")[0])
    return declared if isinstance(declared, Series) else None
