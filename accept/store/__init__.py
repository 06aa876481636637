"""The append-only event store: what the bench did, when, by whom, against which spec and with which code."""

from accept.store.chain import Head, Problem
from accept.store.errors import StoreError
from accept.store.event import Entry, Event
from accept.store.fold import BenchState, Certificate, Signature, UnitState, fold
from accept.store.report import check_lines
from accept.store.store import Store, open_store

__all__ = [
    "BenchState",
    "Certificate",
    "Entry",
    "Event",
    "Head",
    "Problem",
    "Signature",
    "Store",
    "StoreError",
    "UnitState",
    "check_lines",
    "fold",
    "open_store",
]
