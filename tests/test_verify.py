"""Verification: what is valid is said to be; every attack is found, with one line for the reason and no traceback."""

import asyncio
import hashlib
import io
import json
import os
import subprocess
import sys
from binascii import hexlify, unhexlify
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asn1crypto import cms, core
from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature, encode_dss_signature
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.fields import SigFieldSpec, SigSeedSubFilter, append_signature_field
from pyhanko.sign.signers import PdfSignatureMetadata, PdfSigner
from pyhanko.sign.validation import validate_pdf_signature
from pyhanko_certvalidator import ValidationContext
from pypdf import PdfReader, PdfWriter

from accept import version
from accept.certificate import Attachments, Report, authority, contents, keybox, keys, render, sign, verify
from accept.certificate import dossier as dossiers
from accept.certificate.assemble import assemble
from accept.certificate.compare import differences
from accept.certificate.keys import QA, TECHNICIAN, Credential
from accept.certificate.page import field_rectangles
from accept.certificate.refused import Refused
from accept.certificate.signing import P256_ORDER, _append, _signer
from tests.certificate_help import UNIT_TOML, WHEN, dossier, result

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
NOW = WHEN + timedelta(days=400)
LATER = WHEN + timedelta(hours=2)


@dataclass(frozen=True)
class Bench:
    """A bench with its keys and one certificate in its three states."""

    technician: Credential
    qa: Credential
    unsigned: bytes
    signed: bytes
    countersigned: bytes

    @property
    def trust(self) -> list[x509.Certificate]:
        return [self.technician.ca]

    def check(self, pdf: bytes, **more: Any) -> Report:
        return verify(pdf, self.trust, now=NOW, **more)


def credentials(technician: str = "M. Keller", qa: str = "Dr. A. Åström") -> tuple[Credential, Credential]:
    root_key = authority.new_key()
    root = authority.root(root_key, WHEN)
    made = []
    for role, person in ((TECHNICIAN, technician), (QA, qa)):
        key = authority.new_key()
        made.append(Credential(role, key, authority.leaf(role, person, key.public_key(), root, root_key, WHEN), root))
    return made[0], made[1]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    technician, qa = credentials()
    unsigned = render(dossier(tmp_path_factory.mktemp("unit")))
    signed = sign(unsigned, technician, WHEN)
    return Bench(technician, qa, unsigned, signed, sign(signed, qa, LATER))


def refused(report: Report, *words: str) -> None:
    """Not valid, for a reason in one printable line that says at least one of these words."""
    assert not report.valid
    assert report.reason.isprintable()
    assert 0 < len(report.reason) <= 300
    assert not words or any(word in report.reason for word in words), report.reason


def hole_of(pdf: bytes, nth: int) -> tuple[int, int]:
    """(start, end) of the hexadecimal digits of the nth signature."""
    _, length, start, _ = PdfFileReader(io.BytesIO(pdf)).embedded_signatures[nth].byte_range
    return int(length) + 1, int(start) - 1


def with_cms(pdf: bytes, change: Callable[[cms.ContentInfo], None]) -> bytes:
    """The file with the CMS of its last signature taken apart, changed and put back, as anyone can."""
    start, end = hole_of(pdf, -1)
    content = cms.ContentInfo.load(unhexlify(pdf[start:end]))
    change(content)
    digits = hexlify(content.dump(force=True)).upper()
    return pdf[:start] + digits.ljust(end - start, b"0") + pdf[end:]


# --- what holds ------------------------------------------------------------------------------------------------------


def test_signed_by_the_technician_alone_is_valid_and_open(bench: Bench) -> None:
    report = bench.check(bench.signed)
    assert report.valid, report.reason
    assert not report.countersigned
    assert "countersignature open" in report.reason
    assert (report.serial, report.verdict) == ("APA-03", "rejected")
    assert [(s.role, s.person, s.when) for s in report.signatures] == [(TECHNICIAN, "M. Keller", WHEN)]
    assert any("identical to the byte" in line for line in report.details)


def test_countersigned_is_valid(bench: Bench) -> None:
    report = bench.check(bench.countersigned, rejudge=lambda a: result().to_json())
    assert report.valid, report.reason
    assert report.countersigned
    assert [(s.role, s.when) for s in report.signatures] == [(TECHNICIAN, WHEN), (QA, LATER)]
    assert any("the same result" in line for line in report.details)


def test_without_its_countersignature_it_is_the_certificate_before(bench: Bench) -> None:
    """Nobody can take a signature off unseen: the state it leaves says that the countersignature is open."""
    report = bench.check(bench.countersigned[: len(bench.signed)])
    assert report.valid
    assert not report.countersigned


def test_it_still_holds_when_the_certificates_have_run_out(bench: Bench) -> None:
    assert verify(bench.countersigned, bench.trust, now=WHEN + timedelta(days=365 * 15)).valid


# --- changed bytes ---------------------------------------------------------------------------------------------------


def flips(pdf: bytes, count: int, seed: int) -> list[tuple[int, int]]:
    """(byte, bit) to flip: spread over the file, and as many again in each hole."""
    rng = np.random.default_rng(seed)
    places = [int(p) for p in np.linspace(0, len(pdf) - 1, count)]
    for nth in range(len(PdfFileReader(io.BytesIO(pdf)).embedded_signatures)):
        start, end = hole_of(pdf, nth)
        places += [int(p) for p in rng.integers(start - 1, end + 1, count // 3)]
        places += [int(p) for p in rng.integers(start, start + 3600, count // 3)]  # the CMS itself, not its padding
    return [(place, int(rng.integers(8))) for place in places]


@pytest.mark.parametrize("state", ["signed", "countersigned"])
def test_every_flipped_bit_is_found(bench: Bench, state: str) -> None:
    pdf = getattr(bench, state)
    for place, bit in flips(pdf, 600 if SOAK else 60, seed=20):
        changed = bytearray(pdf)
        changed[place] ^= 1 << bit
        report = bench.check(bytes(changed))
        refused(report)


@pytest.mark.skipif(not SOAK, reason="every bit of a hole takes minutes: set ACCEPT_SOAK=1")
def test_every_bit_of_the_hole(bench: Bench) -> None:
    start, end = hole_of(bench.signed, 0)
    used = len(bench.signed[start:end].rstrip(b"0")) + 2
    for place in [*range(start - 1, start + used), *range(start + used, end + 1, 97)]:
        for bit in range(8):
            changed = bytearray(bench.signed)
            changed[place] ^= 1 << bit
            refused(bench.check(bytes(changed)))


@pytest.mark.parametrize("tail", [b"\n", b" ", b"\0", b"%%EOF\n", b"garbage", b"\n1 0 obj\n<<>>\nendobj\n%%EOF"])
def test_anything_after_the_end_is_found(bench: Bench, tail: bytes) -> None:
    for pdf in (bench.signed, bench.countersigned):
        refused(bench.check(pdf + tail))


@pytest.mark.parametrize("keep", [0, 1, 8, 1000, 0.3, 0.7, 0.97, 0.999, -1, -2, -7])
def test_a_truncated_file_is_found(bench: Bench, keep: float) -> None:
    for pdf in (bench.signed, bench.countersigned):
        cut = pdf[: int(keep * len(pdf)) if 0 < keep < 1 else int(keep)]
        refused(bench.check(cut))


@pytest.mark.parametrize("content", [b"", b"hello", b"%PDF-1.7", b"%PDF-1.7\n%%EOF\n", b"\0" * 5000, b"%PDF-" * 999])
def test_what_is_no_pdf_is_refused(bench: Bench, content: bytes) -> None:
    refused(bench.check(content))


def test_the_reason_is_all_that_is_said(bench: Bench, tmp_path: Path) -> None:
    """pyhanko logs what it finds in a broken file; in a process without a logging setup that must not reach stderr."""
    start, _ = hole_of(bench.countersigned, 1)
    broken = bytearray(bench.countersigned)
    broken[start - 300] ^= 1
    (tmp_path / "broken.pdf").write_bytes(bytes(broken))
    program = (
        "import sys; from pathlib import Path; from accept.certificate import verify\n"
        "from cryptography import x509\n"
        "ca = x509.load_pem_x509_certificate(Path(sys.argv[2]).read_bytes())\n"
        "print(verify(Path(sys.argv[1]).read_bytes(), [ca]).reason)"
    )
    (tmp_path / "ca.pem").write_bytes(bench.technician.ca.public_bytes(keys.Encoding.PEM))
    command = [sys.executable, "-c", program, str(tmp_path / "broken.pdf"), str(tmp_path / "ca.pem")]
    there = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=True)
    assert there.stderr == ""
    assert len(there.stdout.splitlines()) == 1


def test_random_bytes_with_a_header_never_raise(bench: Bench) -> None:
    rng = np.random.default_rng(3)
    for _ in range(500 if SOAK else 40):
        pieces = [bench.signed[a : a + n] for a, n in rng.integers(0, 20_000, (5, 2))]
        refused(bench.check(b"%PDF-1.7\n" + b"".join(pieces)))


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


def change_title(writer: IncrementalPdfFileWriter) -> None:
    writer.set_info(generic.DictionaryObject({generic.pdf_name("/Title"): generic.pdf_string("better")}))


def change_nothing(writer: IncrementalPdfFileWriter) -> None:
    writer.update_root()


def swap_attachment(writer: IncrementalPdfFileWriter) -> None:
    names = writer.root["/Names"]["/EmbeddedFiles"]["/Names"]
    file = names[2 * [str(names[n]) for n in range(0, len(names), 2)].index("results.json") + 1]
    stream = file["/EF"].raw_get("/F")
    content = dossiers.canonical(result(4.99, 365.5).to_json())
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


def test_a_foreign_bench_with_the_same_names_is_refused(bench: Bench) -> None:
    technician, qa = credentials()
    forged = sign(sign(bench.unsigned, technician, WHEN), qa, LATER)
    refused(bench.check(forged), "not made under a trusted CA")
    assert verify(forged, [technician.ca], now=NOW).valid  # it is only the trust that lacks
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


def test_quality_assurance_alone_and_first_is_refused(bench: Bench) -> None:
    alone = asyncio.run(_append(bench.unsigned, bench.qa, WHEN, _signer(bench.qa)))
    refused(bench.check(alone), "signed by qa")
    refused(bench.check(approval(alone, bench.technician, TECHNICIAN)), "signed by qa, technician")


def test_the_ca_itself_must_not_sign(bench: Bench) -> None:
    root_key = authority.new_key()
    root = authority.root(root_key, WHEN)
    refused(verify(sign(bench.unsigned, Credential(TECHNICIAN, root_key, root, root), WHEN), [root], now=NOW))


@pytest.mark.parametrize("days", [-2, 365 * 5 + 1])
def test_outside_the_life_of_the_certificate_is_refused(bench: Bench, days: int) -> None:
    when = WHEN + timedelta(days=days)
    report = verify(sign(bench.unsigned, bench.technician, when), bench.trust, now=when)
    refused(report, "was not valid at")


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


# --- the hole --------------------------------------------------------------------------------------------------------


def other_s(content: cms.ContentInfo) -> None:
    """(r, n - s) is a valid signature too: the file would have two valid forms."""
    info = content["content"]["signer_infos"][0]
    r, s = decode_dss_signature(info["signature"].native)
    info["signature"] = encode_dss_signature(r, P256_ORDER - s)


def unsigned_attribute(content: cms.ContentInfo) -> None:
    attribute = cms.CMSAttribute({"type": "1.2.3.4", "values": [core.UTF8String("smuggled")]})
    content["content"]["signer_infos"][0]["unsigned_attrs"] = cms.CMSAttributes([attribute])


def extra_certificate(content: cms.ContentInfo) -> None:
    first = content["content"]["certificates"][0]
    other = credentials()[0].certificate.public_bytes(keys.Encoding.DER)
    content["content"]["certificates"].append(cms.CertificateChoices("certificate", first.chosen.load(other)))


def extra_digest(content: cms.ContentInfo) -> None:
    content["content"]["digest_algorithms"].append(cms.DigestAlgorithm({"algorithm": "sha1"}))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (other_s, "not encoded canonically"),
        (unsigned_attribute, "carries more"),
        (extra_certificate, "3 certificates"),
        (extra_digest, "carries more"),
    ],
)
def test_what_the_signature_leaves_free_is_pinned(
    bench: Bench, change: Callable[[cms.ContentInfo], None], words: str
) -> None:
    changed = with_cms(bench.signed, change)
    refused(bench.check(changed), words)
    # Without our pins it would pass: pyhanko alone finds nothing wrong with these.
    root = asn1_x509.Certificate.load(bench.technician.ca.public_bytes(keys.Encoding.DER))
    embedded = PdfFileReader(io.BytesIO(changed)).embedded_signatures[0]
    assert validate_pdf_signature(embedded, ValidationContext(trust_roots=[root], moment=WHEN)).bottom_line


def test_other_spellings_of_the_hole_are_found(bench: Bench) -> None:
    start, end = hole_of(bench.signed, 0)
    head, digits, tail = bench.signed[:start], bench.signed[start:end], bench.signed[end:]
    refused(bench.check(head + digits.lower() + tail), "upper-case")
    refused(bench.check(head + digits[:-2] + b"01" + tail), "padding")
    refused(bench.check(head + digits[:-1] + b" " + tail), "upper-case", "hexadecimal")
    refused(bench.check(head + digits[:-40] + b">" + b" " * 38 + b"<" + tail))


def test_other_encodings_of_the_same_cms_are_found(bench: Bench) -> None:
    """Found by flipping every bit of the hole: a length that swallows padding, a name in other letters."""
    start, end = hole_of(bench.signed, 0)
    der = unhexlify(bench.signed[start:end])
    grown = der[:2] + (int.from_bytes(der[2:4], "big") + 2).to_bytes(2, "big") + der[4:]
    assert der.count(b"bench CA") > 3
    last = der.rindex(b"accept bench", 0, der.rindex(b"bench CA"))
    shouted = der[:last] + b"ACCEPT" + der[last + 6 :]
    for changed in (grown, shouted):
        digits = hexlify(changed).upper()
        refused(bench.check(bench.signed[:start] + digits + bench.signed[end:]), "not encoded canonically")


# --- page, data and result -------------------------------------------------------------------------------------------


def good_dossier(tmp_path: Path) -> dossiers.Dossier:
    return dossier(tmp_path, result(4.99, 365.5))


def page_over(page: dossiers.Dossier, data: dossiers.Dossier) -> bytes:
    """The page of one dossier over the attachments of another."""
    stripped = PdfWriter(clone_from=PdfReader(io.BytesIO(render(page))))
    for key in ("/Names", "/AF", "/AcroForm"):
        del stripped._root_object[key]
    out = io.BytesIO()
    stripped.write(out)
    return assemble(out.getvalue(), [], data.attachments(), field_rectangles(), "x")


@pytest.mark.parametrize(("sensor", "stroke"), [(4.99, 365.5), (1.73, 181.7)])
def test_a_page_that_says_other_than_its_data_is_found(
    bench: Bench, tmp_path: Path, sensor: float, stroke: float
) -> None:
    """Signed with the right keys: another verdict, or one digit of a number."""
    mixed = page_over(dossier(tmp_path, result(sensor, stroke)), dossier(tmp_path))
    refused(bench.check(sign(mixed, bench.technician, WHEN)), "page does not show what the attached data say")


def resigned(bench: Bench, attachments: Mapping[str, bytes]) -> Report:
    """Report on a certificate with these attachments, signed with the right key."""
    plain = render(dossiers.read(attachments))
    return bench.check(sign(plain, bench.technician, WHEN))


def test_inputs_that_are_not_those_judged_are_found(bench: Bench, tmp_path: Path) -> None:
    made = dossier(tmp_path)
    refused(resigned(bench, made.attachments() | {"unit.toml": b"other"}), "unit.toml is not the file that was judged")
    refused(resigned(bench, made.attachments() | {"more.csv": b"1"}), "more.csv is not the file that was judged")
    wrong = replace(made, inputs=dict(made.inputs) | {"x.mat": "0" * 64})
    refused(resigned(bench, wrong.attachments()), "name different inputs")


def test_a_page_of_another_version_is_told(bench: Bench, tmp_path: Path) -> None:
    """Another version may draw another page: the bytes are not compared, serial and verdict are."""
    old, good = (replace(d, code_sha256="0" * 64) for d in (dossier(tmp_path), good_dossier(tmp_path)))
    report = bench.check(sign(page_over(old, old), bench.technician, WHEN))
    assert report.valid, report.reason
    assert any("drawn by another version" in line for line in report.details)
    refused(bench.check(sign(page_over(old, good), bench.technician, WHEN)), "does not show 'ACCEPTED'")


def test_a_result_that_comes_out_differently_is_reported(bench: Bench) -> None:
    refused(bench.check(bench.signed, rejudge=lambda a: result(1.73).to_json()), "findings[sensor_uF].value is 1.72")
    refused(bench.check(bench.signed, rejudge=lambda a: result(4.99, 365.5).to_json()), "judged again")


def test_the_judge_receives_what_was_judged(bench: Bench, tmp_path: Path) -> None:
    seen: list[Attachments] = []

    def judge(attached: Attachments) -> Mapping[str, Any]:
        seen.append(attached)
        unit = attached.unpack(tmp_path / "again")
        assert (unit / "unit.toml").read_bytes() == UNIT_TOML
        assert (
            hashlib.sha256((unit / "raw/stroke.mat").read_bytes()).hexdigest()
            == attached.result["inputs"]["raw/stroke.mat"]
        )
        return result().to_json()

    assert bench.check(bench.signed, rejudge=judge).valid
    assert 'name = "basic"' in seen[0].spec_text


def test_a_judge_that_fails_makes_it_invalid(bench: Bench) -> None:
    def judge(attached: Attachments) -> Mapping[str, Any]:
        raise OSError("disk\nfull")

    refused(bench.check(bench.signed, rejudge=judge), "judging again cannot be read: OSError: disk full")


def test_too_large_records_are_told_not_judged(bench: Bench, tmp_path: Path) -> None:
    small = sign(render(dossier(tmp_path, size_limit=100)), bench.technician, WHEN)
    report = bench.check(small, rejudge=lambda a: pytest.fail("must not be called"))
    assert report.valid
    assert any("raw/stroke.mat too large to be attached" in line for line in report.details)


@pytest.mark.parametrize("name", ["../evil", "/etc/passwd", "a/../../b", "c:\\x", "..\\x", ""])
def test_no_attachment_is_unpacked_outside_its_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(Refused, match="leads out of its folder"):
        Attachments({}, "", {name: b"x"}).unpack(tmp_path / "inner")
    assert list(tmp_path.rglob("*")) == []


def test_differences_by_rounding_are_none() -> None:
    """1e-6 between processors is rounding, one digit of a number is not; verdicts and words are exact."""
    unit = result().to_json()
    again = json.loads(json.dumps(unit))
    again["findings"][0]["value"] *= 1 + 1e-9
    again["findings"][0]["reason"] = again["findings"][0]["reason"].replace("1.72 ", "1.72000 ")
    assert differences(unit, again) == []
    for path, value in (("value", 1.7201), ("verdict", "pass"), ("U", None), ("required", 1), ("reason", "other")):
        changed = json.loads(json.dumps(unit))
        changed["findings"][0][path] = value
        assert len(differences(unit, changed)) == 1, path
    assert differences({"a": [1, 2]}, {"a": [1]}) == ["a has 2 entries attached, 1 judged again"]
    assert differences({"a": 1}, {"b": 1}) == ["a is only attached", "b is only judged again"]
    assert differences({"n": "x 12 y"}, {"n": "x 13 y"}) != []


def test_the_code_hash_is_in_the_certificate(bench: Bench) -> None:
    assert contents.read(bench.signed).code_sha256 == version.code_sha256()


def test_keys_made_by_init_verify_by_the_bench_ca(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keybox, "ITERATIONS", 10)
    keys.init(tmp_path, "x", "A. Technician", "B. Assurance", when=WHEN)
    pdf = sign(bench.unsigned, keys.unlock(tmp_path, TECHNICIAN, "x"), WHEN)
    assert verify(sign(pdf, keys.unlock(tmp_path, QA, "x"), LATER), [keys.ca(tmp_path)], now=NOW).valid
