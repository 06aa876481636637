"""Errors of the store, in the operator's words."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from specs.distribution import install
from specs.errors import AcceptError

OTHER_PLACE = "make it writable, or set ACCEPT_HOME to a folder that is"

_CAUSES = {
    "SQLITE_FULL": "the disk is full; the event was not stored; free some space and run again",
    "SQLITE_READONLY": f"cannot be written, the file or its folder is read-only; {OTHER_PLACE}",
    "SQLITE_CANTOPEN": f"cannot be opened or made; {OTHER_PLACE}",
    "SQLITE_PERM": f"access is denied; {OTHER_PLACE}",
    "SQLITE_BUSY": "another program holds it locked; close that program and run again",
    "SQLITE_LOCKED": "another program holds it locked; close that program and run again",
    "SQLITE_NOTADB": "is not an SQLite database; move the file away, or set ACCEPT_HOME to another folder",
    "SQLITE_CORRUPT": "is damaged: its SQLite file is malformed; restore it from a backup",
    "SQLITE_IOERR": "the disk refuses to read or write it (failing, full or gone)",
}


class StoreError(AcceptError, RuntimeError):
    """The store cannot be used; the text states its name, the reason and the remedy."""


class Overtaken(StoreError):
    """Another program stored an event about the unit since the writer read them: nothing was stored. Read again."""


@contextmanager
def reported(where: str) -> Iterator[None]:
    """Turn every error of the database or its file into a StoreError about `where`."""
    try:
        yield
    except (SQLAlchemyError, sqlite3.Error, ImportError, OSError) as e:
        raise StoreError(f"{where}: {_reason(e)}") from e


def _reason(error: Exception) -> str:
    cause = error.orig if isinstance(error, DBAPIError) and error.orig is not None else error
    name = getattr(cause, "sqlite_errorname", None) or ""
    if getattr(cause, "sqlstate", None) == "55P03":  # PostgreSQL: lock_timeout
        return _CAUSES["SQLITE_LOCKED"]
    for prefix, words in _CAUSES.items():
        if name.startswith(prefix):
            return words
    if isinstance(cause, ImportError):
        return f"its database driver is not installed ({cause}); for PostgreSQL: {install('postgres')}"
    lines = str(cause).strip().splitlines() or [type(cause).__name__]
    return lines[0]
