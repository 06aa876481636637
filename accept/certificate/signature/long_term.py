"""Revocation data of a time stamping authority ([PADES], level B-LT): the answers of its servers are kept in the
document, so that it can be verified without them later that its certificates were not revoked when it stamped.

The servers are asked before the signature is made and the answers written with it, so it covers them too.
"""

import asyncio
import time
from collections.abc import Sequence
from dataclasses import dataclass

from asn1crypto import crl, ocsp
from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.pdf_utils.writer import BasePdfFileWriter
from pyhanko.sign.timestamps import TimeStamper
from pyhanko.sign.validation.dss import DocumentSecurityStore
from pyhanko.sign.validation.errors import NoDSSFoundError
from pyhanko_certvalidator import ValidationContext
from pyhanko_certvalidator.errors import PathError, RevokedError, ValidationError

from specs.errors import AcceptError

ALL_S = 60.0  # for all of the authority's servers together
FRESH_S = 600.0  # a batch asks once for all that it signs in this time


class AuthorityRevoked(AcceptError, ValueError):
    """The time stamping authority's certificate is revoked: what it stamps proves nothing."""


@dataclass(frozen=True, eq=False)
class RevocationData:
    """The answers of the authority's servers; empty if it has none or they did not answer."""

    certificates: Sequence[asn1_x509.Certificate] = ()
    lists: Sequence[crl.CertificateList] = ()
    answers: Sequence[ocsp.OCSPResponse] = ()

    def write(self, document: BasePdfFileWriter) -> None:
        """Write the answers into the revision that is being made, beside those that the document keeps already."""
        if self.lists or self.answers:
            DocumentSecurityStore.supply_dss_in_writer(
                document, None, certs=self.certificates, crls=self.lists, ocsps=self.answers
            )


_asked: dict[str, tuple[float, RevocationData]] = {}


async def revocation_data(stamping: TimeStamper, roots: Sequence[x509.Certificate]) -> RevocationData:
    """Ask the servers that the authority's certificates name. roots: of authorities that are known here. The roots that
    come with a token count too, because nothing is trusted by this: a verifier names its own.

    Raises AuthorityRevoked, TimestampRequestError, OSError."""
    place = str(getattr(stamping, "url", ""))
    when, found = _asked.get(place, (0.0, None))
    if found is None or not place or time.monotonic() - when > FRESH_S:
        found = await _ask(stamping, roots)
        _asked[place] = time.monotonic(), found
    return found


async def _ask(stamping: TimeStamper, roots: Sequence[x509.Certificate]) -> RevocationData:
    from accept.certificate.signature.servers import BoundedBackend  # loads requests

    token = await stamping.async_dummy_response("sha256")
    carried = [choice.chosen for choice in token["content"]["certificates"]]
    context = ValidationContext(
        trust_roots=[*loaded(roots), *(c for c in carried if c.self_issued)],
        other_certs=carried,
        allow_fetching=True,
        fetcher_backend=BoundedBackend(),
    )
    try:
        found = stamping.validation_paths(context)  # type: ignore[no-untyped-call]  # pyhanko leaves it untyped
        async with asyncio.timeout(ALL_S):
            chains = [list(path) async for path in found]
    except RevokedError as e:
        raise AuthorityRevoked(f"the time stamping authority's certificate is revoked: {e}") from e
    except (PathError, ValidationError, TimeoutError):
        return RevocationData()  # no answer; or its root is not known here: whose answers they would be cannot be said
    return RevocationData([c for chain in chains for c in chain], context.crls, context.ocsps)


def kept_in(document: PdfFileReader) -> DocumentSecurityStore | None:
    """Return what a document keeps, None if it keeps nothing; damaged content raises an exception of any type."""
    try:
        return DocumentSecurityStore.read_dss(document)
    except NoDSSFoundError:
        return None


def revocation_data_of(document: PdfFileReader) -> RevocationData:
    """Return what a document keeps, in its order."""
    kept = kept_in(document)
    if kept is None:
        return RevocationData()
    return RevocationData(
        list(kept.load_certs()),
        [crl.CertificateList.load(each.get_object().data) for each in kept.crls],
        [ocsp.OCSPResponse.load(each.get_object().data) for each in kept.ocsps],
    )


def loaded(certificates: Sequence[x509.Certificate]) -> list[asn1_x509.Certificate]:
    """Return the certificates in the type that pyhanko uses."""
    return [asn1_x509.Certificate.load(c.public_bytes(Encoding.DER)) for c in certificates]
