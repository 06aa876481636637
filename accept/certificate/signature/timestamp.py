"""Trusted time: a time stamping authority says that a signature was there at a moment ([RFC3161]).

The token stands beside the signature, in the hole that the signature leaves. It covers the signature's value, and the
authority's own certificates come with it, so that it can be looked at when the authority is long gone.
"""

import asyncio
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from asn1crypto import cms
from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.sign.timestamps import TimeStamper
from pyhanko.sign.validation.generic_cms import validate_tst_signed_data
from pyhanko_certvalidator import ValidationContext

from accept.certificate.errors import InvalidCertificate
from accept.certificate.trust.authority import issued_by

VARIABLE = "ACCEPT_TSA"
TIMEOUT_S = 20.0
LARGEST = 24_000  # bytes of a token; with a chain of RSA certificates it takes some 6,000


@dataclass(frozen=True)
class Stamped:
    """When a signature was there, as a time stamping authority says; trusted: its authority is one of those named."""

    when: datetime
    by: str
    trusted: bool


def stamper(url: str) -> TimeStamper:
    """Asks the authority at a URL; its errors are TimestampRequestError, OSError."""
    from pyhanko.sign.timestamps.requests_client import RequestsHTTPTimeStamper  # loads requests: only when wanted

    return RequestsHTTPTimeStamper(url, timeout=TIMEOUT_S)  # type: ignore[no-untyped-call]


def checked(token: bytes, signature: bytes, roots: Sequence[x509.Certificate]) -> Stamped:
    """What a token says of a signature value. Raises InvalidCertificate for one that is damaged, of another signature,
    or carries what its authority did not sign. roots: of the time stamping authorities that are trusted."""
    content = cms.ContentInfo.load(token)
    if content.dump(force=True) != token or content["content_type"].native != "signed_data":
        raise InvalidCertificate("the timestamp is not encoded canonically")
    signed = content["content"]
    infos = signed["signer_infos"]
    if len(infos) != 1 or len(infos[0]["unsigned_attrs"]) or len(signed["crls"]):
        raise InvalidCertificate("the timestamp carries more than its authority signed")
    moment: datetime = signed["encap_content_info"]["content"].parsed["gen_time"].native
    carried = [x509.load_der_x509_certificate(choice.chosen.dump()) for choice in signed["certificates"]]
    context = ValidationContext(
        trust_roots=[asn1_x509.Certificate.load(c.public_bytes(Encoding.DER)) for c in roots],
        other_certs=[choice.chosen for choice in signed["certificates"]],
        moment=moment,
        allow_fetching=False,
    )
    status = asyncio.run(validate_tst_signed_data(signed, context, lambda name: hashlib.new(name, signature).digest()))
    if not (status["intact"] and status["valid"]):
        raise InvalidCertificate("the timestamp is not of this signature, or was changed")
    if not all(any(issued_by(c, issuer) for issuer in (*carried, *roots)) for c in carried):
        raise InvalidCertificate("the timestamp carries a certificate that nobody vouches for")
    by = str(status["signing_cert"].subject.human_friendly)
    return Stamped(moment, by, trusted=status["trust_problem_indic"] is None)
