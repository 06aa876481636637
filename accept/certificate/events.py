"""The event that signing a certificate adds to the store."""

import hashlib
from pathlib import Path

from accept.certificate.contents.disposition import Disposition
from accept.store import Event, Store
from accept.store.fold import TECHNICIAN
from accept.store.payloads import CertificateSigned, Decision


def signed(
    store: Store,
    serial: str,
    path: Path,
    content: bytes,
    role: str,
    *,
    who: str,
    of: bytes = b"",
    spec: str = "",
    disposition: Disposition | None = None,
) -> Event:
    """Store that a certificate was signed in a role and written to `path`. of: the document before a countersignature.
    disposition: of a unit that was not accepted. Raises StoreError."""
    event = CertificateSigned(
        str(path.resolve()),
        hashlib.sha256(content).hexdigest(),
        role,
        disposition=None if disposition is None else Decision(disposition.choice, disposition.reason),
        before=None if role == TECHNICIAN else hashlib.sha256(of).hexdigest(),
    )
    return store.write(event, serial, who=who, spec=spec)
