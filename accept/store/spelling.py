"""Serials that differ in capitals only: a file system that takes them for one lets their certificates and folders
overwrite each other."""

from sqlalchemy import func, select

from accept.store import tables
from accept.store.engine import snapshot
from accept.store.errors import reported
from accept.store.store import Store

NAMING = ("unit_judged", "attempt_started")  # the events that bring a unit into the store


def spelling_key(serial: str) -> str:
    """What two such serials share. A serial is ASCII (`accept.units.unit_folder`): no letter has two forms."""
    return serial.casefold()


def mistaken_for(serial: str, known: str) -> str:
    """Why a serial is refused."""
    return (
        f"serial = '{serial}' differs from '{known}', which the bench's store knows, in capitals only; "
        "some file systems take both for one, and the certificates would overwrite each other"
    )


def other_spelling(store: Store, serial: str) -> str | None:
    """The serial in the store that a new one would be mistaken for; None for one that the store knows as it is. Raises
    StoreError."""
    subject, what = tables.events.c.subject, tables.events.c.what
    asked = select(subject).where(func.lower(subject) == func.lower(serial), what.in_(NAMING)).distinct()
    with reported(store.where), snapshot(store.engine) as connection:
        alike = set(connection.scalars(asked))
    return None if serial in alike else min(alike, default=None)
