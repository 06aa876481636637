"""Consistency of a record: whether its verdicts follow from its own numbers; a stored verdict is never trusted."""

from collections.abc import Iterator

from accept.base.documents.results import UnitRecord
from checks.cause import Cause
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict, judge, unit_verdict
from specs.spec import Limit, Spec

_STRENGTH = {Verdict.NO_RESULT: 0, Verdict.FAIL: 0, Verdict.CONDITIONAL: 1, Verdict.PASS: 2}


def contradictions(record: UnitRecord, spec: Spec) -> list[str]:
    """Return the statements of a record that do not follow from its values, limits and decision rules.

    A finding may be weaker than its number alone would make it (an expired calibration, a failed gate), never stronger.
    """
    return [*_findings(record, spec), *_missing(record, spec), *_unit(record)]


def _findings(record: UnitRecord, spec: Spec) -> Iterator[str]:
    for finding in record.findings:
        name = f"{finding.check}.{finding.quantity}"
        check = spec.checks.get(finding.check)
        limit = check.limits.get(finding.quantity) if check else None
        if check is None or limit is None:
            yield f"{name} is judged, but spec {spec.name} has no limit for it"
            continue
        stated = (finding.lower, finding.upper, finding.rule, finding.required)
        if stated != (limit.lower, limit.upper, limit.rule, check.required):
            yield f"{name} is judged by other limits than those of spec {spec.name}"
        elif _STRENGTH[finding.verdict] > _STRENGTH[_again(finding, limit).verdict]:
            yield f"{name} = {finding.value} is said to be '{finding.verdict}', which its limits do not give"


def _again(finding: Finding, limit: Limit) -> Finding:
    if finding.value is None:
        return judge(finding.check, Quantity.missing(finding.quantity, Cause.NOT_MEASURED), limit)
    return judge(finding.check, Quantity(finding.quantity, finding.value, finding.U), limit)


def _missing(record: UnitRecord, spec: Spec) -> Iterator[str]:
    there = {(f.check, f.quantity) for f in record.findings}
    for name, check in spec.checks.items():
        absent = [quantity for quantity in check.limits if check.required and (name, quantity) not in there]
        yield from (f"{name}.{quantity} is required by spec {spec.name} and has no finding" for quantity in absent)


def _unit(record: UnitRecord) -> Iterator[str]:
    follows = unit_verdict(record.findings, bool(record.nonconformances))
    if record.verdict != follows:
        yield f"the unit is said to be '{record.verdict}', its findings and nonconformances make it '{follows}'"
