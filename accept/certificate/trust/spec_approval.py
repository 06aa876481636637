"""Who approved the spec that a unit was judged by: it came with the program, or quality assurance signed it."""

import json
import unicodedata
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base import version
from accept.base.atomic_files import write_atomic
from accept.certificate.contents.content import BEFORE, CertificateContent, canonical
from accept.certificate.contents.errors import InvalidCertificate
from accept.certificate.contents.step import Step
from accept.certificate.trust import authority
from accept.certificate.trust.keys import QA, Credential, KeysError
from accept.certificate.trust.revocation import Revoked
from specs.files import read_bounded
from specs.spec import Spec, builtin, load

_SIGNED = ("name", "sha256", "person", "time")


def approve(spec: Spec, credential: Credential, when: datetime) -> dict[str, Any]:
    """Approval of a spec by the owner of a QA key: plain data with a signature over name, hash, person and time."""
    if credential.role != QA or credential.key is None:
        raise KeysError(f"a spec is approved with a key of quality assurance, not of a {credential.role}")
    stated = {"name": spec.name, "sha256": spec.sha256, "person": credential.person}
    stated["time"] = when.astimezone(UTC).replace(microsecond=0).isoformat()
    signature = credential.key.sign(canonical(stated), ec.ECDSA(hashes.SHA256()))
    certificate = credential.certificate.public_bytes(Encoding.PEM).decode("ascii")
    return {**stated, "certificate": certificate, "signature": signature.hex()}


def write(home: Path, approval: Mapping[str, Any]) -> Path:
    """Keep an approval at the bench. Raises OSError."""
    path = _path(home, approval["sha256"])
    write_atomic(path, canonical(approval))
    return path


def approval_of(spec: Spec, home: Path, ca: x509.Certificate | None, revoked: Sequence[Revoked] = ()) -> dict[str, Any]:
    """What a certificate says of its spec: {"builtin": true}, the approval, or {"reason": why there is none}."""
    shipped = builtin()
    if spec.name in shipped and load(spec.name).sha256 == spec.sha256:
        return {"builtin": True}
    try:
        approval: dict[str, Any] = json.loads(read_bounded(_path(home, spec.sha256)))
        if ca is not None and (problem := _problem(approval, spec.name, spec.sha256, [ca], revoked)):
            return {"reason": problem}
        return approval
    except FileNotFoundError:
        named = f"it bears the name of the built-in spec '{spec.name}', with other content"
        return {"reason": named if spec.name in shipped else "nobody of quality assurance signed it"}
    except (OSError, ValueError) as e:
        return {"reason": f"its approval cannot be read ({e})"}


def check_spec(
    contents: CertificateContent, trust: Sequence[x509.Certificate], revoked: Sequence[Revoked] = ()
) -> Step:
    """Whether the spec is what its name says. revoked: keys that approve nothing since a day. Raises InvalidCertificate
    for an approval that does not hold, and where a certificate of this program calls a spec built-in that is not."""
    name, sha256 = contents.spec_name, contents.spec_sha256
    approval = contents.provenance.get("approval") or {}
    shipped = builtin()
    if name in shipped and load(name).sha256 == sha256:
        return Step(f"spec {name} comes with this program")
    if approval.get("signature"):
        if problem := _problem(approval, name, sha256, trust, revoked):
            raise InvalidCertificate(f"spec {name}: {problem}")
        words = f"spec {name} was approved by {approval['person']} on {approval['time'][:10]}"
        if _serial_number(approval) in {entry.serial_number for entry in revoked if entry.compromised}:
            return Step(f"{words}, with a key that was compromised later: anybody could have dated it so", False)
        return Step(words)
    same_program = contents.code_sha256 == version.code_sha256()
    if approval.get("builtin") and same_program:
        raise InvalidCertificate(f"spec {name} is said to come with the program, which has another of that name")
    if _letters(name) in map(_letters, shipped):
        return Step(f"spec {name} bears the name of a built-in spec, but is another or of another version", False)
    said = "" if contents.format == BEFORE else " and says so"
    return Step(f"spec {name} is not approved by quality assurance{said}", remark="spec NOT APPROVED")


def _problem(
    approval: Mapping[str, Any],
    name: str,
    sha256: str,
    trust: Sequence[x509.Certificate],
    revoked: Sequence[Revoked],
) -> str | None:
    """Why an approval does not hold, None where it does."""
    try:
        certificate = x509.load_pem_x509_certificate(str(approval["certificate"]).encode("ascii"))
        stated = {key: approval[key] for key in _SIGNED}
        key, when = certificate.public_key(), datetime.fromisoformat(stated["time"])
        if not isinstance(key, ec.EllipticCurvePublicKey) or when.tzinfo is None:
            return "its approval is not signed with a key of this kind"
        key.verify(bytes.fromhex(approval["signature"]), canonical(stated), ec.ECDSA(hashes.SHA256()))
    except (KeyError, TypeError, ValueError, InvalidSignature) as e:
        return f"its approval does not hold ({type(e).__name__})"
    if (stated["name"], stated["sha256"]) != (name, sha256):
        return "its approval is that of another spec"
    if authority.role_of(certificate) != QA or authority.person_of(certificate) != stated["person"]:
        return "its approval is not by quality assurance"
    if not any(authority.issued_by(certificate, ca) for ca in trust):
        return "its approval was not made under a trusted CA"
    if not certificate.not_valid_before_utc <= when <= certificate.not_valid_after_utc:
        return "its approval was made when the key was not valid"
    for entry in revoked:
        if entry.serial_number == certificate.serial_number and when >= entry.since:
            return f"its approval was made after the key was revoked on {entry.since:%Y-%m-%d}"
    return None


def _letters(name: str) -> str:
    """What a reader sees of a name: another case, hyphen, space or invisible character makes no other one."""
    return "".join(c for c in unicodedata.normalize("NFKC", name).casefold() if c.isalnum())


def _serial_number(approval: Mapping[str, Any]) -> int:
    """Of the certificate of who approved."""
    return x509.load_pem_x509_certificate(str(approval["certificate"]).encode("ascii")).serial_number


def _path(home: Path, sha256: str) -> Path:
    return home / "approved-specs" / f"{sha256}.json"
