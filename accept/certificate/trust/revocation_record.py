"""The authority's list of revoked keys as the store has it, and whether the list beside the keys is the newest.

Revoking a key is an event with the list in full, and the list only grows. A list that is missing, or older than the one
in the store, was removed or put back.
"""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from cryptography import x509
from sqlalchemy import URL

from accept.base.home import home
from accept.certificate.trust import authority
from accept.certificate.trust.revocation import RevocationError, RevocationList, parsed, read_list
from accept.store import DATABASE, Event, Store, open_store
from accept.store.payloads import BenchStated, KeysRevoked

REMEDY = (
    "copy the newest one there, from the bench or from the authority, "
    "which writes it again with the next accept keys issue, renew or revoke"
)


def store_is_there(bench: Path | None = None) -> bool:
    """Return whether a bench has a store that can be asked, without making one."""
    return bool(os.environ.get("ACCEPT_STORE_URL")) or ((bench or home()) / DATABASE).exists()


def store_of(bench: Path) -> list[str]:
    """Return the URL of a bench's store, none if the environment names it."""
    return [] if os.environ.get("ACCEPT_STORE_URL") else [str(URL.create("sqlite", database=str(bench / DATABASE)))]


def stored_lists(events: Iterable[Event], ca: x509.Certificate) -> Iterator[tuple[Event, RevocationList]]:
    """Yield the lists that an authority signed among events of a store, in order. Raises StoreError."""
    for event in events:
        if event.what == KeysRevoked.KIND:
            try:
                yield event, parsed(KeysRevoked.of(event).crl.encode(), event.name, ca)
            except RevocationError:
                continue  # of another authority, or not signed


def _newest(store: Store, ca: x509.Certificate) -> RevocationList | None:
    lists = (listed for _, listed in stored_lists(store.events("", KeysRevoked.KIND), ca))
    return max(lists, key=lambda one: one.number, default=None)


def newest_stored(bench: Path, ca: x509.Certificate) -> tuple[RevocationList | None, bool]:
    """Return the newest list of an authority in a bench's store, and whether the bench ever stated a list there. The
    chain is not walked: a command that signs opens the store anyway. Raises StoreError."""
    if not store_is_there(bench):
        return None, False
    with open_store(*store_of(bench), check=False, make=False, bench=bench) as store:
        if not store.is_made:
            return None, False
        newest = _newest(store, ca)
        stated = any(BenchStated.of(event).crl for event in store.events("", BenchStated.KIND))
    return newest, stated or newest is not None


def record(store: Store, ca: x509.Certificate, listed: RevocationList, who: str, reason: str = "") -> None:
    """Store a list in full, unless it is the newest that the store has. Raises StoreError."""
    newest = _newest(store, ca)
    if listed.entries and (newest is None or newest.lacks(listed)):
        store.write(KeysRevoked(authority.fingerprint(ca), listed.number, listed.text, reason), who=who)


def fault(listed: RevocationList | None, path: Path, known: RevocationList | None, where: str) -> str:
    """Return why the list beside an authority's certificate is not to be relied on, "" if nothing speaks against it.
    path: its file; known: another list of the authority; where: that it comes from."""
    if listed is None:
        return f"no list of revoked keys was looked at: {path} is not there; {REMEDY}"
    if listed.from_the_future:
        return f"the list of revoked keys, {path}, is dated {listed.dated:%Y-%m-%d %H:%M} UTC, in the future; {REMEDY}"
    if known is not None and listed.lacks(known):
        return (
            f"the list of revoked keys, {path}, has number {listed.number} and is older than {where}, "
            f"number {known.number}; {REMEDY}"
        )
    return ""


def fault_here(bench: Path, path: Path, ca: x509.Certificate) -> tuple[str, bool]:
    """Return why a bench must not sign with its authority's list, "" if it may, and whether it never had a list: then
    its authority is of a version that wrote none before a key was revoked. Raises RevocationError, StoreError."""
    listed = read_list(path, ca)
    newest, stated = newest_stored(bench, ca)
    never = listed is None and not stated and not authority.promises_list(ca)
    return fault(listed, path, newest, "the one in the store"), never
