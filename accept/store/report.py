"""What `accept store check` prints."""

from accept.store.chain import StoreHead
from accept.store.store import Store


def check_lines(store: Store, exported: StoreHead | None = None) -> tuple[bool, list[str]]:
    """Whether the store is unbroken, and the lines that say so or name the first broken place. Raises StoreError."""
    problem = store.check(exported)
    if problem is not None:
        return False, [f"store: {store.where}: broken", str(problem)]
    head = store.head()
    against = f", and holds the exported event {exported.seq}" if exported else ""
    return True, [f"store: {head.seq} events, head {head.hash}: unbroken{against}"]
