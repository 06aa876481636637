"""The report of `accept store check`."""

from accept.store.chain import StoreHead
from accept.store.store import END_NOT_KEPT, Store

NOT_SEEN = (
    "not seen here: events that were rewritten together with all hashes after them, by a person with the bench's key; "
    "--head FILE compares with a head or a certificate that was kept elsewhere"
)


def check_lines(store: Store, exported: StoreHead | None = None) -> tuple[bool, list[str]]:
    """Return whether the store is unbroken, and the lines that state so or name the first broken place, and every place
    where the clock was set back. Raises StoreError."""
    kept = store.end_is_kept or exported is not None  # asked first: a check seals the events it saw
    problem = store.check(exported)
    if problem is not None:
        return False, [f"store: {store.where}: broken", str(problem)]
    head = store.head()
    against = f", and holds the exported event {exported.seq}" if exported else ""
    unkept = [] if kept else [f"warning: {END_NOT_KEPT}"]
    set_back = [
        f"warning: {name} was stored {seconds / 60:.0f} min before the event that it follows: the clock was set back"
        for name, seconds in store.clock_set_back()
    ]
    unseen = [] if exported else [NOT_SEEN]
    return True, [f"store: {head.seq} events, head {head.hash}: unbroken{against}", *unseen, *unkept, *set_back]
