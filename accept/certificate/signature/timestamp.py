"""Trusted time: a time stamping authority confirms that a signature existed at a moment ([RFC3161]).

The token stands beside the signature, in the /Contents placeholder. It covers the signature's value, and the
authority's own certificates come with it, so that it can be verified when the authority no longer exists.
"""

import asyncio
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from typing import Any

from asn1crypto import cms
from cryptography import x509
from pyhanko.sign.ades.report import AdESIndeterminate
from pyhanko.sign.validation.dss import DocumentSecurityStore
from pyhanko.sign.validation.generic_cms import validate_tst_signed_data
from pyhanko_certvalidator import ValidationContext

from accept.certificate.contents.outcome import InvalidCertificate
from accept.certificate.signature.long_term import loaded
from accept.certificate.trust.authority import issued_by

TSA_VARIABLE = "ACCEPT_TSA"
_CLOCKS = timedelta(minutes=5)  # between the servers of one authority
_REVOKED = (AdESIndeterminate.REVOKED_NO_POE, AdESIndeterminate.REVOKED_CA_NO_POE)
LARGEST = 24_000  # bytes of a token; with a chain of RSA certificates it takes some 6,000


@dataclass(frozen=True)
class Stamped:
    """When a signature existed, by a time stamping authority; trusted: the authority is one of those named. revoked:
    its certificate was revoked at that time. proven: the document itself keeps the evidence that it was not."""

    when: datetime
    by: str
    trusted: bool
    revoked: bool = False
    proven: bool = False


def checked(
    token: bytes, signature: bytes, roots: Sequence[x509.Certificate], kept: DocumentSecurityStore | None = None
) -> Stamped:
    """Return what a token states about a signature value. Raises InvalidCertificate if the token is damaged, belongs to
    another signature, or carries something that its authority did not sign. roots: of the trusted time stamping
    authorities. kept: revocation data that the document keeps."""
    content = cms.ContentInfo.load(token)
    if content.dump(force=True) != token or content["content_type"].native != "signed_data":
        raise InvalidCertificate("the timestamp is not encoded canonically")
    signed = content["content"]
    infos = signed["signer_infos"]
    if len(infos) != 1 or len(infos[0]["unsigned_attrs"]) or len(signed["crls"]):
        raise InvalidCertificate("the timestamp carries more than its authority signed")
    moment: datetime = signed["encap_content_info"]["content"].parsed["gen_time"].native
    carried = [x509.load_der_x509_certificate(choice.chosen.dump()) for choice in signed["certificates"]]
    judged = partial(status_of, signed, lambda name: hashlib.new(name, signature).digest(), roots, moment)
    status = asyncio.run(judged())
    if not (status["intact"] and status["valid"]):
        raise InvalidCertificate("the timestamp is not of this signature, or was changed")
    if not all(any(issued_by(c, issuer) for issuer in (*carried, *roots)) for c in carried):
        raise InvalidCertificate("the timestamp carries a certificate of an unknown issuer")
    by = str(status["signing_cert"].subject.human_friendly)
    if status["trust_problem_indic"] is not None or kept is None:
        return Stamped(moment, by, trusted=status["trust_problem_indic"] is None)
    problem = asyncio.run(judged(kept))["trust_problem_indic"]
    revoked = problem in _REVOKED  # anything else: what is kept says nothing of this certificate at that moment
    return Stamped(moment, by, trusted=not revoked, revoked=revoked, proven=problem is None)


async def status_of(
    signed: cms.SignedData,
    digest: Callable[[str], bytes],
    roots: Sequence[x509.Certificate],
    moment: datetime,
    kept: DocumentSecurityStore | None = None,
) -> dict[str, Any]:
    """Return pyhanko's status of a token at a moment: whether it is by its authority and, if the document keeps
    revocation data, whether these show that no certificate above it was revoked. digest: of what was stamped, by the
    name of its algorithm."""
    settings: dict[str, Any] = {
        "trust_roots": loaded(roots),
        "other_certs": [choice.chosen for choice in signed["certificates"]],
        "moment": moment,
        "allow_fetching": False,
        "revocation_mode": "soft-fail" if kept is None else "require",
        "time_tolerance": _CLOCKS,
    }
    context = ValidationContext(**settings) if kept is None else kept.as_validation_context(settings)
    return dict(await validate_tst_signed_data(signed, context, digest))
