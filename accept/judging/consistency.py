"""Consistency of a result: whether its verdicts follow from its own numbers. A stored verdict is never taken on
trust."""

from collections.abc import Iterator, Mapping
from typing import Any

from checks.cause import Cause
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict, judge, unit_verdict
from specs.spec import Limit, Spec

_STRENGTH = {Verdict.NO_RESULT: 0, Verdict.FAIL: 0, Verdict.CONDITIONAL: 1, Verdict.PASS: 2}


def contradictions(entry: Mapping[str, Any], spec: Spec) -> list[str]:
    """Return the statements of a results.json entry that do not follow from its values, the limits of the spec and the
    decision rules.

    A finding may be weaker than its number alone would make it (an expired calibration, a failed gate), never stronger.
    Raises KeyError, TypeError or ValueError if the entry is not a result.
    """
    return [*_findings(entry, spec), *_missing(entry, spec), *_unit(entry)]


def _findings(entry: Mapping[str, Any], spec: Spec) -> Iterator[str]:
    for finding in entry["findings"]:
        name = f"{finding['check']}.{finding['quantity']}"
        check = spec.checks.get(finding["check"])
        limit = check.limits.get(finding["quantity"]) if check else None
        if check is None or limit is None:
            yield f"{name} is judged, but spec {spec.name} has no limit for it"
            continue
        stated = (finding["lower"], finding["upper"], finding["rule"], finding["required"])
        if stated != (limit.lower, limit.upper, limit.rule, check.required):
            yield f"{name} is judged by other limits than those of spec {spec.name}"
        elif _STRENGTH[Verdict(finding["verdict"])] > _STRENGTH[_again(finding, limit).verdict]:
            yield f"{name} = {finding['value']} is said to be '{finding['verdict']}', which its limits do not give"


def _again(finding: Mapping[str, Any], limit: Limit) -> Finding:
    value, U = finding["value"], finding["U"]
    if value is None:
        return judge(finding["check"], Quantity.missing(finding["quantity"], Cause.NOT_MEASURED), limit)
    return judge(finding["check"], Quantity(finding["quantity"], float(value), None if U is None else float(U)), limit)


def _missing(entry: Mapping[str, Any], spec: Spec) -> Iterator[str]:
    """Yield a sentence for each quantity of a required check that has no finding."""
    there = {(f["check"], f["quantity"]) for f in entry["findings"]}
    for name, check in spec.checks.items():
        absent = [quantity for quantity in check.limits if check.required and (name, quantity) not in there]
        yield from (f"{name}.{quantity} is required by spec {spec.name} and has no finding" for quantity in absent)


def _unit(entry: Mapping[str, Any]) -> Iterator[str]:
    findings = [
        Finding(**{**_SHORT, "verdict": Verdict(f["verdict"]), "required": bool(f["required"])})
        for f in entry["findings"]
    ]
    follows = str(unit_verdict(findings, bool(entry.get("nonconformances"))))
    if entry["verdict"] != follows:
        yield f"the unit is said to be '{entry['verdict']}', its findings and nonconformances make it '{follows}'"


_SHORT: dict[str, Any] = {
    "check": "", "quantity": "", "value": None, "unit": "", "U": None, "lower": None, "upper": None, "rule": "",
    "p_false_accept": None, "reason": None,
}  # fmt: skip
