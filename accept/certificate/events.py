"""What signing a certificate leaves in the event store."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

from accept.store import Event, Store


def signed(
    store: Store,
    serial: str,
    path: Path,
    content: bytes,
    role: str,
    *,
    who: str,
    spec: str = "",
    disposition: Mapping[str, str] | None = None,
) -> Event:
    """Store that a certificate was signed in a role and written to `path`, with the disposition of a unit that was not
    accepted. Raises StoreError."""
    what = {"path": str(path.resolve()), "sha256": hashlib.sha256(content).hexdigest(), "role": role}
    decided = {} if disposition is None else {"disposition": disposition}
    return store.append("certificate_signed", serial, what | decided, who=who, spec=spec)
