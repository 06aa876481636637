"""What judging one step gave, by which spec and program."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class StepJudgement:
    """findings, information: as in results.json; upto: the last entry that was judged, later ones make it stale."""

    upto: int
    spec: str
    code: str
    findings: tuple[Mapping[str, Any], ...]
    information: tuple[Mapping[str, Any], ...]
    notes: tuple[str, ...]
