"""Findings of measurements that contradict each other: neither can pass.

Which of the two is wrong cannot be seen from them, so both are without a result. A finding that fails by its own limits
fails as before: a contradiction does not improve a unit."""

from collections.abc import Sequence
from dataclasses import replace

from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because, together
from checks.consistency.relations import RELATIONS, Known, Relation
from checks.verdict import Finding, Verdict
from specs.units import with_unit


def check_consistency(findings: Sequence[Finding], known: Known) -> list[Finding]:
    """Return the findings; those of measurements that contradict each other have no result."""
    checked = list(findings)
    for relation in RELATIONS:
        if relation.is_contradicted(known):
            reason = _reason(relation, known)
            read = [CHECKS[f.check].reads in relation.sections and f.quantity not in relation.spared for f in checked]
            checked = [_without_result(f, reason) if used else f for f, used in zip(checked, read, strict=True)]
    return checked


def _without_result(finding: Finding, reason: Reason) -> Finding:
    """Return the finding without a value, or, if it fails by its own limits, with the contradiction as a cause."""
    cause = reason if finding.cause is None else together([finding.cause, reason])
    if finding.verdict is Verdict.FAIL:
        return replace(finding, cause=cause, reason=str(cause))
    return finding.withheld(cause)


def _reason(relation: Relation, known: Known) -> Reason:
    one, other = known[relation.one], known[relation.other]
    ratio, U = relation.ratio(known) or (0.0, 0.0)
    return because(
        Cause.CONTRADICTION,
        title=relation.title,
        ratio=ratio,
        U=U,
        lo=relation.lo,
        hi=relation.hi,
        one=f"{one.name} = {one.value:.4g} {one.unit}",
        other=f"{other.name} = {other.value:.4g} {other.unit}",
        one_called=with_unit(f"{CHECKS.label_of(one.name)} = {one.value:.4g}", one.name),
        other_called=with_unit(f"{CHECKS.label_of(other.name)} = {other.value:.4g}", other.name),
    )
