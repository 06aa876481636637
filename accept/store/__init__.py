"""The append-only event store: each event of the bench with its time, person, spec and code.

    with open_store() as store:  # of ACCEPT_STORE_URL, else in the bench's folder
        event = store.write(payload, serial, who="Ann")  # chained, sealed and on the disk when this returns
        state = fold(store.events(subject=serial))  # what the events say of the unit by now
        store.check()  # the first event of the whole chain that is altered or missing, or None

Kinds of events, with their payloads, are declared in `accept.store.payloads`. Errors are `StoreError`. The database is
loaded when a store is opened: who reads events or folds them needs none."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from accept.store.backup import back_up, restore
    from accept.store.chain import START, StoreHead
    from accept.store.event import Event, NewEvent, Overtaken, StoreError
    from accept.store.folding import TECHNICIAN, Signature, UnitState, after, fold, undone
    from accept.store.indexes import TABLE
    from accept.store.instrument_recall import touched
    from accept.store.opening import BENCH_KEY, DATABASE, open_store
    from accept.store.seal import Sealer, SignedHead, bench_of, head_problem, own_key
    from accept.store.store import Store, check_lines
else:
    __getattr__ = door(__name__)
