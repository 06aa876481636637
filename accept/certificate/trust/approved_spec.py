"""Approval of the spec that a unit was judged by: it came with the program, or quality assurance signed it."""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base import version
from accept.certificate.contents.content import CertificateContent, canonical
from accept.certificate.contents.outcome import InvalidCertificate, Step
from accept.certificate.trust import authority
from accept.certificate.trust.authority import QA
from accept.certificate.trust.revocation import Revoked
from specs.spec import builtin, is_builtin

NOT_APPROVED = "spec NOT APPROVED"
_SIGNED = ("name", "sha256", "models", "person", "time")
UNSIGNED = "quality assurance has not signed it"
UNREADABLE = "its approval cannot be read"
_WRONG = (
    "its approval is not signed with a key of this kind",
    "its approval is not of the keys that an approval has",
    "its approval does not hold",
    "its approval is that of another spec",
    "its approval is not by quality assurance",
    "its approval was not made under a trusted CA",
    "its approval was made when the key was not valid",
)
_REVOKED = "its approval was made after the key was revoked on "
_MODEL = "its approval does not cover the model file "
_Models = Mapping[str, Mapping[str, str]]  # model file that a spec names -> its files -> sha256


def check_spec(
    contents: CertificateContent, trust: Sequence[x509.Certificate], revoked: Sequence[Revoked] = ()
) -> Step:
    """Check whether the spec is what its name says, and who approved it, with which model files.

    revoked: keys whose approvals do not count from a day on. Raises InvalidCertificate if an approval does not hold, or
    if a certificate of this program states an approval that does not follow from spec and signatures."""
    name, sha256 = contents.spec_name, contents.spec_sha256
    approval, stated = contents.stated.approval, "approval" in contents.provenance
    own = contents.code_sha256 == version.code_sha256()
    if is_builtin(name, sha256):
        if own and stated and approval != {"builtin": True}:
            raise InvalidCertificate(f"spec {name} comes with this program, which provenance.approval does not say")
        return Step(f"spec {name} comes with this program")
    approval = approval or {}
    if approval.get("signature"):
        return _check_approval(approval, contents, trust, revoked)
    if approval.get("builtin") and own:
        raise InvalidCertificate(f"spec {name} is said to come with the program, which has another of that name")
    if approval.get("person"):
        raise InvalidCertificate(f"spec {name} is said to be approved by {approval['person']}, who did not sign that")
    if own and stated and (approval.keys() != {"reason"} or not _is_reason(approval["reason"], contents)):
        raise InvalidCertificate("provenance.approval is neither an approval nor the reason why it is missing")
    if _letters(name) in map(_letters, builtin()):
        return Step(f"spec {name} bears the name of a built-in spec, but is another or of another version", False)
    said = " and says so" if approval else ""
    return Step(f"spec {name} is not approved by quality assurance{said}", remark=NOT_APPROVED)


def _check_approval(
    approval: Mapping[str, Any],
    contents: CertificateContent,
    trust: Sequence[x509.Certificate],
    revoked: Sequence[Revoked],
) -> Step:
    name = contents.spec_name
    if problem := approval_problem(approval, name, contents.spec_sha256, trust, revoked):
        raise InvalidCertificate(f"spec {name}: {problem}")
    words = f"spec {name} was approved by {approval['person']} on {approval['time'][:10]}"
    if problem := uncovered(approval, contents.result.get("models", {})):
        return Step(f"{words}, but {problem}", complete=False, remark=NOT_APPROVED)
    certificate = x509.load_pem_x509_certificate(str(approval["certificate"]).encode("ascii"))
    if certificate.serial_number in {entry.serial_number for entry in revoked if entry.compromised}:
        return Step(f"{words}, with a key that was lost or compromised later: anybody could have dated it so", False)
    return Step(words)


def other_content(name: str) -> str:
    """Return why a spec is not approved that is not the built-in one of its name."""
    return f"it bears the name of the built-in spec '{name}', with other content"


def _is_reason(text: Any, contents: CertificateContent) -> bool:
    if not isinstance(text, str):
        return False
    fixed = {UNSIGNED, UNREADABLE, *_WRONG, other_content(contents.spec_name)}
    fixed |= {f"{_MODEL}{name}" for name in contents.result.get("models", {})}
    return text in fixed or bool(re.fullmatch(re.escape(_REVOKED) + r"\d{4}-\d\d-\d\d", text))


def uncovered(approval: Mapping[str, Any], models: _Models) -> str | None:
    """Return the first model file of a spec that is not the one approved with it, None if all are. An approval of an
    earlier program names no model files."""
    approved = approval.get("models") or {}
    for name in sorted({*models, *approved}):
        if not models.get(name) or models.get(name) != approved.get(name):
            return f"{_MODEL}{name}"
    return None


def approval_problem(
    approval: Mapping[str, Any], name: str, sha256: str, trust: Sequence[x509.Certificate], revoked: Sequence[Revoked]
) -> str | None:
    """Return why an approval of a spec does not hold, None if it does. trust: authorities of its signer; revoked: keys
    whose approvals do not count from a day on."""
    kind, keys_of, broken, other_spec, other_role, other_ca, not_valid = _WRONG
    try:
        certificate = x509.load_pem_x509_certificate(str(approval["certificate"]).encode("ascii"))
        stated = {key: approval[key] for key in _SIGNED if key in approval}
        key, when = certificate.public_key(), datetime.fromisoformat(stated["time"])
        signature = bytes.fromhex(approval["signature"])
        if not isinstance(key, ec.EllipticCurvePublicKey) or when.tzinfo is None:
            return kind
        same = certificate.public_bytes(Encoding.PEM).decode("ascii") == approval["certificate"]
        if (
            set(approval) != {*stated, "certificate", "signature"}
            or not same
            or signature.hex() != approval["signature"]
        ):
            return keys_of
        key.verify(signature, canonical(stated), ec.ECDSA(hashes.SHA256()))
    except (KeyError, TypeError, ValueError, InvalidSignature):
        return broken
    if (stated["name"], stated["sha256"]) != (name, sha256):
        return other_spec
    if authority.role_of(certificate) != QA or authority.person_of(certificate) != stated["person"]:
        return other_role
    if not any(authority.issued_by(certificate, ca) for ca in trust):
        return other_ca
    if not certificate.not_valid_before_utc <= when <= certificate.not_valid_after_utc:
        return not_valid
    for entry in revoked:
        if entry.serial_number == certificate.serial_number and when >= entry.since:
            return f"{_REVOKED}{entry.since:%Y-%m-%d}"
    return None


def _letters(name: str) -> str:
    """Return a name without what a reader hardly sees: case, hyphens, spaces, invisible characters."""
    return "".join(c for c in unicodedata.normalize("NFKC", name).casefold() if c.isalnum())
