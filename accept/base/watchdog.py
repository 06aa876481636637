"""A limit of time on work with files from outside: one file of a supplier never stops the line."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

PARSING_S = 60.0  # for reading a file from outside; the largest certificate takes some seconds
JUDGING_S = 1800.0  # for judging one unit, its gap analysis included; the longest recorded one takes two minutes
VARIABLE = "ACCEPT_UNIT_S"


class TimeLimitExceeded(BaseException):
    """The work was stopped. No `Exception`: what catches every fault of a file's content lets this one through."""


def judging_s() -> float:
    """Return how long judging one unit may take: the declared limit, or what ACCEPT_UNIT_S says instead [s]."""
    try:
        return max(1.0, float(os.environ.get(VARIABLE, JUDGING_S)))
    except ValueError:
        return JUDGING_S


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Yield stop what runs inside after so many seconds, with TimeLimitExceeded.

    It takes a signal, which only the main thread receives, and which Windows does not know: elsewhere there is no
    limit, and the bounds on the size of what is read have to do."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise TimeLimitExceeded

    before = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, seconds)
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
