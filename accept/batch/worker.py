"""Judging one unit, here or in a process of its own: what goes in and what comes back are plain data."""

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from accept.certificate.content import ContentError
from accept.certificate.examine import JudgedUnit, examine
from accept.units.unit_folder import UnitError, UnitFolder
from specs.spec import Spec

QUIET_S = 2.0  # what takes less needs no words

Outcome = JudgedUnit | str  # a unit, or why it was refused
Job = partial[Outcome]


def judge(unit: UnitFolder, spec: Spec, operator: str, **wanted: Any) -> Outcome:
    """`examine` for a batch, which goes on with the next unit where one cannot be judged."""
    try:
        return examine(unit, spec, operator, say=_progress(unit.serial), **wanted)
    except (UnitError, ContentError) as e:
        return str(e)


def _progress(serial: str) -> Callable[[str], None]:
    """Says on stderr what a unit is waiting for, from a worker too, but no more often than a person reads."""
    said = [time.monotonic()]

    def say(words: str) -> None:
        if time.monotonic() - said[0] > QUIET_S:
            said[0] = time.monotonic()
            print(f"{serial}: {words}", file=sys.stderr, flush=True)

    return say
