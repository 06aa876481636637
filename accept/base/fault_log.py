"""The log of faults: ACCEPT_HOME/log/accept.log, which rotates. Errors that a user can mend are said, not logged."""

import logging
import sys
import threading
from importlib import metadata
from logging.handlers import RotatingFileHandler
from pathlib import Path
from types import TracebackType

NAME = "accept.log"
PLEASE_REPORT = f"please report it with ACCEPT_HOME/log/{NAME}"
MAX_BYTES, KEPT = 1_000_000, 5  # some 200 faults a file
LOCK_S = 5.0  # a fault takes milliseconds to write: whoever holds the lock longer has died or hangs
_FORMAT = "%(asctime)s %(process)d accept %(version)s: %(message)s"


def log_file() -> Path:
    """Where faults are written. Raises HomeError."""
    from accept.base.home import home  # late, as below: `accept --help` has no fault to log, and stays quick

    return home() / "log" / NAME


def log_fault(doing: str, fault: BaseException) -> None:
    """Append what was being done and the fault's traceback. Several processes may: the file is open while one is
    written, under a lock. Never raises: where the log cannot be written, the fault goes to stderr.
    """
    info = (type(fault), fault, fault.__traceback__)
    record = logging.LogRecord("accept", logging.ERROR, __file__, 0, doing, None, info)
    record.version = metadata.version("accept")
    formatter = logging.Formatter(_FORMAT)
    try:
        _append(record, formatter)
    except (OSError, RuntimeError) as e:
        print(f"accept: the log cannot be written ({e})\n{formatter.format(record)}", file=sys.stderr)


def _append(record: logging.LogRecord, formatter: logging.Formatter) -> None:
    """Raises OSError, of which a lock's timeout is one, and HomeError, a RuntimeError."""
    from filelock import FileLock

    path = log_file()
    path.parent.mkdir(mode=0o700, exist_ok=True)
    with FileLock(path.with_suffix(".lock"), timeout=LOCK_S):
        handler = _RotatingFile(path, maxBytes=MAX_BYTES, backupCount=KEPT, encoding="utf-8")
        handler.setFormatter(formatter)
        try:
            handler.emit(record)
        finally:
            handler.close()


class _RotatingFile(RotatingFileHandler):
    def handleError(self, _: logging.LogRecord) -> None:
        """A full disk is raised to `log_fault`, which has another place."""
        raise


def log_crashes() -> None:
    """From now on whatever nobody caught, in any thread, is logged before it is shown as ever."""
    shown, thread_shown = sys.excepthook, threading.excepthook

    def crashed(kind: type[BaseException], fault: BaseException, trace: TracebackType | None) -> None:
        if issubclass(kind, Exception):
            log_fault("the program crashed", fault)
        shown(kind, fault, trace)

    def thread_crashed(said: threading.ExceptHookArgs) -> None:
        if isinstance(said.exc_value, Exception):
            log_fault(f"thread {said.thread.name if said.thread else ''} crashed", said.exc_value)
        thread_shown(said)

    sys.excepthook, threading.excepthook = crashed, thread_crashed
