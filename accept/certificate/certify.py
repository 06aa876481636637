"""A document signed, written, and its signature stored: the same for technician and quality assurance."""

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from accept.base.atomic_files import write_atomic
from accept.base.documents.results import UnitRecord
from accept.certificate import events
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.provenance import Provenance
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.provenance import numbers_of, provenance, signed_by_bench
from accept.judging.reservations import decided
from accept.store import TECHNICIAN, Event, Overtaken, SignedHead, Store, UnitState
from accept.store.decisions import DISPOSITION, Signer, content_of, sign_decision
from accept.store.payloads import Disposition, Payload
from specs.spec import Spec


def drawn(contents: CertificateContent, home: Path) -> bytes:
    """Return a certificate, unsigned, with its provenance signed by the bench."""
    from accept.certificate.page.document import render  # loads reportlab: only when wanted

    return render(signed_by_bench(contents, home))


class Issuer:
    """Issues the certificates of a bench in the technician's name; without a credential they stay unsigned."""

    def __init__(self, store: Store, home: Path, who: str, credential: Credential | None) -> None:
        self.store, self.home, self.who, self.credential = store, home, who, credential
        self._head: SignedHead | None = None

    def draw(
        self,
        path: Path,
        spec: Spec,
        result: UnitRecord,
        before: UnitState | None,
        past: Sequence[Event],
        decided: Provenance,
        contents: Callable[[Provenance], CertificateContent],
        overwrites: bool = False,
    ) -> Callable[[int], None]:
        """Draw a certificate, its provenance signed by the bench; return what signs it, writes it to `path` and stores
        that it was signed, given the number of the event of its judgement.

        before, decided: as `provenance` takes them; past: events of the unit; contents: what the certificate states,
        with its provenance; overwrites: an unsigned file at its place is replaced.
        Raises as `provenance`, ContentError; what is returned raises as `sign_into`."""
        serial, taken = result.serial, numbers_of(past)
        self._head = self._head or self.store.signed_head()  # one for all certificates of a run
        stated = provenance(
            self.store, self.who, spec, serial, before, self._head, self.home, self.credential, taken, decided
        )
        page = drawn(contents(stated), self.home)

        def issue(judged: int) -> None:
            if not overwrites or _is_signed(path):
                _set_aside(path)
            if self.credential is None:
                return write_atomic(path, page)
            sign_into(
                path, page, self.credential, self.store, serial, self.who, result.spec,
                number=stated.number, simulated=result.simulated, reason=stated.signed_because, judged=judged,
            )  # fmt: skip
            return None

        return issue


def sign_into(
    path: Path,
    document: bytes,
    credential: Credential,
    store: Store,
    serial: str,
    who: str,
    spec: str = "",
    disposition: Disposition | None = None,
    number: str = "",
    simulated: bool = False,
    reason: str = "",
    judged: int = 0,
    nonconformances: Sequence[str] = (),
    after: int | None = None,
) -> Event:
    """Sign a document in the credential's role, write it to `path`, and store that it was signed, with the disposition
    of a unit that was not accepted and the number of the certificate, if it has one. simulated: no instrument measured
    the unit, which the box of the signature says. reason: why the technician signs a unit that is not accepted, or
    replaces a certificate. judged: the event of the judgement that the technician signs. nonconformances: that the
    document states. after: number of the last event of the store that a countersigner knew of: with a later one of the
    unit nothing is stored or written.

    Raises SigningRefused, OSError, StoreError."""
    from accept.certificate.signature.signing import SigningRefused, sign  # loads pyhanko: only when wanted

    signed = sign(document, credential, datetime.now(UTC), disposition=disposition, simulated=simulated)
    if after is None:  # one of the technician that the store does not know is made again
        write_atomic(path, signed)
    before = None if credential.role == TECHNICIAN else hashlib.sha256(document).hexdigest()
    decision, about = disposition, list[Payload]()
    if decision is not None and credential.key is not None:
        signer = Signer(credential.key, credential.certificate)
        if nonconformances:
            about.append(decided(store, serial, decision, signer, nonconformances))
        # what is stated is signed too: else it could be given as about what another store has
        stated = content_of(serial, decision, before) | {"nonconformances": list(nonconformances)}
        decision = replace(decision, signed=sign_decision(DISPOSITION, stated, signer))
    try:
        stored = events.signed(
            store, serial, path, signed, credential.role, who=who, spec=spec, about=about, after=after,
            disposition=decision, before=before, number=number, reason=reason, judged=judged,
        )  # fmt: skip
    except Overtaken as e:
        words = "its history went on while the certificate was looked at; look at it again: nothing was signed"
        raise SigningRefused(f"{serial}: {words}") from e
    if after is not None:
        write_atomic(path, signed)
    return stored


def _is_signed(path: Path) -> bool:
    return path.exists() and b"/ByteRange" in path.read_bytes()


def _set_aside(path: Path) -> None:
    """Rename a certificate of an earlier result, which is never overwritten."""
    number = 1
    while path.exists():
        aside = path.with_name(f"{path.stem}_superseded-{number}.pdf")
        if not aside.exists():
            os.replace(path, aside)
        number += 1
