"""Verification by anyone who holds the bench's CA certificate. What is not proven is not valid."""

import hashlib
import io
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.diff_analysis import ModificationLevel
from pyhanko.sign.fields import MDPPerm, enumerate_sig_fields
from pyhanko.sign.validation import (
    EmbeddedPdfSignature,
    SignatureCoverageLevel,
    validate_pdf_signature,
)
from pyhanko.sign.validation.settings import KeyUsageConstraints
from pyhanko_certvalidator import ValidationContext

from accept.certificate.content import CertificateContent
from accept.certificate.errors import InvalidCertificate, one_line
from accept.certificate.provenance import statements
from accept.certificate.signature import timestamp
from accept.certificate.signature.timestamp import Stamped
from accept.certificate.step import Step
from accept.certificate.trust import authority
from accept.certificate.trust.authority import same_person
from accept.certificate.trust.keys import QA, ROLES, TECHNICIAN
from accept.certificate.trust.revocation import RevocationError, Revoked, entries_of
from accept.certificate.trust.spec_approval import check_spec
from accept.certificate.verify import attachments
from accept.certificate.verify.attachments import Rejudge
from accept.certificate.verify.page_check import check_page
from accept.certificate.verify.signature_contents import byte_range, check_hole, read_hole, signature_of, token_of

_CLOCK_SLACK = timedelta(hours=24)  # between the clocks of the bench and of who verifies
_USAGE = KeyUsageConstraints(key_usage={"digital_signature", "non_repudiation"}, match_all_key_usages=True)
_ORDERS = ((TECHNICIAN,), (TECHNICIAN, QA))
T = TypeVar("T")
# What pyhanko has to say about a broken file ends up in the reason; nobody needs it on stderr too.
for _library in ("pyhanko", "pyhanko_certvalidator"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


class Validity(StrEnum):
    """What verification comes to."""

    VALID = "valid"  # signed, and judged again with the same result, and its page compared
    SIGNED = "signed"  # the signatures hold, but something that bears on the verdict could not be looked at
    NOT_VALID = "not valid"


@dataclass(frozen=True)
class Signed:
    """One valid signature. doubt: why its time alone does not carry it, None where it does. stamped: the timestamp
    beside it, None where there is none."""

    role: str
    person: str
    when: datetime
    doubt: str | None = None
    serial_number: int = 0  # of the signer's certificate
    stamped: Stamped | None = None


@dataclass(frozen=True)
class Verification:
    """Whether a certificate holds; `reason` in one line, `details` a line for each thing that was looked at.

    spec_sha256, head: of the spec that it was judged by, and where the bench's store stood. demo: made by a demo.
    """

    outcome: Validity
    reason: str
    serial: str = ""
    verdict: str = ""
    signatures: tuple[Signed, ...] = ()
    details: tuple[str, ...] = ()
    spec_sha256: str = ""
    head: Mapping[str, Any] | None = None
    demo: bool = False

    @property
    def valid(self) -> bool:
        """Plainly valid: signed, and all of it looked at."""
        return self.outcome is Validity.VALID

    @property
    def countersigned(self) -> bool:
        return any(s.role == QA for s in self.signatures)


def verify(
    pdf: bytes,
    trust: Sequence[x509.Certificate],
    rejudge: Rejudge | None = None,
    now: datetime | None = None,
    *,
    demo: bool = False,
    records: Path | None = None,
    revoked: Sequence[Revoked] = (),
    known: Callable[[CertificateContent], Step] | None = None,
    stamping: Sequence[x509.Certificate] = (),
) -> Verification:
    """Verify a certificate: signatures, coverage of every byte, roles, trust, page, and result.

    trust : CA certificates, the only ones trusted. rejudge : judges the attached unit again (None: it is not).
    now : time of verifying; a signature from the future does not hold. demo : trust authorities of demonstrations, and
    only them. records : folder with the records that were too large to attach. revoked : what the trusted authorities
    revoked. known : what a bench's own store says of it. stamping : trusted roots of time stamping authorities. Never
    raises on any bytes.
    """
    details: list[str] = []
    try:
        roots = _roots(trust, demo)
        signatures, signed = _signatures(pdf, roots, now or datetime.now(UTC), revoked, stamping)
        _check_persons(signatures)
        details += [line for s in signatures for line in (_words(s), _words_of_time(s))]
        details += [] if len(signatures) == 2 else ["countersignature by quality assurance: open"]
        contents = _guarded("the attachments", attachments.read, signed)
        details += [
            one_line(f"{k.lower()}: {v}") for k, v in _guarded("the statements", statements, contents).items() if v
        ]
        _guarded("the attached list of revoked keys", _check_attached_list, contents, signatures, roots)
        judged = contents
        if records is not None:
            judged = _guarded("the records", attachments.with_records, contents, records)
        steps = [
            _guarded("the page", check_page, signed, contents),
            _guarded("judging again", attachments.check_result, judged, rejudge),
            _guarded("the spec", check_spec, contents, roots),
            *([] if known is None else [_guarded("the store", known, contents)]),
        ]
        details += [one_line(step.words) for step in steps if step.words]
    except InvalidCertificate as e:
        return Verification(Validity.NOT_VALID, str(e), details=tuple(details), demo=demo)
    lacking = [step.words for step in steps if not step.complete] + [s.doubt for s in signatures if s.doubt]
    return Verification(
        Validity.SIGNED if lacking else Validity.VALID,
        one_line("; ".join([_summary(contents, signatures), *lacking])),
        contents.serial,
        str(contents.result["verdict"]),
        signatures,
        tuple(details),
        contents.spec_sha256,
        contents.provenance.get("head"),
        demo,
    )


def _summary(contents: CertificateContent, signatures: Sequence[Signed]) -> str:
    state = "countersigned" if len(signatures) == 2 else "countersignature open"
    signed = "; ".join(_words(s) for s in signatures)
    spec = f"spec {contents.spec_name} {contents.spec_sha256[:12]}"
    return f"{contents.serial} {contents.result['verdict']}; {signed}; {state}; {spec}"


def _roots(trust: Sequence[x509.Certificate], demo: bool) -> list[x509.Certificate]:
    """Of the authorities that are trusted those of the asked kind: a demonstration's passphrase is no secret."""
    if not trust:
        raise InvalidCertificate("no CA is trusted: give its certificate")
    roots = [ca for ca in trust if authority.is_demo(ca) == demo]
    if not roots:
        kind = "no demo authority is trusted" if demo else "the authority is that of a demo: accept verify --demo"
        raise InvalidCertificate(kind)
    return roots


def _check_persons(signatures: Sequence[Signed]) -> None:
    """Four eyes are those of two persons."""
    if len(signatures) == 2 and same_person(signatures[0].person, signatures[1].person):
        raise InvalidCertificate(f"{signatures[0].person} signed as technician and as quality assurance")


def _guarded(what: str, step: Callable[..., T], *arguments: Any, **options: Any) -> T:
    """The one place where an error on someone else's bytes becomes a reason: parsers of hostile files fail in any way,
    and whatever they raise, the certificate is not valid."""
    try:
        return step(*arguments, **options)
    except InvalidCertificate:
        raise
    except Exception as e:
        raise InvalidCertificate(f"{what} cannot be read: {type(e).__name__}: {e}") from e


def _signatures(
    pdf: bytes,
    trust: Sequence[x509.Certificate],
    now: datetime,
    revoked: Sequence[Revoked],
    stamping: Sequence[x509.Certificate],
) -> tuple[tuple[Signed, ...], bytes]:
    """The valid signatures, and the bytes that the first one covers."""
    if not pdf.startswith(b"%PDF-"):
        raise InvalidCertificate("not a PDF file" if pdf else "the file is empty")
    embedded = _guarded("the PDF", lambda: _embedded(PdfFileReader(io.BytesIO(pdf))))
    places = [_guarded("the signature", byte_range, s.byte_range, len(pdf)) for s in embedded]
    if places[-1][2] != len(pdf):
        raise InvalidCertificate(f"{len(pdf) - places[-1][2]} bytes follow the part that the last signature covers")
    # All digests before any chain or difference: what is broken is found at once.
    certificates = [
        _guarded("the signature", _certificate, pdf, s, p, trust) for s, p in zip(embedded, places, strict=True)
    ]
    found = [
        _guarded(
            f"the signature of the {s.field_name}",
            _signature,
            s,
            c,
            trust,
            now,
            revoked,
            stamping,
            covers_all=p[2] == len(pdf),
        )
        for s, c, p in zip(embedded, certificates, places, strict=True)
    ]
    if len(found) == 2 and found[1].when < found[0].when - _CLOCK_SLACK:
        raise InvalidCertificate("the countersignature is older than the technician's signature")
    return tuple(found), pdf[: places[0][2]]


def _embedded(reader: PdfFileReader) -> list[EmbeddedPdfSignature]:
    """Technician, or technician and QA, each in a revision of its own after the first; nothing else in the file."""
    if reader.encrypted:
        raise InvalidCertificate("the file is encrypted")
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
    if revisions != len(found) + 1 or [s.signed_revision for s in found] != list(range(1, revisions)):
        raise InvalidCertificate(
            f"the file has {revisions} revisions for {len(found)} signatures: something else was added"
        )
    fields = {name for name, _, _ in enumerate_sig_fields(reader)}
    if fields != set(ROLES):
        raise InvalidCertificate(f"the signature fields are {', '.join(sorted(fields))}, expected {', '.join(ROLES)}")
    return found


def _certificate(
    pdf: bytes, embedded: EmbeddedPdfSignature, place: tuple[int, int, int], trust: Sequence[x509.Certificate]
) -> x509.Certificate:
    """Certificate of a signature whose hole is canonical and whose digest fits the document."""
    start, end, last = place
    content = read_hole(pdf, start, end)
    if embedded.pkcs7_content != content:
        raise InvalidCertificate("the signature that was read is not the one in the hole")
    digest = hashlib.sha256(pdf[:start] + pdf[end:last]).digest()
    return check_hole(content, digest, trust)


def _signature(
    embedded: EmbeddedPdfSignature,
    certificate: x509.Certificate,
    trust: Sequence[x509.Certificate],
    now: datetime,
    revoked: Sequence[Revoked],
    stamping: Sequence[x509.Certificate],
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
    doubt = _doubt(certificate, when, revoked, stamped)
    return Signed(role, authority.person_of(certificate), when, doubt, certificate.serial_number, stamped)


def _stamped(embedded: EmbeddedPdfSignature, when: datetime, roots: Sequence[x509.Certificate]) -> Stamped | None:
    """The timestamp beside a signature. Raises InvalidCertificate for one that is wrong, or says another day than the
    signer's clock."""
    token = token_of(embedded.pkcs7_content)
    if token is None:
        return None
    found = timestamp.checked(token, signature_of(embedded.pkcs7_content), roots)
    if abs(found.when - when) > _CLOCK_SLACK:
        raise InvalidCertificate(
            f"it says that it was signed at {when:%Y-%m-%d %H:%M}, its timestamp says {found.when:%Y-%m-%d %H:%M} UTC"
        )
    return found


def _check_attached_list(
    contents: CertificateContent, signatures: Sequence[Signed], roots: Sequence[x509.Certificate]
) -> None:
    """Keys that were revoked already when the unit was judged, by the list as it was then."""
    given = contents.provenance.get("crl")
    if given is None:
        return
    for ca in roots:
        try:
            entries = entries_of(str(given).encode(), "the attached list", ca)
        except RevocationError:
            continue  # of another authority among those trusted
        for entry in entries:
            for signed in signatures:
                if signed.serial_number == entry.serial_number and signed.when >= entry.since:
                    raise InvalidCertificate(f"the key of {signed.person} was revoked on {entry.since:%Y-%m-%d}")
        return
    raise InvalidCertificate("the attached list of revoked keys is of no trusted authority")


def _doubt(
    certificate: x509.Certificate, when: datetime, revoked: Sequence[Revoked], stamped: Stamped | None
) -> str | None:
    """Raises InvalidCertificate for a signature made after its key was revoked. One made before holds, unless somebody
    else may have the key: he could have set the clock back, but not that of a trusted timestamp."""
    person = authority.person_of(certificate)
    for entry in revoked:
        if entry.serial_number != certificate.serial_number:
            continue
        if when >= entry.since:
            raise InvalidCertificate(f"the key of {person} was revoked on {entry.since:%Y-%m-%d}, before it signed")
        if entry.compromised and not (stamped and stamped.trusted and stamped.when < entry.since):
            return f"the key of {person} was compromised, and only its owner's clock says that it signed before"
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
    """Digest, signature value, chain, key usage, coverage and what changed since, as pyhanko sees them."""
    roots = [asn1_x509.Certificate.load(c.public_bytes(Encoding.DER)) for c in trust]
    context = ValidationContext(trust_roots=roots, moment=when, allow_fetching=False)
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


def _words_of_time(signed: Signed) -> str:
    """Which time it is: a trusted timestamp's, or the bench's clock."""
    by_heads = "the bench's clock; the signed heads of its store order certificates"
    if signed.stamped is None:
        return f"time of the {signed.role}: {by_heads}"
    at = f"timestamp of {signed.stamped.when:%Y-%m-%d %H:%M:%S} UTC by {one_line(signed.stamped.by)}"
    if signed.stamped.trusted:
        return f"time of the {signed.role}: trusted {at}"
    return f"time of the {signed.role}: {by_heads}; a {at}, who is not trusted here (--tsa-trust)"


def _words(signed: Signed) -> str:
    return f"signed by {signed.person} as {signed.role} on {signed.when:%Y-%m-%d %H:%M:%S %Z}"
