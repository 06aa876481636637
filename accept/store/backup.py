"""Backup: a store copied whole, from any database, and restored."""

import json
import os
from collections.abc import Iterable
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy import Connection, insert, update

from accept.base.atomic_files import write_atomic
from accept.store import indexes, tables
from accept.store.chain import START, StoreHead
from accept.store.engine import appending, reported
from accept.store.event import Event, StoreError
from accept.store.opening import open_store
from accept.store.store import Store
from specs.files import json_of

_AT_ONCE = 500  # events written in one statement


def back_up(store: Store, file: Path) -> StoreHead:
    """Copy every event into a new SQLite file, and the signed head beside it (`FILE.head.json`); returns the head.

    Raises StoreError, also if the file exists already or the store's integrity check fails."""
    if file.exists():
        raise StoreError(f"{file}: is there already; a backup replaces nothing")
    part = file.with_name(f".{file.name}.part")
    part.unlink(missing_ok=True)
    with open_store(f"sqlite:///{part}", check=False) as copy:
        head = write_events(copy, store.events())
        if problem := copy.check():
            raise StoreError(f"{part}: the copy does not hold: {problem}")
    part.with_suffix(".head").unlink(missing_ok=True)
    _forget(copy)
    with reported(str(file)):
        os.replace(part, file)
        signed = store.signed_head()
        stated = signed and signed.to_json()
        write_atomic(file.with_name(f"{file.name}.head.json"), json.dumps(stated, indent=1).encode() + b"\n")
    return head


def restore(file: Path, target: Path) -> tuple[StoreHead, Path | None]:
    """Make a backup the store of this bench; return its head and the new path of the replaced store. The backup itself
    is only read.

    Raises StoreError, with nothing changed, if the backup's integrity check fails."""
    if not file.is_file():
        raise StoreError(f"{file}: there is no such backup")
    kept = _kept_head(file)
    with reported(str(file)):
        part = target.with_name(f".{target.name}.restored")
        part.unlink(missing_ok=True)
    with (
        open_store(f"sqlite:///{file}", check=False, make=False) as backup,
        open_store(f"sqlite:///{part}", check=False) as copy,
    ):
        head = write_events(copy, backup.events())
        if problem := copy.check(kept):
            raise StoreError(f"{file}: does not hold: {problem}; nothing was restored")
    with reported(str(target)):
        aside = _set_aside(target)
        if part.with_suffix(".head").exists():
            os.replace(part.with_suffix(".head"), target.with_suffix(".head"))
        os.replace(part, target)
    with open_store(f"sqlite:///{target}", check=False, make=False) as restored:
        _forget(copy)
    _forget(restored)
    return head, aside


def write_events(store: Store, events: Iterable[Event]) -> StoreHead:
    """Copy events unchanged into an empty store. Raises StoreError if it is not empty."""
    if store.head() != START:
        raise StoreError(f"{store.where}: holds events already; a store is copied into an empty one")
    head, held = START, list[Event]()
    with reported(store.where), appending(store.engine) as connection:
        for event in events:
            held.append(event)
            head = StoreHead(event.seq, event.hash)
            if len(held) == _AT_ONCE:
                _write(connection, held)
                held.clear()
        if held:
            _write(connection, held)
        connection.execute(update(tables.head).where(tables.head.c.id == 1).values(seq=head.seq, hash=head.hash))
    store.keep_head(head)
    return head


def _write(connection: Connection, events: list[Event]) -> None:
    connection.execute(insert(tables.events), [asdict(one) for one in events])
    indexes.add(connection, events)


def _forget(store: Store) -> None:
    """Remove what this machine saw of a store that is closed."""
    if store.sealer is not None:
        store.sealer.file.unlink(missing_ok=True)


def _kept_head(file: Path) -> StoreHead | None:
    beside = file.with_name(f"{file.name}.head.json")
    try:
        found = json_of(beside.read_bytes()) if beside.is_file() else None
        return None if found is None else StoreHead.parse(f"{found['seq']} {found['hash']}")
    except (OSError, ValueError, KeyError, TypeError) as e:
        raise StoreError(f"{beside}: is no exported head ({e})") from e


def _set_aside(target: Path) -> Path | None:
    """Rename the present store and return its new path, None if there was no store. It is never deleted."""
    if not target.exists():
        return None
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S")
    aside = target.with_name(f"{target.stem}-replaced-{stamp}{target.suffix}")
    for suffix in ("-wal", "-shm"):
        old = target.with_name(f"{target.name}{suffix}")
        if old.exists():
            os.replace(old, aside.with_name(f"{aside.name}{suffix}"))
    for suffix in (".head", ".seal"):
        if target.with_suffix(suffix).exists():
            os.replace(target.with_suffix(suffix), aside.with_suffix(suffix))
    os.replace(target, aside)
    return aside
