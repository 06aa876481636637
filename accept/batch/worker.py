"""Judging one unit, here, in a process of its own or on another machine: what goes in and what comes back are plain
data."""

import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from accept.base.console import say
from accept.base.worker_process import too_large
from accept.certificate.contents.content import ContentError
from accept.certificate.examine import JudgedUnit, examine
from accept.units.shared_folder import anywhere, not_shared
from accept.units.unit_folder import UnitError, UnitFolder
from specs.spec import Spec

QUIET_S = 2.0  # what takes less needs no words

JudgedOrRefused = JudgedUnit | str  # a unit, or why it was refused
Job = partial[JudgedOrRefused]


def judge(unit: UnitFolder, spec: Spec, operator: str, **wanted: Any) -> JudgedOrRefused:
    """`examine` for a batch, which goes on with the next unit where one cannot be judged."""
    try:
        return examine(unit, spec, operator, say=_progress(unit.serial), **wanted)
    except (UnitError, ContentError) as e:
        return str(e)
    except MemoryError:
        return f"{unit.path}: {too_large()}"


def _progress(serial: str) -> Callable[[str], None]:
    """Says on stderr what a unit is waiting for, from a worker too, but no more often than a person reads."""
    said = [time.monotonic()]

    def seldom(words: str) -> None:
        if time.monotonic() - said[0] > QUIET_S:
            said[0] = time.monotonic()
            say(f"{serial}: {words}")

    return seldom


def for_another(job: Job) -> Job:
    """The job as another machine is handed it."""
    return partial(job.func, anywhere(job.args[0]), *job.args[1:], **job.keywords)


@dataclass(frozen=True, eq=False)
class Returned:
    """What comes back: the outcome, and files that belong beside the results, by their names there."""

    outcome: JudgedOrRefused
    files: Mapping[str, bytes]


def run_far(job: Job) -> Returned:
    """Judge a unit far from who asked."""
    if problem := not_shared(job.args[0]):
        return Returned(problem, {})
    with tempfile.TemporaryDirectory(prefix="accept-") as place:
        outcome = job(out=Path(place))
        files = {p.relative_to(place).as_posix(): p.read_bytes() for p in Path(place).rglob("*") if p.is_file()}
    return Returned(outcome, files)
