"""PAdES signatures: the technician certifies the document, quality assurance countersigns it; both only append."""

import asyncio
import hashlib
import io
from datetime import UTC, datetime

from asn1crypto import keys as asn1_keys
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature, encode_dss_signature
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
from pyhanko.pdf_utils.misc import PdfError
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.fields import MDPPerm, SigSeedSubFilter, enumerate_sig_fields
from pyhanko.sign.general import SigningError
from pyhanko.sign.signers import ExternalSigner, PdfSignatureMetadata, PdfSigner, Signer, SimpleSigner
from pyhanko.sign.signers.pdf_cms import PdfCMSSignedAttributes
from pyhanko.sign.signers.pdf_signer import PdfTBSDocument
from pyhanko.sign.timestamps import TimeStamper
from pyhanko.sign.timestamps.common_utils import TimestampRequestError
from pyhanko_certvalidator.registry import SimpleCertificateStore

from accept.certificate.contents.disposition import in_signature
from accept.certificate.page.fixed_parts import field_rectangles
from accept.certificate.signature import timestamp
from accept.certificate.signature.long_term import RevocationData, loaded
from accept.certificate.signature.stamp import stamp_style
from accept.certificate.signature.stamping_authority import AuthorityRevoked, revocation_data, stamper
from accept.certificate.trust.authority import P256_ORDER, QA, TECHNICIAN
from accept.certificate.trust.keys import Credential
from accept.store.payloads import Disposition
from specs.errors import AcceptError

RESERVED = 4096  # bytes of the hole; our CMS takes some 2000
_REASONS = {TECHNICIAN: "measured and judged", QA: "reviewed and countersigned"}
_BEFORE = {TECHNICIAN: [], QA: [TECHNICIAN]}


class SigningRefused(AcceptError, ValueError):
    """A document that must not be signed in this role now; the text says why."""


class _Revision(IncrementalPdfFileWriter):
    """The revision that a signature adds. Neither the clock nor chance decide its bytes, so that `verify` can write it
    again: no time of changing is stated beside that of signing, and its identifier is the hash of what was before."""

    @classmethod
    def _handle_id(cls, prev: PdfFileReader) -> generic.ArrayObject:
        before = hashlib.sha256(prev.stream.getvalue()).digest()[:16]
        first = prev.trailer["/ID"][0]
        return generic.ArrayObject([first, generic.ByteStringObject(before)])

    def _update_meta(self) -> None:
        """Leave the document's information as it is."""


class LowS(Signer):
    """Mix-in before any ECDSA signer: s goes to the lower half. Of the two valid values of s one is written, so that it
    cannot be exchanged for the other; `verify` accepts no other."""

    async def async_sign_raw(self, data: bytes, digest_algorithm: str, dry_run: bool = False) -> bytes:
        r, s = decode_dss_signature(await super().async_sign_raw(data, digest_algorithm, dry_run))
        return encode_dss_signature(r, min(s, P256_ORDER - s))


class _Signer(LowS, SimpleSigner):
    """ECDSA with the nonce of [RFC6979]."""

    def sign_raw(self, data: bytes, digest_algorithm: str) -> bytes:
        key = serialization.load_der_private_key(self.signing_key.dump(), password=None)
        if not isinstance(key, ec.EllipticCurvePrivateKey) or digest_algorithm != "sha256":
            raise SigningError(f"certificates are signed with P-256 and SHA-256, not {digest_algorithm}")
        return key.sign(data, ec.ECDSA(hashes.SHA256(), deterministic_signing=True))


def sign(
    pdf: bytes,
    credential: Credential,
    when: datetime,
    signer: Signer | None = None,
    stamping: TimeStamper | None = None,
    disposition: Disposition | None = None,
    simulated: bool = False,
) -> bytes:
    """Return the document with one more signature; the bytes before it stay as they are.

    when : time of signing with its zone; the bench's clock.
    signer : signs in place of the credential's key, e.g. `LowS` over pyhanko's PKCS11Signer
        (docs/explanation/signing.md).
    stamping : asked for a trusted timestamp in place of the credential's authority.
    disposition : of a unit that was not accepted, decided in the countersignature.
    simulated : no instrument measured the unit; the box of the signature says so.
    Raises SigningRefused: the key is not valid then, out of order (technician, then qa), signed already, no
    certificate, or no timestamp although one is required.
    """
    if when.tzinfo is None:
        raise SigningRefused("the time of signing has no time zone")
    valid_to = credential.certificate.not_valid_after_utc
    if not credential.certificate.not_valid_before_utc <= when <= valid_to:
        words = f"the key of {credential.person}, valid to {valid_to:%Y-%m-%d}, is not valid at {when:%Y-%m-%d %H:%M}"
        raise SigningRefused(f"{words} UTC; what it signs would not verify")
    try:
        _check_order(pdf, credential.role)
        asked = stamping or (stamper(credential.tsa) if credential.tsa else None)
        kept = asyncio.run(revocation_data(asked, credential.tsa_roots)) if asked else RevocationData()
        moment = when.astimezone(UTC).replace(microsecond=0)
        out = io.BytesIO()
        asyncio.run(
            _append(out, pdf, credential, moment, signer or _signer(credential), asked, kept, disposition, simulated)
        )
        return out.getvalue()
    except (TimestampRequestError, OSError) as e:
        raise SigningRefused(f"no timestamp from {credential.tsa or 'the authority'}: {e}; nothing was signed") from e
    except AuthorityRevoked as e:
        raise SigningRefused(f"{e}; nothing was signed") from e
    except (PdfError, SigningError) as e:
        raise SigningRefused(f"cannot be signed as {credential.role}: {e}") from e


def _check_order(pdf: bytes, role: str) -> None:
    reader = PdfFileReader(io.BytesIO(pdf))
    filled = [name for name, value, _ in enumerate_sig_fields(reader) if value is not None]
    if filled != _BEFORE[role]:
        have = f"it is signed by {', '.join(filled)}" if filled else "it has no signature"
        when = f"signs after {', '.join(_BEFORE[role])}" if _BEFORE[role] else "signs first"
        raise SigningRefused(f"{have}; {role} {when}")


async def _append(
    out: io.BytesIO,
    pdf: bytes,
    credential: Credential,
    when: datetime,
    by: Signer,
    stamping: TimeStamper | None,
    kept: RevocationData,
    disposition: Disposition | None,
    simulated: bool,
) -> None:
    """Write the document with one more signature to `out`. Nothing large is returned: asyncio writes the result of a
    finished task out as text when it gives the signal of Ctrl-C back."""
    signer = _pdf_signer(credential, when, by, disposition, simulated, stamping)
    document = _prepared(pdf, signer, when, kept, stamping is not None)
    prepared, _ = document.digest_tbs_document(output=out)
    attributes = PdfCMSSignedAttributes(signing_time=when)
    await document.perform_signature(prepared.document_digest, pdf_cms_signed_attrs=attributes)


def _pdf_signer(
    credential: Credential,
    when: datetime,
    by: Signer,
    disposition: Disposition | None,
    simulated: bool,
    stamping: TimeStamper | None = None,
) -> PdfSigner:
    left, bottom, right, top = field_rectangles()[credential.role]
    return PdfSigner(
        _metadata(credential, disposition),
        signer=by,
        timestamper=stamping,
        stamp_style=stamp_style(credential, when, (right - left, top - bottom), disposition, simulated),
    )


def _prepared(pdf: bytes, signer: PdfSigner, when: datetime, kept: RevocationData, timestamped: bool) -> PdfTBSDocument:
    """Return the document with one more revision, whose signature is still empty. timestamped: leave room for it."""
    writer = _Revision(io.BytesIO(pdf))
    kept.write(writer)
    session = signer.init_signing_session(writer, existing_fields_only=True)
    session.system_time = when
    room = RESERVED + (timestamp.LARGEST if timestamped else 0)
    return session.prepare_tbs_document(validation_info=None, bytes_reserved=2 * room)


def signed_again(
    pdf: bytes,
    credential: Credential,
    when: datetime,
    kept: RevocationData,
    disposition: Disposition | None,
    simulated: bool,
    timestamped: bool,
) -> bytes:
    """Return the document as `sign` writes it, with zeros in place of the signature's contents: what a signer with this
    certificate can only have signed. No key is needed."""
    (certificate,) = loaded([credential.certificate])
    by = ExternalSigner(certificate, SimpleCertificateStore(), signature_value=1)  # type: ignore[no-untyped-call]
    signer = _pdf_signer(credential, when, by, disposition, simulated)
    document = _prepared(pdf, signer, when, kept, timestamped)
    out = io.BytesIO()
    document.digest_tbs_document(output=out)
    return out.getvalue()


def _metadata(credential: Credential, disposition: Disposition | None) -> PdfSignatureMetadata:
    """Return the settings of a signature. The technician certifies: from then on only the other signature field may be
    filled, and after it nothing."""
    return PdfSignatureMetadata(
        field_name=credential.role,
        md_algorithm="sha256",
        name=credential.person,
        reason=in_signature(_REASONS[credential.role], disposition),
        subfilter=SigSeedSubFilter.PADES,
        certify=credential.role == TECHNICIAN,
        docmdp_permissions=MDPPerm.FILL_FORMS if credential.role == TECHNICIAN else MDPPerm.NO_CHANGES,
    )


def _signer(credential: Credential) -> Signer:
    if credential.key is None:
        raise SigningRefused(f"no key found to sign as {credential.role}")
    certificate, root = loaded([credential.certificate, credential.ca])
    plain = credential.key.private_bytes(
        serialization.Encoding.DER, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    store = SimpleCertificateStore()  # type: ignore[no-untyped-call]
    store.register(root)
    return _Signer(certificate, asn1_keys.PrivateKeyInfo.load(plain), store)
