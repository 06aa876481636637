"""The log of faults: ACCEPT_HOME/log/accept.log, which rotates. Errors that a user can mend are printed, not logged."""

import logging
import sys
import traceback
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any

from filelock import FileLock

from accept.base.home import home
from accept.base.plain_text import lines, one_line, without_secrets
from accept.base.version import version

NAME = "accept.log"
PLEASE_REPORT = f"please report it with ACCEPT_HOME/log/{NAME}"
MAX_BYTES, KEPT = 1_000_000, 5  # some 200 faults a file
LOCK_S = 5.0  # a fault takes milliseconds to write: a holder of the lock beyond this has died or hangs
_FORMAT = "%(asctime)s %(process)d accept %(version)s: %(message)s"


def log_file() -> Path:
    """Return the file in which faults are logged. Raises HomeError."""
    return home() / "log" / NAME


def log_fault(doing: str, fault: BaseException) -> None:
    """Append the activity and the fault's traceback. Several processes may do so: the file is open while one is
    written, under a lock. Never raises: if the log cannot be written, the fault goes to stderr."""
    info = (type(fault), fault, fault.__traceback__)
    record = logging.LogRecord("accept", logging.ERROR, __file__, 0, doing, None, info)
    record.version = version()
    formatter = _Plain(_FORMAT)
    try:
        _append(record, formatter)
    except (OSError, RuntimeError) as e:
        print(f"accept: the log cannot be written ({e})\n{formatter.format(record)}", file=sys.stderr)


def _append(record: logging.LogRecord, formatter: logging.Formatter) -> None:
    """Raise OSError, of which a lock's timeout is one, and HomeError, a RuntimeError."""
    path = log_file()
    path.parent.mkdir(mode=0o700, exist_ok=True)
    with FileLock(path.with_suffix(".lock"), timeout=LOCK_S):
        handler = _RotatingFile(path, maxBytes=MAX_BYTES, backupCount=KEPT, encoding="utf-8")
        handler.setFormatter(formatter)
        try:
            handler.emit(record)
        finally:
            handler.close()


class _Plain(logging.Formatter):
    """An error may quote a file's name or content: none writes a line of its own or moves the cursor."""

    def format(self, record: logging.LogRecord) -> str:
        return lines(without_secrets(super().format(record)))

    def formatException(self, info: Any) -> str:
        kind, fault, trace = info
        words = one_line(str(fault))
        return f"{''.join(traceback.format_tb(trace))}{kind.__name__}: {words}"


class _RotatingFile(RotatingFileHandler):
    def handleError(self, _: logging.LogRecord) -> None:
        """Raise errors of writing, such as a full disk: `log_fault` then uses stderr."""
        raise
