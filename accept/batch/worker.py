"""Judging one unit, here, in a process of its own or on another machine: what goes in and what comes back are plain
data."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from accept.base.console import say
from accept.base.watchdog import TimeLimitExceeded, judging_s, time_limit
from accept.base.worker_process import too_large
from accept.certificate.contents.content import ContentError
from accept.certificate.examine import JudgedUnit, examine
from accept.units.unit_folder import UnitError, UnitFolder
from specs.spec import Spec

QUIET_S = 2.0  # what takes less needs no words

JudgedOrRefused = JudgedUnit | str  # a unit, or why it was refused
Job = partial[JudgedOrRefused]


def judge(unit: UnitFolder, spec: Spec, operator: str, **wanted: Any) -> JudgedOrRefused:
    """`examine` for a batch, which goes on with the next unit where one cannot be judged."""
    limit = judging_s()
    try:
        with time_limit(limit):
            return examine(unit, spec, operator, say=_progress(unit.serial), **wanted)
    except TimeLimitExceeded:
        return f"{unit.path}: judging it took more than {limit:g} s and was stopped (ACCEPT_UNIT_S)"
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
