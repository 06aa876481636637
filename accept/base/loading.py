"""The start of a command. Loaded objects stay to the end; walking them again and again in search of garbage takes a
sixth of the time of a short command. The log of faults is only imported for a fault: `accept --help` stays quick."""

import gc
import os
import sys
import threading
from types import TracebackType

SAFE_PATH = "PYTHONSAFEPATH"  # set: a process imports nothing from the folder that it is started in
_USUAL = gc.get_threshold()
_LOADING = (500_000, *_USUAL[1:])  # objects made until it looks: more than any command loads
_MANY = (20_000, *_USUAL[1:])  # of many runs: 3 % of their time


def import_nothing_from_here() -> None:
    """Let no process that is started from now on import from its working folder, whatever starts it."""
    os.environ[SAFE_PATH] = "1"


def begin() -> None:
    """Stop garbage collection while the program loads: hardly anything is garbage."""
    gc.set_threshold(*_LOADING)


def done() -> None:
    """Resume garbage collection, without the loaded objects. Does nothing without `begin`."""
    if gc.get_threshold() == _LOADING:
        gc.freeze()
        gc.set_threshold(*_USUAL)


def keep_loaded() -> None:
    """Exclude all present objects from garbage collection: what many runs share stays until the program ends. What they
    make from then on is looked through more seldom: hardly any of it is garbage in circles."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(*_MANY)


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
