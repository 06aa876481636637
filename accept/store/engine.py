"""Connections to the database: the only module that distinguishes one kind of database from another."""

import logging
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from sqlalchemy import URL, Connection, Engine, create_engine, event, func, select, text
from sqlalchemy.exc import DBAPIError, OperationalError, SQLAlchemyError

from accept.store.event import StoreError
from specs.distribution import install

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
_LOCK = 0x61636365  # PostgreSQL advisory lock of the appends; "acce"
RECONNECT_S = 30.0  # how long a server may be away while a program works: a restart takes seconds
SILENT_S = 15  # the server aborts a transaction that is silent for so long
_AWAY = ("08", "57P01", "57P02", "57P03")  # of SQLSTATE: connection lost, server shuts down, crashed, starts

T = TypeVar("T")

# What the pool logs about a Ctrl-C in mid-reset goes to the program's logging if that was set up, else nowhere: Python
# would print it with a traceback. The interrupt itself is raised all the same.
logging.getLogger("sqlalchemy.pool").addHandler(logging.NullHandler())


def make_engine(url: URL, timeout_s: float) -> Engine:
    """Return the engine of a store. SQLite gets WAL, synchronous=FULL and a busy timeout [s]."""
    if url.drivername == "postgresql":
        url = url.set(drivername="postgresql+psycopg")
    if url.get_backend_name() != "sqlite":
        return create_engine(url, connect_args=_server_options(url))
    engine = create_engine(url, connect_args={"timeout": timeout_s})
    event.listen(engine, "connect", _prepare(timeout_s))
    event.listen(engine, "begin", _begin)
    return engine


def _server_options(url: URL) -> dict[str, Any]:
    """Return the options of a connection to PostgreSQL. The lock of an append ends when the other programs stop
    waiting, also if the bench that holds it was cut off."""
    if url.get_backend_name() != "postgresql" or "options" in url.query:
        return {}
    limits = f"-c idle_in_transaction_session_timeout={SILENT_S}s -c lock_timeout={RECONNECT_S:.0f}s"
    return {"options": limits, "connect_timeout": 10}


def _prepare(timeout_s: float) -> Callable[[sqlite3.Connection, Any], None]:
    def prepare(connection: sqlite3.Connection, _record: Any) -> None:
        connection.isolation_level = None  # sqlite3 would begin by itself, and too late to lock
        connection.text_factory = _text
        _to_wal(connection, time.monotonic() + timeout_s)
        for pragma in ("synchronous=FULL", "foreign_keys=ON", "trusted_schema=OFF"):
            connection.execute(f"PRAGMA {pragma}")

    return prepare


def _text(raw: bytes) -> str:
    """Return text from bytes. Damaged bytes that are not UTF-8 are kept, so that the check can name the event."""
    return raw.decode("utf-8", "surrogateescape")


def _to_wal(connection: sqlite3.Connection, deadline: float) -> None:
    """Switch to WAL, repeatedly until the deadline: SQLite waits no busy timeout if two programs switch a new file at
    once."""
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
        except sqlite3.OperationalError as e:
            if e.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > deadline:
                raise
            time.sleep(0.01)
        else:
            return


def _begin(connection: Connection) -> None:
    appends = connection.get_execution_options().get("appends", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if appends else "BEGIN")


def has_index(connection: Connection, name: str) -> bool:
    """Return whether an index exists. SQLAlchemy does not see one over an expression in SQLite."""
    if connection.dialect.name == "sqlite":
        asked = text("SELECT count(*) FROM sqlite_master WHERE type = 'index' AND name = :name")
    else:
        asked = text("SELECT count(*) FROM pg_indexes WHERE schemaname = current_schema() AND indexname = :name")
    return bool(connection.scalar(asked, {"name": name}))


def reconnecting(work: Callable[[], T]) -> T:
    """Return the result of `work`, repeated for up to RECONNECT_S if the connection to a server is lost.

    work: one transaction, which must check whether an earlier try was committed after all."""
    deadline = time.monotonic() + RECONNECT_S
    while True:
        try:
            return work()
        except DBAPIError as e:
            if not _away(e) or time.monotonic() > deadline:
                raise
            time.sleep(0.2)


def _away(error: DBAPIError) -> bool:
    """Return whether the error means that a server cannot be reached at present. Never so for SQLite."""
    if isinstance(error.orig, sqlite3.Error):
        return False
    state = getattr(error.orig, "sqlstate", None)
    unreachable = state is None and isinstance(error, OperationalError)  # raised before any SQLSTATE is known
    return error.connection_invalidated or unreachable or (state or "").startswith(_AWAY)


@contextmanager
def appending(engine: Engine) -> Iterator[Connection]:
    """Yield a transaction that excludes all other appends; committed at its end."""
    with engine.connect() as plain:
        connection = plain.execution_options(appends=True)
        with connection.begin():
            if engine.dialect.name == "postgresql":
                connection.execute(select(func.pg_advisory_xact_lock(_LOCK)))
            yield connection


@contextmanager
def snapshot(engine: Engine) -> Iterator[Connection]:
    """Yield a transaction that sees the store as it was at one moment while others append."""
    with engine.connect() as plain:
        level = {"isolation_level": "REPEATABLE READ"} if engine.dialect.name == "postgresql" else {}
        connection = plain.execution_options(**level)
        with connection.begin():
            yield connection


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
