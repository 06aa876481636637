"""A limit of time on work with files from outside: one file of a supplier never stops the line."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

JUDGING_S = 1800.0  # for judging one unit, its gap analysis included; the longest recorded one takes two minutes
VARIABLE = "ACCEPT_UNIT_S"


class TimeLimitExceeded(BaseException):
    """The work was stopped. Not an `Exception`, so that handlers of faults in a file's content let it through."""


def judging_s() -> float:
    """Return the time limit for judging one unit [s]: the declared one, or that of ACCEPT_UNIT_S."""
    try:
        return max(1.0, min(1e8, float(os.environ.get(VARIABLE, JUDGING_S))))  # a timer takes no infinity
    except ValueError:
        return JUDGING_S


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Stop the block with TimeLimitExceeded after so many seconds.

    It needs a signal, which only the main thread receives and Windows lacks. Elsewhere there is no limit, and the
    bounds on the size of inputs must suffice."""
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
