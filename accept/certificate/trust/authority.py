"""The bench's own certificate authority: one self-signed root, one certificate for each role (EC P-256, SHA-256)."""

from datetime import datetime, timedelta

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from cryptography.x509.oid import NameOID

from accept.judging.decisions import attribute
from accept.judging.decisions import issued_by as issued_by  # of certificates, for all that are of trust

ORGANISATION = "accept bench"
TECHNICIAN, QA, BENCH = "technician", "qa", "bench"  # roles on certificates
ROLES = (TECHNICIAN, QA)  # of persons, in the order in which they sign
_DEMO = "demonstration only"
_ROOT_LIFE = timedelta(days=365 * 20)
_ROLE_LIFE = timedelta(days=365 * 5)
PublicKey = ec.EllipticCurvePublicKey | Ed25519PublicKey  # of a person, of a bench
P256_ORDER = 0xFFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551
_CLOCK_SLACK = timedelta(hours=1)  # a bench's clock may be set back a little after the keys were made


def new_key() -> ec.EllipticCurvePrivateKey:
    """Return a private key on the curve P-256."""
    return ec.generate_private_key(ec.SECP256R1())


def root(key: ec.EllipticCurvePrivateKey, when: datetime, demo: bool = False) -> x509.Certificate:
    """Return a self-signed root certificate that may sign the certificates of roles and nothing below them. demo: its
    name says so, and only the verification of demonstrations trusts it."""
    identifier = x509.SubjectKeyIdentifier.from_public_key(key.public_key())
    kind = "DEMO" if demo else "bench"
    name = _name(f"{kind} CA {identifier.digest.hex()[:8]}", _DEMO if demo else "certificate authority")
    builder = _builder(name, name, key.public_key(), when, _ROOT_LIFE)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    builder = builder.add_extension(_usage(key_cert_sign=True, crl_sign=True), critical=True)
    if not demo:  # so that a list that is missing was removed
        place = x509.DistributionPoint([x509.DirectoryName(name)], None, None, None)
        builder = builder.add_extension(x509.CRLDistributionPoints([place]), critical=False)
    return builder.add_extension(identifier, critical=False).sign(key, hashes.SHA256())


def leaf(
    role: str,
    person: str,
    public_key: PublicKey,
    issuer: x509.Certificate,
    issuer_key: ec.EllipticCurvePrivateKey,
    when: datetime,
) -> x509.Certificate:
    """Return the certificate of a person in a role, or of a bench; the role is the subject's organisational unit."""
    builder = _builder(_name(person, role), issuer.subject, public_key, when, _ROLE_LIFE)
    builder = builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
    builder = builder.add_extension(_usage(digital_signature=True, content_commitment=True), critical=True)
    builder = builder.add_extension(x509.SubjectKeyIdentifier.from_public_key(public_key), critical=False)
    known = issuer.extensions.get_extension_for_class(x509.SubjectKeyIdentifier).value
    authority = x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(known)
    return builder.add_extension(authority, critical=False).sign(issuer_key, hashes.SHA256())


def is_demo(ca: x509.Certificate) -> bool:
    """Return whether an authority is that of a demonstration."""
    return role_of(ca) == _DEMO


def promises_list(ca: x509.Certificate) -> bool:
    """Return whether an authority has had a list of revoked keys from its beginning. Those of earlier versions wrote
    one with the first key that they revoked."""
    return any(isinstance(extension.value, x509.CRLDistributionPoints) for extension in ca.extensions)


def subject(person: str, role: str) -> x509.Name:
    """Return the name of a person in a role, as certificates state it."""
    return _name(person, role)


def person_of(certificate: x509.Certificate) -> str:
    """Return the name of the person on a certificate."""
    return attribute(certificate, NameOID.COMMON_NAME)


def role_of(certificate: x509.Certificate) -> str:
    """Return the role on a certificate: its subject's organisational unit."""
    return attribute(certificate, NameOID.ORGANIZATIONAL_UNIT_NAME)


def public_of(certificate: x509.Certificate) -> str | None:
    """Return the public key of a bench in its certificate, in hexadecimal; None for another kind of key."""
    key = certificate.public_key()
    return key.public_bytes(Encoding.Raw, PublicFormat.Raw).hex() if isinstance(key, Ed25519PublicKey) else None


def fingerprint(certificate: x509.Certificate) -> str:
    """Return the SHA-256 of the certificate, in hexadecimal."""
    return certificate.fingerprint(hashes.SHA256()).hex()


def _builder(
    subject: x509.Name, issuer: x509.Name, key: PublicKey, when: datetime, life: timedelta
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(when - _CLOCK_SLACK)
        .not_valid_after(when + life)
    )


def _name(common: str, unit: str) -> x509.Name:
    return x509.Name(
        [
            x509.NameAttribute(NameOID.ORGANIZATION_NAME, ORGANISATION),
            x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, unit),
            x509.NameAttribute(NameOID.COMMON_NAME, common),
        ]
    )


def _usage(**allowed: bool) -> x509.KeyUsage:
    everything = (
        "digital_signature",
        "content_commitment",
        "key_encipherment",
        "data_encipherment",
        "key_agreement",
        "key_cert_sign",
        "crl_sign",
        "encipher_only",
        "decipher_only",
    )
    return x509.KeyUsage(**{name: allowed.get(name, False) for name in everything})
