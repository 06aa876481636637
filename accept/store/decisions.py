"""Signed decisions: to which unit a recording belongs, and that a stopped bench may judge again.

Quality assurance signs kind and content with its key; the event carries signature and certificate. A decision without a
valid signature does not count: a name can be typed by anyone at the keyboard.
"""

import hashlib
import json
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.documents.results import CONCESSION
from accept.base.home import home
from accept.base.names import KeyHolder
from accept.store.key_certificates import is_compromised, issued_by, person_of, promises_list, role_of
from accept.store.payloads import CHOICES, Disposition, NonconformanceDecided, SignedBy, without_hashes
from specs.errors import AcceptError
from specs.files import read_bounded

QA = "qa"
# How the line of one begins: as the workflow writes it (`payloads.MARK`), and as people do.
_NONCONFORMANCE = re.compile(r"\s*non[- ]?conformance\s*:\s*", re.IGNORECASE)
DISPOSITION = "disposition"  # the kind of a decision about nonconformances


class DecisionError(AcceptError, ValueError):
    """A decision that does not count; the text says why."""


@dataclass(frozen=True, eq=False)
class Signer:
    """The opened key of a person of quality assurance, with its certificate."""

    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate

    @property
    def person(self) -> KeyHolder:
        return KeyHolder(person_of(self.certificate))


Opens = Callable[[], Signer]
"""Opens the key: called when the decision is due, so that no passphrase is asked for before a refusal."""


def sign_decision(kind: str, content: Mapping[str, Any], signer: Signer) -> SignedBy:
    """Sign a decision. kind: name of the event. Raises DecisionError for a key of another role."""
    if role_of(signer.certificate) != QA:
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
    if role_of(certificate) != QA or person_of(certificate) != signed.person:
        return "it is not signed by quality assurance"
    if not any(issued_by(certificate, ca) for ca in roots):
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
        lost = {one.serial_number for one in listed if is_compromised(one)}
    except FileNotFoundError:
        if promises_list(roots[0]) and not weakens:
            return "the list of revoked keys is missing"
        revoked, lost = {}, set()
    except (OSError, ValueError):
        return "the list of revoked keys cannot be read"
    return decision_problem(kind, content, signed, roots, revoked, () if weakens else lost)


def in_notes(notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the nonconformances among the notes of a unit folder, each with its step."""
    marked = ((step, _NONCONFORMANCE.match(line), line) for step, lines in notes.items() for line in lines)
    return [*dict.fromkeys(f"{step}: {line[mark.end() :]}" for step, mark, line in marked if mark)]


def words_of(given: NonconformanceDecided) -> str:
    """Return a disposition about nonconformances in words: the decision, who decided when, and about what."""
    decision, signed = given.disposition, given.disposition.signed
    kind, about = ("concession", "conceded") if decision.choice == CONCESSION else ("disposition", "about")
    who = "nobody, without a signature" if signed is None else f"{signed.person} {signed.time[:10]}"
    called, named = CHOICES.get(decision.choice, decision.choice), map(without_hashes, given.nonconformances)
    return f"{kind} by {who}: {called}: {decision.reason}; {about}: {'; '.join(named)}"


def stated_words(dispositions: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the dispositions that a record states, in words."""
    return [words_of(NonconformanceDecided.from_json(given)) for given in dispositions]


def signed_content(serial: str, given: NonconformanceDecided) -> dict[str, Any]:
    """Return the data of a disposition that quality assurance signs. Earlier programs signed the certificate that was
    countersigned with it in place of what it states."""
    about: dict[str, Any] = {"nonconformances": list(given.nonconformances)} if given.certificate is None else {}
    about |= {"judged": given.judged} if given.judged else {}
    return content_of(serial, given.disposition, given.certificate) | about


def content_of(serial: str, decision: Disposition, certificate: str | None) -> dict[str, Any]:
    """Return the data of a disposition that is signed with a certificate. certificate: sha256 of the one that was
    countersigned with it."""
    about = {"certificate": certificate} if certificate is not None else {}
    return {"serial": serial, "choice": decision.choice, "reason": decision.reason} | about


def recording_party(serial: str, sample: str, channels: Mapping[str, str]) -> tuple[str, str, str]:
    """Return serial, record, and a hash of its content, as a decision names it: another recording is another party."""
    return serial, sample, hashlib.sha256(repr(sorted(channels.items())).encode()).hexdigest()[:16]


def _text(kind: str, content: Mapping[str, Any], person: str, time: str) -> bytes:
    stated = {"decision": kind, "content": content, "person": person, "time": time}
    return json.dumps(stated, sort_keys=True, separators=(",", ":"), ensure_ascii=True).encode("ascii")
