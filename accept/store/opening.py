"""Opening a store: its place, whether this program knows its tables, and the place of its anchor and its seal."""

import hashlib
import logging
import os
import stat
from functools import cache
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, make_url, select, update
from sqlalchemy.exc import SQLAlchemyError

from accept.base.home import HomeError, home
from accept.base.plain_text import without_secrets
from accept.store import indexes, tables
from accept.store.engine import appending, make_engine, reported, snapshot
from accept.store.event import StoreError
from accept.store.seal import Anchor, Sealer
from accept.store.store import Store

log = logging.getLogger("accept.store")
BENCH_KEY, DATABASE = "bench.key", "store.sqlite"  # in the bench's folder


def open_store(
    url: str | None = None,
    *,
    timeout_s: float = 20.0,
    check: bool = True,
    make: bool = True,
    bench: Path | None = None,
) -> Store:
    """Open the store, made if absent: `url`, else `ACCEPT_STORE_URL`, else `store.sqlite` in the bench's folder.

    url : an SQLAlchemy URL. timeout_s : how long to wait for another program's lock [s]. check : the chain must be
    unbroken (`Store.verify`); False only to inspect a damaged store. make : make what is absent, indexes too; if False
    nothing is written, and only the events can be read. bench : folder of the bench whose key signs seal and heads,
    else the bench's own. Raises StoreError if the store cannot be opened or made, was written by a newer version, or
    fails its integrity check."""
    chosen = url or os.environ.get("ACCEPT_STORE_URL") or None
    parsed = _parsed(chosen) if chosen else URL.create("sqlite", database=str(_default_path()))
    shown = parsed.render_as_string(hide_password=True)
    where = str(parsed.database) if parsed.get_backend_name() == "sqlite" else without_secrets(shown)
    with reported(where):
        engine = make_engine(parsed, timeout_s)
        try:
            made = _prepare(engine, where, make)
        except BaseException:
            engine.dispose()
            raise
    if chosen is None:
        _warn_of_open_home(Path(str(parsed.database)).parent)
    anchor = Anchor.beside(parsed)
    file = Path(str(parsed.database)) if anchor else None
    sealer = _sealer(parsed, file, bench)
    if file is None and sealer is not None:  # of a server this bench keeps the last event that it wrote
        anchor = Anchor(sealer.file.with_suffix(".head"))
    store = Store(engine, where, anchor, sealer, file)
    log.info("store %s opened", where)
    if check:
        try:
            store.verify(whole=made)
        except BaseException:
            engine.dispose()
            raise
    return store


@cache
def _warn_of_open_home(folder: Path) -> None:
    """Warn, once, that other users of this machine can replace the files in the bench's folder."""
    mode = folder.stat().st_mode
    if os.name == "posix" and mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
        from accept.base.console import say  # loads rich: only for a warning

        say(f"warning: {folder}: every user of this machine can replace keys and store there; chmod o-w {folder}")


def _sealer(url: URL, file: Path | None, bench: Path | None) -> Sealer | None:
    """Return the sealer, None in memory. Its seal lies in the bench's folder, where the database may not lie."""
    place = bench or home()
    if file is not None and file.resolve().parent == place.resolve():
        return Sealer(file.with_suffix(".seal"), place / BENCH_KEY)
    if file is None and url.get_backend_name() == "sqlite":
        return None
    where = file.resolve() if file is not None else f"{url.host}:{url.port}/{url.database}?{url.query}"
    named = hashlib.sha256(str(where).encode()).hexdigest()[:16]
    return Sealer(place / f"store-{named}.seal", place / BENCH_KEY)


def _default_path() -> Path:
    try:
        return home() / DATABASE
    except HomeError as e:
        raise StoreError(str(e)) from e


def _parsed(address: str) -> URL:
    """Raise StoreError for an invalid address of a database. The text is not repeated: it may contain a password."""
    try:
        url = make_url(address)
        url.get_backend_name()
        if "@" in (url.host or ""):
            raise ValueError("@ stands in the host")
    except (SQLAlchemyError, ValueError) as e:
        form = "postgresql://USER:PASSWORD@HOST:PORT/DATABASE, '@' and ':' in a password as %40 and %3A"
        raise StoreError(f"ACCEPT_STORE_URL is no address of a database: expected {form}") from e
    return url


def _prepare(engine: Engine, where: str, make: bool) -> bool:
    """Make absent tables and indexes in one transaction; return whether any was absent."""
    with snapshot(engine) as connection:
        if _is_whole(connection, where) or not make:
            return False
        new = not tables.present(connection)
    earlier = "its indexes are to be made, as once for each store of an earlier accept"
    with reported(where if new else f"{where}: {earlier}"), appending(engine) as connection:
        if not _is_whole(connection, where):  # another program may have made it meanwhile
            tables.make_tables(connection)
            indexes.build(connection)
            earlier_ones = tables.head.c.store_schema == tables.EARLIER
            connection.execute(update(tables.head).where(earlier_ones).values(store_schema=tables.SCHEMA))
    return True


def _is_whole(connection: Connection, where: str) -> bool:
    """Return whether nothing needs to be made. Raises StoreError if a newer accept wrote the store."""
    have = tables.present(connection)
    schema = connection.scalar(select(tables.head.c.store_schema)) if "head" in have else None
    if schema not in (None, tables.SCHEMA, tables.EARLIER):
        raise StoreError(f"{where}: has schema {schema}, this accept knows {tables.SCHEMA}; use the newer accept")
    return have == tables.NAMES and schema != tables.EARLIER
