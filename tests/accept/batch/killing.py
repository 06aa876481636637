"""SIGKILL of a real process at a chosen point of its work."""

import multiprocessing
import os
import signal
import sqlite3
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event
from sqlalchemy.pool import Pool

TIMEOUT_S = 60.0  # for a process to start or to end on a crowded machine
fork = multiprocessing.get_context("fork")


class Points:
    """Counts the points that a process passes and kills it at the chosen one."""

    def __init__(self, at: int | None) -> None:
        self.passed, self.at = 0, at

    def __call__(self, *_: Any) -> None:
        self.passed += 1
        if self.passed == self.at:
            os.kill(os.getpid(), signal.SIGKILL)

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def wrapped(*args: Any, **kwargs: Any) -> Any:
            self()
            result = function(*args, **kwargs)
            self()
            return result

        return wrapped

    def install(self) -> None:
        def trace(connection: sqlite3.Connection, _record: Any) -> None:
            connection.set_trace_callback(self)

        event.listen(Pool, "connect", trace)
        event.listen(Engine, "after_cursor_execute", self.after)
        os.fsync, os.replace = self.around(os.fsync), self.around(os.replace)

    def after(self, conn: Any, cursor: Any, statement: Any, parameters: Any, context: Any, executemany: Any) -> None:
        self()


def until(condition: Callable[[], bool]) -> bool:
    """Whether it came true in time."""
    deadline = time.monotonic() + TIMEOUT_S
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


def gone(pid: int) -> bool:
    """No such process, or one that only waits to be buried, with all its threads."""
    try:
        os.kill(pid, 0)
        threads = len(list(Path(f"/proc/{pid}/task").iterdir()))
        return threads == 1 and Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (ProcessLookupError, FileNotFoundError):
        return True
