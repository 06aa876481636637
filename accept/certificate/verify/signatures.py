"""The signatures on a certificate: in order, each over the whole file so far, by a key that was valid for its role
then."""

import copyreg
import hashlib
import io
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.diff_analysis import ModificationLevel
from pyhanko.sign.fields import MDPPerm, enumerate_sig_fields
from pyhanko.sign.validation import EmbeddedPdfSignature, SignatureCoverageLevel, validate_pdf_signature
from pyhanko.sign.validation.settings import KeyUsageConstraints
from pyhanko_certvalidator import ValidationContext

from accept.base.names import same_person
from accept.certificate.contents.disposition import of_signature
from accept.certificate.contents.outcome import InvalidCertificate, guarded, one_line
from accept.certificate.signature import timestamp
from accept.certificate.signature.long_term import kept_in, loaded
from accept.certificate.signature.timestamp import Stamped
from accept.certificate.trust import authority
from accept.certificate.trust.authority import QA, ROLES, TECHNICIAN
from accept.certificate.trust.revocation import Revoked
from accept.certificate.verify.signature_contents import byte_range, check_hole, read_hole, signature_of, token_of
from accept.certificate.verify.structure import SAVED_AGAIN

_CLOCK_SLACK = timedelta(hours=24)  # between the clocks of the bench and of the verifier
_USAGE = KeyUsageConstraints(key_usage={"digital_signature", "non_repudiation"}, match_all_key_usages=True)
_MOST_FIELDS = 8  # a form with more is not that of a certificate and is not read further
_ORDERS = ((TECHNICIAN,), (TECHNICIAN, QA))
# What pyhanko reports on a broken file is part of the reason; it is not repeated on stderr.
for _library in ("pyhanko", "pyhanko_certvalidator"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


def _loaded(encoding: bytes) -> x509.Certificate:
    return x509.load_der_x509_certificate(encoding)


# The object itself cannot be handed to another process.
copyreg.pickle(x509.Certificate, lambda c: (_loaded, (c.public_bytes(Encoding.DER),)))


@dataclass(frozen=True)
class Signed:
    """One valid signature. certificate: the signer's; place: start and end of the hole with the signature, end of the
    bytes that it covers. doubt: why its time does not suffice to accept it, None if it does. stamped: the timestamp
    beside it, None without one. disposition: of a unit that was not accepted, as decided in the countersignature."""

    role: str
    person: str
    when: datetime
    certificate: x509.Certificate
    place: tuple[int, int, int]
    doubt: str | None = None
    stamped: Stamped | None = None
    disposition: str = ""


def signatures_of(
    pdf: bytes,
    trust: Sequence[x509.Certificate],
    now: datetime,
    revoked: Sequence[Revoked],
    stamping: Sequence[x509.Certificate],
) -> tuple[Signed, ...]:
    """Return the valid signatures."""
    try:
        embedded = _embedded(PdfFileReader(io.BytesIO(pdf)))
    except InvalidCertificate:
        raise
    except Exception as e:  # a parser of hostile bytes fails in any way, and its words would not help the reader
        raise InvalidCertificate(f"the PDF is damaged, or {SAVED_AGAIN}: verify the file as it was issued") from e
    places = [guarded("the signature", byte_range, s.byte_range, len(pdf)) for s in embedded]
    if places[-1][2] != len(pdf):
        raise InvalidCertificate(f"{len(pdf) - places[-1][2]} bytes follow the part that the last signature covers")
    # All digests before any chain or difference: what is broken is found at once.
    certificates = [
        guarded("the signature", _certificate, pdf, s, p, trust) for s, p in zip(embedded, places, strict=True)
    ]
    found = [
        guarded(
            f"the signature of the {s.field_name}", _signature, s, c, trust, now, revoked, stamping,
            place=p, covers_all=p[2] == len(pdf),
        )
        for s, c, p in zip(embedded, certificates, places, strict=True)
    ]  # fmt: skip
    if len(found) == 2 and found[1].when < found[0].when - _CLOCK_SLACK:
        raise InvalidCertificate("the countersignature is older than the technician's signature")
    if len(found) == 2 and same_person(found[0].person, found[1].person):
        raise InvalidCertificate(f"{found[0].person} signed as technician and as quality assurance")
    return tuple(found)


def _embedded(reader: PdfFileReader) -> list[EmbeddedPdfSignature]:
    """Return the signatures: technician, or technician and QA, each in a revision of its own after the first, and
    nothing else in the file."""
    if reader.encrypted:
        raise InvalidCertificate("the file is encrypted")
    _check_forms(reader)
    found = list(reader.embedded_signatures)
    names = tuple(s.field_name for s in found)
    filled = {name for name, value, _ in enumerate_sig_fields(reader) if value is not None}
    if not names and not filled:
        raise InvalidCertificate("it is not signed")
    if names not in _ORDERS or filled != set(names):
        raise InvalidCertificate(
            f"signed by {', '.join(sorted(filled | set(names)))}: expected technician, then at most qa"
        )
    revisions = reader.xrefs.total_revisions
    if revisions <= len(found):
        raise InvalidCertificate(f"it has lost a revision: {SAVED_AGAIN}")
    if revisions != len(found) + 1 or [s.signed_revision for s in found] != list(range(1, revisions)):
        raise InvalidCertificate(
            f"the file has {revisions} revisions for {len(found)} signatures: something else was added"
        )
    fields = {name for name, _, _ in enumerate_sig_fields(reader)}
    if fields != set(ROLES):
        raise InvalidCertificate(f"the signature fields are {', '.join(sorted(fields))}, expected {', '.join(ROLES)}")
    return found


def _check_forms(reader: PdfFileReader) -> None:
    """Raise InvalidCertificate if any revision has a form with many fields or with fields below fields: the program
    writes two. Fields that name each other twice would double the time of a walk over them at every level."""
    for revision in range(reader.xrefs.total_revisions):
        root = reader.get_historical_root(revision)
        form = root["/AcroForm"] if "/AcroForm" in root else {}  # noqa: SIM401 - `get` does not follow references
        fields = form["/Fields"] if "/Fields" in form else []  # noqa: SIM401
        if len(fields) > _MOST_FIELDS or any("/Kids" in fields[n] for n in range(len(fields))):
            raise InvalidCertificate(f"the form has {len(fields)} fields, or fields below fields: expected two")


def _certificate(
    pdf: bytes, embedded: EmbeddedPdfSignature, place: tuple[int, int, int], trust: Sequence[x509.Certificate]
) -> x509.Certificate:
    """Return the certificate of a signature whose placeholder is canonical and whose digest fits the document."""
    start, end, last = place
    content = read_hole(pdf, start, end)
    if embedded.pkcs7_content != content:
        raise InvalidCertificate("the signature that was read is not the one in the hole")
    digest = hashlib.sha256(memoryview(pdf)[:start])
    digest.update(memoryview(pdf)[end:last])
    return check_hole(content, digest.digest(), trust)


def _signature(
    embedded: EmbeddedPdfSignature,
    certificate: x509.Certificate,
    trust: Sequence[x509.Certificate],
    now: datetime,
    revoked: Sequence[Revoked],
    stamping: Sequence[x509.Certificate],
    place: tuple[int, int, int],
    covers_all: bool,
) -> Signed:
    role = str(embedded.field_name)
    if authority.role_of(certificate) != role:
        raise InvalidCertificate(
            f"the {role}'s field is signed by a certificate for '{authority.role_of(certificate)}'"
        )
    when = _time(embedded, certificate, now)
    _check_by_pyhanko(embedded, trust, when, covers_all)
    if role == TECHNICIAN and embedded.docmdp_level != MDPPerm.FILL_FORMS:
        raise InvalidCertificate("the technician's signature does not forbid later changes")
    stamped = _stamped(embedded, when, stamping)
    doubt = doubt_of(certificate, when, revoked, stamped)
    if doubt is None and when > now + timedelta(minutes=5):  # what was judged until then would count as earlier
        doubt = f"it is dated {when:%Y-%m-%d %H:%M} UTC, and here it is {now:%Y-%m-%d %H:%M}"
    disposition = of_signature(one_line(str(embedded.sig_object.get("/Reason", "")))) if role == QA else ""
    person = authority.person_of(certificate)
    return Signed(role, person, when, certificate, place, doubt, stamped, disposition)


def _stamped(embedded: EmbeddedPdfSignature, when: datetime, roots: Sequence[x509.Certificate]) -> Stamped | None:
    """Return the timestamp beside a signature. Raises InvalidCertificate if it is wrong, or its day is not that of the
    signer's clock."""
    token = token_of(embedded.pkcs7_content)
    if token is None:
        return None
    kept = kept_in(embedded.reader)
    found = timestamp.checked(token, signature_of(embedded.pkcs7_content), roots, kept)
    if abs(found.when - when) > _CLOCK_SLACK:
        raise InvalidCertificate(
            f"it says that it was signed at {when:%Y-%m-%d %H:%M}, its timestamp says {found.when:%Y-%m-%d %H:%M} UTC"
        )
    return found


def doubt_of(
    certificate: x509.Certificate, when: datetime, revoked: Sequence[Revoked], stamped: Stamped | None
) -> str | None:
    """Return why a signature made before its key was revoked is in doubt, None if it is not. It is if another person
    may have the key, who could have set the clock back, but not that of a trusted timestamp. Raises InvalidCertificate
    if the signature was made after its key was revoked."""
    person = authority.person_of(certificate)
    for entry in revoked:
        if entry.serial_number != certificate.serial_number:
            continue
        if when >= entry.since:
            raise InvalidCertificate(f"the key of {person} was revoked on {entry.since:%Y-%m-%d}, before it signed")
        if entry.compromised and not (stamped and stamped.trusted and stamped.when < entry.since):
            return f"the key of {person} was lost or compromised, and only a clock says that it signed before"
    return None


def _time(embedded: EmbeddedPdfSignature, certificate: x509.Certificate, now: datetime) -> datetime:
    when = embedded.self_reported_timestamp
    if when is None or when.tzinfo is None:
        raise InvalidCertificate("the signature does not say when it was made")
    if when > now + _CLOCK_SLACK:
        raise InvalidCertificate(f"it was signed in the future, at {when.isoformat()}")
    if not certificate.not_valid_before_utc <= when <= certificate.not_valid_after_utc:
        raise InvalidCertificate(
            f"the certificate of {authority.person_of(certificate)} was not valid at {when.isoformat()}"
        )
    return when


def _check_by_pyhanko(
    embedded: EmbeddedPdfSignature, trust: Sequence[x509.Certificate], when: datetime, covers_all: bool
) -> None:
    context = ValidationContext(trust_roots=loaded(trust), moment=when, allow_fetching=False)
    status = validate_pdf_signature(embedded, context, key_usage_settings=_USAGE)
    if not status.intact:
        raise InvalidCertificate(f"the {embedded.field_name}'s signature does not fit the document: it was changed")
    if not status.valid:
        raise InvalidCertificate(f"the {embedded.field_name}'s signature value is wrong")
    if not status.trusted:
        raise InvalidCertificate(
            f"the {embedded.field_name}'s certificate is not trusted: {status.trust_problem_indic}"
        )
    expected = SignatureCoverageLevel.ENTIRE_FILE if covers_all else SignatureCoverageLevel.ENTIRE_REVISION
    level = status.modification_level
    allowed = ModificationLevel.NONE if covers_all else ModificationLevel.FORM_FILLING
    if status.coverage != expected or level is None or level > allowed:
        raise InvalidCertificate(f"the document was changed after the {embedded.field_name} signed it")
    if not replace(status, timestamp_validity=None).bottom_line:  # `timestamp.checked` looks at that
        raise InvalidCertificate(f"the {embedded.field_name}'s signature does not hold: {status.summary()}")
