"""Signed decisions: to which unit a recording belongs, and that a stopped bench may judge again.

Quality assurance signs kind and content with its key; the event carries signature and certificate. A decision without a
valid signature does not count: a name can be typed by anyone at the keyboard.
"""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import NameOID

from accept.base.home import home
from accept.store import KeyHolder
from accept.store.payloads import SignedBy
from specs.errors import AcceptError
from specs.files import read_bounded

QA = "qa"


class DecisionError(AcceptError, ValueError):
    """A decision that does not count; the text says why."""


@dataclass(frozen=True, eq=False)
class Signer:
    """The opened key of a person of quality assurance, with its certificate."""

    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate

    @property
    def person(self) -> KeyHolder:
        """Return the name on the certificate."""
        return KeyHolder(_attribute(self.certificate, NameOID.COMMON_NAME))


Opens = Callable[[], Signer]
"""Opens the key: called when the decision is due, so that no passphrase is asked for before a refusal."""


def sign_decision(kind: str, content: Mapping[str, Any], signer: Signer) -> SignedBy:
    """Sign a decision. kind: name of the event. Raises DecisionError for a key of another role."""
    if _attribute(signer.certificate, NameOID.ORGANIZATIONAL_UNIT_NAME) != QA:
        raise DecisionError(f"{signer.person} is not of quality assurance, whose key signs decisions")
    now = datetime.now(UTC).isoformat(timespec="seconds")
    signature = signer.key.sign(_text(kind, content, signer.person, now), ec.ECDSA(hashes.SHA256()))
    certificate = signer.certificate.public_bytes(Encoding.PEM).decode("ascii")
    return SignedBy(signer.person, now, certificate, signature.hex())


def decision_problem(
    kind: str,
    content: Mapping[str, Any],
    signed: SignedBy | None,
    roots: Sequence[x509.Certificate],
    revoked: Mapping[int, datetime],
    lost: Collection[int] = (),
) -> str | None:
    """Return why a decision does not count, None if it does. revoked: numbers of revoked certificates, and since
    when; lost: those whose key another person may hold, who can date a decision at will."""
    if signed is None:
        return "it is not signed by quality assurance"
    try:
        certificate = x509.load_pem_x509_certificate(signed.certificate.encode("ascii"))
        key, when = certificate.public_key(), datetime.fromisoformat(signed.time)
        if not isinstance(key, ec.EllipticCurvePublicKey) or when.tzinfo is None:
            return "it is not signed with a key of this kind"
        text = _text(kind, content, signed.person, signed.time)
        key.verify(bytes.fromhex(signed.signature), text, ec.ECDSA(hashes.SHA256()))
    except (ValueError, TypeError, InvalidSignature):
        return "its signature does not hold"
    role = _attribute(certificate, NameOID.ORGANIZATIONAL_UNIT_NAME)
    if role != QA or _attribute(certificate, NameOID.COMMON_NAME) != signed.person:
        return "it is not signed by quality assurance"
    if not any(_issued_by(certificate, ca) for ca in roots):
        return "it was not signed under a trusted authority"
    if not certificate.not_valid_before_utc <= when <= certificate.not_valid_after_utc:
        return "it was signed when the key was not valid"
    if certificate.serial_number in lost:
        return "its key was lost or compromised later: quality assurance signs it again"
    since = revoked.get(certificate.serial_number)
    return f"its key was revoked on {since:%Y-%m-%d}" if since is not None and when >= since else None


def problem_here(
    kind: str, content: Mapping[str, Any], signed: SignedBy | None, *, weakens: bool = False
) -> str | None:
    """Return why a decision does not count under this bench's authority, as `decision_problem`. weakens: it takes a
    verdict away, so it stands also if its key was lost later."""
    folder = home() / "keys"
    try:
        roots = [x509.load_pem_x509_certificate(read_bounded(folder / "ca.pem"))]
    except (OSError, ValueError):
        return "this bench has no authority's certificate to hold it against"
    try:
        listed = x509.load_pem_x509_crl(read_bounded(folder / "ca.crl.pem"))
        key = roots[0].public_key()
        if not isinstance(key, ec.EllipticCurvePublicKey) or not listed.is_signature_valid(key):
            return "the list of revoked keys is not signed by the authority"
        revoked = {one.serial_number: one.revocation_date_utc for one in listed}
        lost = {one.serial_number for one in listed if _is_lost(one)}
    except FileNotFoundError:
        promised = any(isinstance(extension.value, x509.CRLDistributionPoints) for extension in roots[0].extensions)
        if promised and not weakens:
            return "the list of revoked keys is missing"
        revoked, lost = {}, set()
    except (OSError, ValueError):
        return "the list of revoked keys cannot be read"
    return decision_problem(kind, content, signed, roots, revoked, () if weakens else lost)


def _is_lost(one: x509.RevokedCertificate) -> bool:
    try:
        reason = one.extensions.get_extension_for_class(x509.CRLReason).value.reason
    except x509.ExtensionNotFound:
        return False
    return reason is x509.ReasonFlags.key_compromise


def _text(kind: str, content: Mapping[str, Any], person: str, time: str) -> bytes:
    stated = {"decision": kind, "content": content, "person": person, "time": time}
    return json.dumps(stated, sort_keys=True, separators=(",", ":"), ensure_ascii=True).encode("ascii")


def _attribute(certificate: x509.Certificate, oid: x509.ObjectIdentifier) -> str:
    found = certificate.subject.get_attributes_for_oid(oid)
    return str(found[0].value) if len(found) == 1 else ""


def _issued_by(certificate: x509.Certificate, ca: x509.Certificate) -> bool:
    try:
        certificate.verify_directly_issued_by(ca)
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True
