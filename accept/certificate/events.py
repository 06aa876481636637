"""The event that a signature adds to the store."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from accept.store import Event, Store
from accept.store.payloads import CertificateSigned, Payload


def signed(
    store: Store,
    serial: str,
    path: Path,
    content: bytes,
    role: str,
    *,
    who: str,
    spec: str = "",
    about: Sequence[Payload] = (),
    after: int | None = None,
    **stated: Any,
) -> Event:
    """Store that a certificate was signed in a role for `path`, behind the events that it is about. stated: further
    fields of `CertificateSigned`. after: as in `Store.write`. Raises StoreError, Overtaken."""
    event = CertificateSigned(str(path.resolve()), hashlib.sha256(content).hexdigest(), role, **stated)
    return store.write_all([*about, event], serial, who=who, spec=spec, after=after)[-1]
