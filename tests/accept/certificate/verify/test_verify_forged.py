"""Verification: what was added to a certificate, and signatures by other keys or in other roles, are found."""

import asyncio
import io
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from asn1crypto import crl
from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
from pyhanko.sign.fields import SigFieldSpec, SigSeedSubFilter, append_signature_field
from pyhanko.sign.signers import PdfSignatureMetadata, PdfSigner
from pypdf import PdfReader, PdfWriter

from accept.certificate import SigningRefused
from accept.certificate.contents import content as certificate_content
from accept.certificate.page.document import render
from accept.certificate.signature.long_term import RevocationData
from accept.certificate.signature.signing import _append, _signer, sign
from accept.certificate.trust import authority
from accept.certificate.trust.keys import QA, TECHNICIAN, Credential
from tests.accept.certificate.certificate_help import WHEN, certificate_contents, judged_again, result
from tests.accept.certificate.verify.verify_help import LATER, NOW, Bench, credentials, refused, verify

NOTHING = RevocationData()


# --- added revisions -------------------------------------------------------------------------------------------------


def increment(pdf: bytes, change: Callable[[IncrementalPdfFileWriter], None]) -> bytes:
    writer = IncrementalPdfFileWriter(io.BytesIO(pdf))
    change(writer)
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def overwrite_page(writer: IncrementalPdfFileWriter) -> None:
    stream = generic.StreamObject(stream_data=b"BT /F1 40 Tf 100 700 Td (ACCEPTED) Tj ET")
    writer.add_stream_to_page(0, writer.add_object(stream))


def test_a_file_that_another_program_has_saved_is_called_so(bench: Bench) -> None:
    writer = PdfWriter(clone_from=PdfReader(io.BytesIO(bench.signed)))
    out = io.BytesIO()
    writer.write(out)
    refused(bench.check(out.getvalue()), "another program has saved it again")
    refused(bench.check(bench.signed.replace(b"/Root", b"/Rott")), "damaged, or another program has saved it again")


def change_title(writer: IncrementalPdfFileWriter) -> None:
    writer.set_info(generic.DictionaryObject({generic.pdf_name("/Title"): generic.pdf_string("better")}))


def change_nothing(writer: IncrementalPdfFileWriter) -> None:
    writer.update_root()


def swap_attachment(writer: IncrementalPdfFileWriter) -> None:
    names = writer.root["/Names"]["/EmbeddedFiles"]["/Names"]
    file = names[2 * [str(names[n]) for n in range(0, len(names), 2)].index("results.json") + 1]
    stream = file["/EF"].raw_get("/F")
    content = certificate_content.canonical(result(4.99, 365.5).to_json())
    writer.objects[(stream.generation, stream.idnum)] = generic.StreamObject(stream_data=content)


@pytest.mark.parametrize("change", [overwrite_page, change_title, change_nothing, swap_attachment])
@pytest.mark.parametrize("state", ["signed", "countersigned"])
def test_an_appended_increment_is_found(
    bench: Bench, state: str, change: Callable[[IncrementalPdfFileWriter], None]
) -> None:
    refused(bench.check(increment(getattr(bench, state), change)))


@pytest.mark.parametrize("change", [overwrite_page, swap_attachment, change_title])
def test_an_increment_under_the_countersignature_is_found(
    bench: Bench, change: Callable[[IncrementalPdfFileWriter], None]
) -> None:
    """The QA's key signs a document that was changed after the technician signed it: revisions are counted."""
    refused(bench.check(sign(increment(bench.signed, change), bench.qa, LATER)), "revisions")


def approval(pdf: bytes, credential: Credential, field: str) -> bytes:
    """An ordinary signature in any field, made when absent: what other programs can add."""
    writer = IncrementalPdfFileWriter(io.BytesIO(pdf))
    if field not in (TECHNICIAN, QA):
        append_signature_field(writer, SigFieldSpec(field, box=(400, 20, 500, 60)))
    metadata = PdfSignatureMetadata(field, md_algorithm="sha256", subfilter=SigSeedSubFilter.PADES)
    signer = PdfSigner(metadata, signer=_signer(credential))
    out = io.BytesIO()
    signer.sign_pdf(writer, output=out)
    return out.getvalue()


@pytest.mark.parametrize("state", ["signed", "countersigned"])
def test_a_third_signature_is_found_even_by_a_known_key(bench: Bench, state: str) -> None:
    foreign = replace(credentials()[1], role=QA)
    for credential in (bench.technician, bench.qa, foreign):
        refused(bench.check(approval(getattr(bench, state), credential, "third")), "third", "revisions")


# --- wrong keys and roles --------------------------------------------------------------------------------------------


def test_a_foreign_bench_with_the_same_names_is_refused(bench: Bench, tmp_path: Path) -> None:
    technician, qa = credentials()
    unsigned = render(certificate_contents(tmp_path, ca=technician.ca))
    forged = sign(sign(unsigned, technician, WHEN), qa, LATER)
    refused(bench.check(forged), "not made under a trusted CA")
    assert verify(forged, [technician.ca], lambda _: judged_again(), now=NOW).valid  # it is only the trust that lacks
    refused(bench.check(sign(bench.signed, qa, LATER)), "not made under a trusted CA")


def test_a_root_of_the_same_name_is_refused(bench: Bench) -> None:
    """The forged root copies the subject and the key identifier of the real one, and puts its own key under them."""
    real, key = bench.technician.ca, authority.new_key()
    builder = x509.CertificateBuilder().subject_name(real.subject).issuer_name(real.subject)
    builder = builder.serial_number(real.serial_number).public_key(key.public_key())
    builder = builder.not_valid_before(real.not_valid_before_utc).not_valid_after(real.not_valid_after_utc)
    for extension in real.extensions:
        builder = builder.add_extension(extension.value, extension.critical)
    root = builder.sign(key, real.signature_hash_algorithm)
    leaf_key = authority.new_key()
    leaf = authority.leaf(TECHNICIAN, "M. Keller", leaf_key.public_key(), root, key, WHEN)
    refused(bench.check(sign(bench.unsigned, Credential(TECHNICIAN, leaf_key, leaf, root), WHEN)), "trusted CA")
    # And with the real root carried along, so that the bytes of the root are the trusted ones.
    refused(
        bench.check(sign(bench.unsigned, Credential(TECHNICIAN, leaf_key, leaf, real), WHEN)), "not trusted", "value"
    )


def test_a_certificate_with_another_key_is_refused(bench: Bench) -> None:
    """The technician's certificate, but the signature by some other key."""
    stolen = replace(bench.technician, key=authority.new_key())
    refused(bench.check(sign(bench.unsigned, stolen, WHEN)), "signature value is wrong")


def test_a_technician_who_does_not_certify_is_refused(bench: Bench) -> None:
    """An ordinary signature by the right key would leave the document open to other changes."""
    refused(bench.check(approval(bench.unsigned, bench.technician, TECHNICIAN)), "does not forbid later changes")


def test_swapped_roles_are_refused(bench: Bench) -> None:
    as_technician, as_qa = replace(bench.qa, role=TECHNICIAN), replace(bench.technician, role=QA)
    refused(bench.check(sign(bench.unsigned, as_technician, WHEN)), "by a certificate for 'qa'")
    refused(bench.check(sign(bench.signed, as_qa, LATER)), "by a certificate for 'technician'")
    refused(bench.check(sign(sign(bench.unsigned, as_technician, WHEN), as_qa, LATER)), "by a certificate for")


def appended(pdf: bytes, credential: Credential, when: datetime, kept: RevocationData = NOTHING) -> bytes:
    """Return the document with one more signature, whatever the rules of signing say of it."""
    out = io.BytesIO()
    asyncio.run(_append(out, pdf, credential, when, _signer(credential), None, kept, None, False))
    return out.getvalue()


def test_revocation_data_without_a_timestamp_are_refused(bench: Bench) -> None:
    """They belong to a time stamping authority; a list has room for anything, and no key of this bench signs it."""
    key, now = authority.new_key(), WHEN + timedelta(days=1)
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "stranger")])
    payload = x509.UnrecognizedExtension(x509.ObjectIdentifier("1.2.3.4"), b"the unit is ACCEPTED " * 99)
    builder = x509.CertificateRevocationListBuilder().issuer_name(name).last_update(WHEN).next_update(now)
    listed = builder.add_extension(payload, critical=False).sign(key, SHA256()).public_bytes(Encoding.DER)
    kept = RevocationData((), [crl.CertificateList.load(listed)], ())
    refused(bench.check(appended(bench.unsigned, bench.technician, WHEN, kept)), "/DSS) without a timestamp")
    refused(bench.check(appended(bench.signed, bench.qa, LATER, kept)), "/DSS) without a timestamp")


def test_quality_assurance_alone_and_first_is_refused(bench: Bench) -> None:
    alone = appended(bench.unsigned, bench.qa, WHEN)
    refused(bench.check(alone), "signed by qa")
    refused(bench.check(approval(alone, bench.technician, TECHNICIAN)), "signed by qa, technician")


def test_the_ca_itself_must_not_sign(bench: Bench) -> None:
    root_key = authority.new_key()
    root = authority.root(root_key, WHEN)
    refused(verify(sign(bench.unsigned, Credential(TECHNICIAN, root_key, root, root), WHEN), [root], now=NOW))


@pytest.mark.parametrize("days", [-2, 365 * 5 + 1])
def test_outside_the_life_of_the_certificate_is_refused(bench: Bench, days: int) -> None:
    when = WHEN + timedelta(days=days)
    with pytest.raises(SigningRefused, match="is not valid at"):
        sign(bench.unsigned, bench.technician, when)
    signed = appended(bench.unsigned, bench.technician, when)
    refused(verify(signed, bench.trust, now=when), "was not valid at")


def test_a_signature_from_the_future_is_refused(bench: Bench) -> None:
    refused(verify(bench.signed, bench.trust, now=WHEN - timedelta(days=3)), "in the future")


def test_no_trust_is_no_proof(bench: Bench) -> None:
    refused(verify(bench.signed, [], now=NOW), "no CA is trusted")


def test_unsigned_and_encrypted_files_are_refused(bench: Bench) -> None:
    refused(bench.check(bench.unsigned), "not signed")
    writer = PdfWriter(clone_from=PdfReader(io.BytesIO(bench.signed)))
    writer.encrypt("secret", algorithm="AES-256")
    out = io.BytesIO()
    writer.write(out)
    refused(bench.check(out.getvalue()), "encrypted")
