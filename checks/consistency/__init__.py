"""Consistency of the measurements of one unit.

    findings = check_consistency(findings, known)  # known: quantities by their names
    [(r.title, r.lo, r.hi, r.why) for r in RELATIONS]

Measurements that contradict each other have no result."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.consistency.contradictions import PAYLOAD, RELATIONS, check_consistency
else:
    __getattr__ = door(__name__)
