"""The bench that made a certificate: certified by the authority, or unknown."""

from collections.abc import Sequence
from datetime import datetime

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding

from accept.certificate.contents.content import CertificateContent, hashes_of, signed_text
from accept.certificate.contents.outcome import InvalidCertificate, Step
from accept.certificate.contents.provenance import AT_THE_BENCH, Provenance
from accept.certificate.trust import authority
from accept.certificate.trust.authority import BENCH, public_of
from accept.certificate.trust.revocation import Revoked


def check_bench(
    contents: CertificateContent, roots: Sequence[x509.Certificate], revoked: Sequence[Revoked], when: datetime
) -> list[Step]:
    """Check that a bench of a trusted authority signed head and provenance. when: time of the technician's signature.

    Steps are not complete for an unknown bench, whose store cannot be asked, and for a bench whose key was lost. Raises
    InvalidCertificate if a signature or a certificate does not hold."""
    given = contents.stated
    if not given.signature:
        if given.bench:
            raise InvalidCertificate("a bench is named, but it did not sign what is stated")
        return [Step("it was made at an unknown bench, which has no certificate of the authority", complete=False)]
    certificate = _certificate(given, roots)
    _check_signature(contents, certificate)
    name = authority.person_of(certificate)
    if not certificate.not_valid_before_utc <= when <= certificate.not_valid_after_utc:
        return [Step(f"the certificate of its bench, {name}, was not valid at {when.isoformat()}", complete=False)]
    if given.result and given.result != hashes_of(contents):
        raise InvalidCertificate("its bench signed what is stated beside the result for another result or spec")
    signed = "signed the result and" if given.result else "did not sign the result, only"
    steps = [Step(f"made at {name}, which {signed} what is stated beside it")]
    for entry in revoked:
        if entry.serial_number == certificate.serial_number and (entry.compromised or when >= entry.since):
            words = f"the key of its bench, {name}, was revoked on {entry.since:%Y-%m-%d}"
            steps.append(Step(words, complete=False))
    if given.authority:
        if given.authority != AT_THE_BENCH:
            raise InvalidCertificate(f"provenance.authority is {given.authority!r}")
        steps.append(Step("the authority's key lay at this bench: who opens it can sign as everybody"))
    return steps


def _certificate(given: Provenance, roots: Sequence[x509.Certificate]) -> x509.Certificate:
    try:
        certificate = x509.load_pem_x509_certificate(given.bench.encode("ascii"))
    except ValueError as e:
        raise InvalidCertificate(f"the certificate of its bench cannot be read ({type(e).__name__})") from e
    if certificate.public_bytes(Encoding.PEM).decode("ascii") != given.bench:
        raise InvalidCertificate("provenance.bench is not a certificate as this program writes it")
    if not any(authority.issued_by(certificate, ca) for ca in roots):
        raise InvalidCertificate("the certificate of its bench was not issued by a trusted authority")
    if authority.role_of(certificate) != BENCH:
        raise InvalidCertificate(f"its bench has the certificate of a {authority.role_of(certificate)}")
    return certificate


def _check_signature(contents: CertificateContent, certificate: x509.Certificate) -> None:
    given, key = contents.stated, certificate.public_key()
    if not isinstance(key, Ed25519PublicKey):
        raise InvalidCertificate("the key of its bench is of another kind")
    if given.head is not None and given.head.bench != public_of(certificate):
        raise InvalidCertificate("the head of its store is signed by another bench than the one that is named")
    try:
        signature = bytes.fromhex(given.signature)
        key.verify(signature, signed_text(contents.serial, contents.provenance))
    except (ValueError, InvalidSignature) as e:
        raise InvalidCertificate("what is stated beside the result was changed after the bench signed it") from e
    if signature.hex() != given.signature:
        raise InvalidCertificate("provenance.signature is not in lower-case hexadecimal digits")
