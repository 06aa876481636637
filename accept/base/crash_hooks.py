"""Logging of uncaught errors before they are shown. The log is only imported then: `accept --help` stays quick."""

import sys
import threading
from types import TracebackType


def log_crashes() -> None:
    """Log crashes from now on, in any thread. An interrupt is not a crash."""
    shown, thread_shown = sys.excepthook, threading.excepthook

    def crashed(kind: type[BaseException], fault: BaseException, trace: TracebackType | None) -> None:
        _log("the program crashed", fault)
        shown(kind, fault, trace)

    def thread_crashed(said: threading.ExceptHookArgs) -> None:
        _log(f"thread {said.thread.name if said.thread else ''} crashed", said.exc_value)
        thread_shown(said)

    sys.excepthook, threading.excepthook = crashed, thread_crashed


def _log(what: str, fault: BaseException | None) -> None:
    if isinstance(fault, Exception):
        from accept.base.fault_log import log_fault

        log_fault(what, fault)
