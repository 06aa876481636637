"""The event that signing a certificate adds to the store."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from accept.certificate.contents.disposition import Disposition
from accept.judging.decisions import Signer, sign_decision
from accept.judging.nonconformance import DISPOSITION, content_of, decided
from accept.store import TECHNICIAN, Event, Store
from accept.store.payloads import CertificateSigned, Decision, Payload


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
    signer: Signer | None = None,
    number: str = "",
    reason: str = "",
    judged: int = 0,
    nonconformances: Sequence[str] = (),
    after: int | None = None,
) -> Event:
    """Store that a certificate was signed in a role for `path`. of: the document before a countersignature.
    disposition: of a unit that was not accepted, which `signer` signs for the store too. reason: why the technician
    signed such a unit, or another certificate of one. judged: the event of the judgement that the technician signed.
    nonconformances: that the document states, about which the disposition is too. after: as in `Store.write`. Raises
    StoreError, Overtaken."""
    before = None if role == TECHNICIAN else hashlib.sha256(of).hexdigest()
    decision, about = None, list[Payload]()
    if disposition is not None:
        decision = Decision(disposition.choice, disposition.reason)
        if signer is not None:
            if nonconformances:
                about.append(decided(store, serial, decision, signer, nonconformances))
            # what is stated is signed too: else it could be given as about what another store has
            stated = content_of(serial, decision, before) | {"nonconformances": list(nonconformances)}
            decision = replace(decision, signed=sign_decision(DISPOSITION, stated, signer))
    event = CertificateSigned(
        str(path.resolve()), hashlib.sha256(content).hexdigest(), role, disposition=decision, before=before,
        number=number, reason=reason, judged=judged,
    )  # fmt: skip
    return store.write_all([*about, event], serial, who=who, spec=spec, after=after)[-1]
