"""Verification: changed bytes are found, wherever they are, with one line for the reason and no traceback."""

import io
import subprocess
import sys
from binascii import hexlify, unhexlify
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from asn1crypto import cms, core
from asn1crypto import x509 as asn1_x509
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature, encode_dss_signature
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.validation import validate_pdf_signature
from pyhanko_certvalidator import ValidationContext

from accept.certificate.signature.signing import P256_ORDER
from accept.certificate.trust import keys
from tests.accept.certificate.certificate_help import WHEN
from tests.accept.certificate.verify.verify_help import Bench, credentials, hole_of, refused, with_cms
from tests.soak import SOAK

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
@pytest.mark.slow
def test_every_flipped_bit_is_found(bench: Bench, state: str) -> None:
    pdf = getattr(bench, state)
    for place, bit in flips(pdf, 600 if SOAK else 60, seed=20):
        changed = bytearray(pdf)
        changed[place] ^= 1 << bit
        report = bench.check(bytes(changed))
        refused(report)


@pytest.mark.soak
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


@pytest.mark.slow
def test_the_reason_is_all_that_is_said(bench: Bench, tmp_path: Path) -> None:
    """pyhanko logs what it finds in a broken file; in a process without a logging setup that must not reach stderr."""
    start, _ = hole_of(bench.countersigned, 1)
    broken = bytearray(bench.countersigned)
    broken[start - 300] ^= 1
    (tmp_path / "broken.pdf").write_bytes(bytes(broken))
    program = (
        "import sys; from pathlib import Path; from accept.certificate import ports, verify_certificate\n"
        "from cryptography import x509\n"
        "ca = x509.load_pem_x509_certificate(Path(sys.argv[2]).read_bytes())\n"
        "print(verify_certificate(Path(sys.argv[1]).read_bytes(), [ca], ports()).reason)"
    )
    (tmp_path / "ca.pem").write_bytes(bench.technician.ca.public_bytes(keys.Encoding.PEM))
    command = [sys.executable, "-c", program, str(tmp_path / "broken.pdf"), str(tmp_path / "ca.pem")]
    there = subprocess.run(command, cwd=Path(__file__).parents[4], capture_output=True, text=True, check=True)
    assert there.stderr == ""
    assert len(there.stdout.splitlines()) == 1


def test_random_bytes_with_a_header_never_raise(bench: Bench) -> None:
    rng = np.random.default_rng(3)
    for _ in range(500 if SOAK else 40):
        pieces = [bench.signed[a : a + n] for a, n in rng.integers(0, 20_000, (5, 2))]
        refused(bench.check(b"%PDF-1.7\n" + b"".join(pieces)))


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
