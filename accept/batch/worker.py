"""Judging one unit folder in a process of its own: what goes in and what comes back are plain data."""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accept.gap.attach_to_result import StartModel, explained
from accept.judging import judge_unit
from accept.judging.calibration import Statement
from accept.units import unit_folder
from accept.units.unit_folder import UnitError
from specs import parse

QUIET_S = 2.0  # what takes less needs no words


@dataclass(frozen=True)
class Job:
    """A unit folder, the spec's own bytes (so that every worker judges by the same ones) and what is wanted. start: the
    model that its responses are explained by; out: where the improved one goes."""

    folder: Path
    spec_path: str
    spec_text: str
    operator: str
    certificate: bool
    calibration: Statement | None = None
    start: StartModel | None = None
    out: Path | None = None


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
        folder = unit_folder.read(job.folder)
        result = judge_unit.judge_unit(folder, spec, job.calibration)
        result = explained(result, folder, job.start, _progress(result.serial), job.out)
    except UnitError as e:
        return Judged(job.folder, refused=str(e))
    unsigned = None
    if job.certificate:
        from accept.certificate.content import content_of
        from accept.certificate.document import render  # loads reportlab and matplotlib: only when wanted

        unsigned = render(content_of(result, spec, folder.path, job.operator))
    return Judged(job.folder, result.to_json(), unsigned)


def _progress(serial: str) -> Callable[[str], None]:
    """Says on stderr what a unit is waiting for, from a worker too, but no more often than a person reads."""
    said = [time.monotonic()]

    def say(words: str) -> None:
        if time.monotonic() - said[0] > QUIET_S:
            said[0] = time.monotonic()
            print(f"{serial}: {words}", file=sys.stderr, flush=True)

    return say
