"""Certificates of keys: whose a key is, in which role, which authority issued it, and how it was revoked."""

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.x509.oid import NameOID


def person_of(certificate: x509.Certificate) -> str:
    """Return the name of the person on a certificate."""
    return _attribute(certificate, NameOID.COMMON_NAME)


def role_of(certificate: x509.Certificate) -> str:
    """Return the role on a certificate: its subject's organisational unit."""
    return _attribute(certificate, NameOID.ORGANIZATIONAL_UNIT_NAME)


def issued_by(certificate: x509.Certificate, ca: x509.Certificate) -> bool:
    """Return whether an authority signed a certificate."""
    try:
        certificate.verify_directly_issued_by(ca)
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True


def promises_list(ca: x509.Certificate) -> bool:
    """Return whether an authority has had a list of revoked keys from its beginning. Those of earlier versions wrote
    one with the first key that they revoked."""
    return any(isinstance(extension.value, x509.CRLDistributionPoints) for extension in ca.extensions)


def is_compromised(entry: x509.RevokedCertificate) -> bool:
    """Return whether another person may hold a revoked key."""
    try:
        reason = entry.extensions.get_extension_for_class(x509.CRLReason).value.reason
    except x509.ExtensionNotFound:
        return False
    return reason is x509.ReasonFlags.key_compromise


def _attribute(certificate: x509.Certificate, oid: x509.ObjectIdentifier) -> str:
    found = certificate.subject.get_attributes_for_oid(oid)
    return str(found[0].value) if len(found) == 1 else ""
