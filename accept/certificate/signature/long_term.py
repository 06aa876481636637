"""Revocation data of a time stamping authority ([PADES], level B-LT): the answers of its servers are kept in the
document, so that it can be verified without them later that its certificates were not revoked when it stamped.

The servers are asked before the signature is made and the answers written with it, so it covers them too.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from asn1crypto import crl, ocsp
from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.pdf_utils.writer import BasePdfFileWriter
from pyhanko.sign.validation.dss import DocumentSecurityStore
from pyhanko.sign.validation.errors import NoDSSFoundError


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
