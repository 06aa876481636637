"""The statement of a result about the commissioning of an instrument: by whom, with that technician's signature, or why
it is unproven."""

import base64
import datetime
import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from accept.certificate.trust import authority

_UNPROVEN = re.compile(
    r"unproven: (never commissioned|a recorder, which no commissioning covers yet|commissioned with other settings, or "
    r"as another instrument|its commissioning (on \d{4}-\d\d-\d\d did not (pass|ask whether each change was made; "
    r"repeat it)|record (is unsigned|is of an earlier program; repeat it|does not verify \(\w+\))))"
)


def is_proven(row: Mapping[str, Any], roots: Sequence[x509.Certificate]) -> bool:
    """Return whether the words of a row on its instrument's commissioning are those of this program, and a name among
    them is that of a technician who signed so."""
    words, given = row.get("commissioned"), row.get("commissioning")
    if given is None:
        return words is None or _UNPROVEN.fullmatch(words) is not None
    try:
        claim = claim_of(given)
        said = words_of(claim, signer_of(given, claim, roots))
    except (InvalidSignature, ValueError, KeyError, TypeError):
        return False
    same = [claim[key] for key in ("model", "serial", "passed")] == [row["model"], row["serial"], True]
    return same and words == said


def claim_of(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the technician signs of a record: it travels with a result, the record does not."""
    claim = {key: record[key] for key in ("subject", "model", "serial", "on", "passed")}
    return claim | {"record": record.get("record") or hashlib.sha256(as_bytes(record)).hexdigest()}


def words_of(claim: Mapping[str, Any], certificate: x509.Certificate) -> str:
    """Return who commissioned an instrument, and when. Raises ValueError if that is no day."""
    return f"commissioned on {datetime.date.fromisoformat(claim['on'])} by {authority.person_of(certificate)}"


def signer_of(file: Mapping[str, Any], claim: object, roots: Sequence[x509.Certificate]) -> x509.Certificate:
    """Return the certificate of the technician who signed a claim. Raises InvalidSignature, ValueError, KeyError."""
    certificate = x509.load_pem_x509_certificate(file["certificate"].encode("ascii"))
    key = certificate.public_key()
    if (
        authority.role_of(certificate) != authority.TECHNICIAN
        or not isinstance(key, ec.EllipticCurvePublicKey)
        or not any(authority.issued_by(certificate, ca) for ca in roots)
    ):
        raise ValueError("not signed by a technician")
    key.verify(base64.b64decode(file["signature"], validate=True), as_bytes(claim), ec.ECDSA(hashes.SHA256()))
    return certificate


def as_bytes(record: object) -> bytes:
    """Return plain data as they are signed."""
    return json.dumps(record, sort_keys=True, separators=(",", ":")).encode()
