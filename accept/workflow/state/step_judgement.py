"""What judging one step gave, by which spec and program."""

from dataclasses import dataclass

from checks.quantity import Quantity
from checks.verdict import Finding


@dataclass(frozen=True)
class StepJudgement:
    """findings: judged quantities; information: (check, quantity) without limits; upto: the last entry that was
    judged, later ones make it stale."""

    upto: int
    spec: str
    code: str
    findings: tuple[Finding, ...]
    information: tuple[tuple[str, Quantity], ...]
    notes: tuple[str, ...]
