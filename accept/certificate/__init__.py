"""Certificates: made of a judged unit, signed, and verified by anyone who has the authority's certificate.

    contents = content_of(result, spec, folder, "Ann", provenance={"attempt": 1})  # reads the inputs that it attaches
    pdf = drawn(contents, home)  # unsigned; equal contents give equal bytes

    sign_into(path, pdf, credential, store, contents.serial, "Ann")  # written, and its signature stored

    found = verify_certificate(read_certificate(path), [credential.ca], ports(rejudge))  # never raises on any bytes
    found.valid, found.reason, found.details  # in one line, and a line for each thing that was checked
    verify_certificate(pdf, [credential.ca], ports(rejudge), known=at_bench(ListsBeside({})))  # asks the store too

    read_contents(read_certificate(path)).result  # the attached result, by its hashes alone

The keys of the bench, and what is trusted by them, are in `accept.certificate.trust`. Errors are `ContentError`,
`SigningRefused`, `DispositionError` and `InvalidCertificate`. reportlab and pyHanko are loaded when they are needed."""

from typing import TYPE_CHECKING

from accept.certificate.deferred_imports import defer
from specs import door

defer()  # before anything here loads pyHanko

if TYPE_CHECKING:
    from accept.certificate.certify import Issuer, drawn, sign_into
    from accept.certificate.contents.content import CertificateContent, ContentError
    from accept.certificate.contents.disposition import DispositionError, parse_disposition, parse_signing_reason
    from accept.certificate.contents.gathering import content_of
    from accept.certificate.contents.iso17025 import missing_statements
    from accept.certificate.contents.laboratory import LABORATORY_FILE, laboratory_of
    from accept.certificate.contents.outcome import InvalidCertificate
    from accept.certificate.contents.provenance import Provenance, needs_reason
    from accept.certificate.contents.statements import models_words
    from accept.certificate.signature.signing import SigningRefused
    from accept.certificate.signature.timestamp import TSA_VARIABLE
    from accept.certificate.trust.provenance import amended, ends_before
    from accept.certificate.verify.against_list import trusted_lists
    from accept.certificate.verify.lists_beside import ListsBeside
    from accept.certificate.verify.rejudge import (
        at_bench,
        is_valid_demo,
        ports,
        read_certificate,
        read_contents,
        ready,
        rejudge,
        rejudge_demo,
    )
    from accept.certificate.verify.verification import Validity, Verification, verify_certificate
else:
    __getattr__ = door(__name__)
