"""Judging one unit folder in a process of its own: what goes in and what comes back are plain data."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accept import campaign, unit
from accept.calibration import Statement
from accept.unit import UnitError
from specs import parse


@dataclass(frozen=True)
class Job:
    """A unit folder, the spec's own bytes (so that every worker judges by the same ones) and what is wanted."""

    folder: Path
    spec_path: str
    spec_text: str
    operator: str
    certificate: bool
    calibration: Statement | None = None


@dataclass(frozen=True)
class Judged:
    """Result of one job: its entry for results.json and its certificate, unsigned; or `refused`: why not judged."""

    folder: Path
    result: dict[str, Any] | None = None
    unsigned: bytes | None = None
    refused: str | None = None


def judge_folder(job: Job) -> Judged:
    """Judge a folder and, where wanted, render its certificate, unsigned. Never raises on bad input."""
    spec = parse(job.spec_text.encode(), job.spec_path)
    try:
        folder = unit.read(job.folder)
        result = campaign.judge_unit(folder, spec, job.calibration)
    except UnitError as e:
        return Judged(job.folder, refused=str(e))
    unsigned = None
    if job.certificate:
        from accept.certificate import dossier_of, render  # loads reportlab and matplotlib: only when wanted

        unsigned = render(dossier_of(result, spec, folder.path, job.operator))
    return Judged(job.folder, result.to_json(), unsigned)
