"""The append-only event store: each event of the bench with its time, person, spec and code."""

from accept.store.chain import ChainBreak, StoreHead
from accept.store.errors import StoreError
from accept.store.event import Event, NewEvent
from accept.store.fold import Certificate, Signature, UnitState, fold
from accept.store.opening import open_store
from accept.store.report import check_lines
from accept.store.seal import SignedHead
from accept.store.store import Store

__all__ = [
    "Certificate",
    "ChainBreak",
    "Event",
    "NewEvent",
    "Signature",
    "SignedHead",
    "Store",
    "StoreError",
    "StoreHead",
    "UnitState",
    "check_lines",
    "fold",
    "open_store",
]
