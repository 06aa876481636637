"""Work for another process, importable there: what `accept.workflow.worker.process` is tested with."""

import os
import time
from collections.abc import Callable
from pathlib import Path

Say = Callable[[str], None]


class Refused(ValueError):
    """What a bench can have."""


def twice(say: Say, x: float) -> float:
    say("looking")
    say("doubling")
    return 2 * x


def number(say: Say) -> int:
    """Of the process that does the work."""
    return os.getpid()


def prints(say: Say, x: float) -> float:
    print("this would spoil the answer", flush=True)
    os.write(1, b"and this")
    return x


def refuse(say: Say) -> None:
    raise Refused("no band is\nmeasured")


def break_down(say: Say) -> None:
    raise ZeroDivisionError("bug")


def die(say: Say) -> None:
    os.kill(os.getpid(), 9)


def wait_for_ever(say: Say, pid_file: Path) -> None:
    pid_file.write_text(str(os.getpid()))
    say("waiting")
    while True:
        time.sleep(0.05)
