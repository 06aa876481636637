"""Keys at rest and signatures: all keys or none, no secret in the open, QA after the technician, only appending."""

import io
import os
import shutil
import stat
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from asn1crypto import keys as asn1_keys
from asn1crypto import pem
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature
from pyhanko.pdf_utils.reader import PdfFileReader

from accept.certificate import SigningRefused
from accept.certificate.page.document import render
from accept.certificate.signature.signing import P256_ORDER, sign
from accept.certificate.trust import authority, encrypted_key, keys
from accept.certificate.trust.keys import QA, TECHNICIAN, Credential, KeysError
from tests.accept.certificate.certificate_help import WHEN, certificate_contents


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bench")
    keys.init(path, "correct horse", "M. Keller", "Dr. A. Åström", qa_passphrase="battery staple", when=WHEN)
    return path


@pytest.fixture(scope="module")
def technician(home: Path) -> Credential:
    return keys.unlock(home, TECHNICIAN, "correct horse")


@pytest.fixture(scope="module")
def qa(home: Path) -> Credential:
    return keys.unlock(home, QA, "battery staple")


@pytest.fixture(scope="module")
def unsigned(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return render(certificate_contents(tmp_path_factory.mktemp("unit")))


def test_keys_are_listed_without_a_passphrase(home: Path) -> None:
    listed = {info.role: info for info in keys.listing(home)}
    assert [*listed] == ["ca", TECHNICIAN, QA, "bench"]
    assert listed[QA].person == "Dr. A. Åström"
    assert listed[TECHNICIAN].valid_from <= WHEN < listed[TECHNICIAN].valid_to < listed["ca"].valid_to
    assert keys.exist(home)


def test_private_keys_are_encrypted_and_only_for_the_owner(
    tmp_path: Path, rounds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(encrypted_key, "ITERATIONS", rounds)
    home = tmp_path
    keys.init(home, "correct horse", "Ann Müller", "Dr. A. Åström", "battery staple")
    for name in ("ca", TECHNICIAN, QA):
        box = keys.folder(home) / f"{name}.key.pem"
        assert stat.S_IMODE(box.stat().st_mode) == 0o600
        parsed = asn1_keys.EncryptedPrivateKeyInfo.load(pem.unarmor(box.read_bytes())[2])
        derivation = parsed["encryption_algorithm"]["parameters"]["key_derivation_func"]["parameters"]
        assert derivation["iteration_count"].native >= 600_000
    assert stat.S_IMODE(keys.folder(home).stat().st_mode) == 0o700


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed: no second reader of PKCS#8")
def test_openssl_reads_the_keys_and_the_chain(home: Path) -> None:
    box = keys.folder(home) / "qa.key.pem"
    opened = subprocess.run(
        ["openssl", "pkey", "-in", str(box), "-passin", "pass:battery staple", "-noout", "-text"], capture_output=True
    )
    assert opened.returncode == 0
    assert b"prime256v1" in opened.stdout or b"P-256" in opened.stdout
    at = str(int(WHEN.timestamp()))
    chain = [str(keys.folder(home) / name) for name in ("ca.pem", "technician.pem")]
    checked = subprocess.run(["openssl", "verify", "-attime", at, "-CAfile", *chain], capture_output=True)
    assert checked.returncode == 0, checked.stderr


@pytest.mark.parametrize(("role", "passphrase"), [(QA, "correct horse"), (TECHNICIAN, ""), (TECHNICIAN, "x" * 999)])
def test_a_wrong_passphrase_is_refused(home: Path, role: str, passphrase: str) -> None:
    with pytest.raises(KeysError, match=r"key\.pem: does not open: wrong passphrase"):
        keys.unlock(home, role, passphrase)


def test_damaged_absent_and_mixed_up_keys_are_refused(home: Path, tmp_path: Path) -> None:
    with pytest.raises(KeysError, match="`accept keys init` makes keys"):
        keys.unlock(tmp_path, TECHNICIAN, "correct horse")
    with pytest.raises(KeysError, match="no role 'boss'"):
        keys.unlock(home, "boss", "x")
    copy = tmp_path / "copy"
    shutil.copytree(home, copy)
    box = keys.folder(copy) / "qa.key.pem"
    box.write_bytes(box.read_bytes()[:100])
    with pytest.raises(KeysError, match="does not open"):
        keys.unlock(copy, QA, "battery staple")
    shutil.copy(keys.folder(copy) / "technician.key.pem", box)
    with pytest.raises(KeysError, match=r"is not the key of qa\.pem"):
        keys.unlock(copy, QA, "correct horse")
    (keys.folder(copy) / "ca.pem").write_bytes(b"-----BEGIN CERTIFICATE-----\nnonsense")
    with pytest.raises(KeysError, match="is not a certificate"):
        keys.ca(copy)


def test_existing_keys_are_never_replaced(home: Path) -> None:
    before = {p.name: p.read_bytes() for p in keys.folder(home).iterdir()}
    with pytest.raises(KeysError, match="there are keys already"):
        keys.init(home, "correct horse", "A", "B", "battery staple")
    assert {p.name: p.read_bytes() for p in keys.folder(home).iterdir()} == before


def test_all_keys_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk is full at any one of the files: nothing is left, and a second try works."""
    real = os.fsync
    for good in range(6):
        left = iter([True] * good)

        def full(handle: int, left: Iterator[bool] = left) -> None:
            if not next(left, False):
                raise OSError(28, "No space left on device")
            real(handle)

        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(KeysError, match="cannot be written"):
            keys.init(tmp_path, "correct horse", "A", "B", "battery staple")
        assert not (tmp_path / "keys").exists()
        assert [p.name for p in tmp_path.iterdir()] in ([], ["bench.key"])  # its own key, of no person
    monkeypatch.setattr(os, "fsync", real)
    keys.init(tmp_path, "correct horse", "A", "B", "battery staple")
    assert keys.exist(tmp_path)


@pytest.mark.parametrize("empty", ["passphrase", "technician_name", "qa_name"])
def test_an_empty_name_or_passphrase_makes_no_key(tmp_path: Path, empty: str) -> None:
    good = {"passphrase": "correct horse", "technician_name": "A", "qa_name": "B", "qa_passphrase": "battery staple"}
    given = good | {empty: "  "}
    with pytest.raises(KeysError, match="no key was made"):
        keys.init(tmp_path, **given)
    assert not keys.exist(tmp_path)


def test_where_the_passphrase_comes_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "phrase"
    file.write_text("from a file\n")
    monkeypatch.setenv(keys.PASSPHRASE_FILE, str(file))
    monkeypatch.setenv(keys.PASSPHRASE, "from the environment")
    assert keys.passphrase("given", lambda: "asked") == "given"
    assert keys.passphrase(None, lambda: "asked") == "from the environment"
    monkeypatch.delenv(keys.PASSPHRASE)
    assert keys.passphrase(None, lambda: "asked") == "from a file"
    monkeypatch.delenv(keys.PASSPHRASE_FILE)
    assert keys.passphrase(None, lambda: "asked") == "asked"
    with pytest.raises(KeysError, match="no passphrase: set ACCEPT_PASSPHRASE"):
        keys.passphrase()
    monkeypatch.setenv(keys.PASSPHRASE_FILE, str(tmp_path / "none"))
    with pytest.raises(KeysError, match="cannot be read"):
        keys.passphrase()


def test_signatures_only_append(unsigned: bytes, technician: Credential, qa: Credential) -> None:
    first = sign(unsigned, technician, WHEN)
    second = sign(first, qa, WHEN + timedelta(hours=1))
    assert first.startswith(unsigned)
    assert second.startswith(first)
    reader = PdfFileReader(io.BytesIO(second))
    assert [s.field_name for s in reader.embedded_signatures] == [TECHNICIAN, QA]
    assert [s.sig_object["/SubFilter"] for s in reader.embedded_signatures] == ["/ETSI.CAdES.detached"] * 2
    assert reader.embedded_signatures[1].self_reported_timestamp == WHEN + timedelta(hours=1)


def test_the_page_shows_who_signed(unsigned: bytes, technician: Credential) -> None:
    signed = PdfFileReader(io.BytesIO(sign(unsigned, technician, WHEN)))
    widgets = [w.get_object() for w in signed.root["/Pages"]["/Kids"][0]["/Annots"]]
    widget = next(w for w in widgets if w["/T"] == TECHNICIAN)
    appearance = widget["/AP"]["/N"]
    left, bottom, right, top = (float(v) for v in widget["/Rect"])
    box = [float(v) for v in appearance["/BBox"]]
    x, y = sorted(box[::2]), sorted(box[1::2])
    assert (x, y) == ([0, pytest.approx(right - left, abs=0.01)], [0, pytest.approx(top - bottom, abs=0.01)])
    assert widget["/V"]["/Name"] == "M. Keller"


def test_the_signature_is_the_low_one_and_repeatable(unsigned: bytes, technician: Credential) -> None:
    """[RFC6979]: the same key and text give the same r, s; s is in the lower half of the order."""
    for seconds in range(8):
        embedded = PdfFileReader(io.BytesIO(sign(unsigned, technician, WHEN + timedelta(seconds=seconds))))
        _, s = decode_dss_signature(embedded.embedded_signatures[0].signer_info["signature"].native)
        assert 0 < s <= P256_ORDER // 2


@pytest.mark.parametrize("case", ["qa first", "technician twice", "qa twice", "naive time", "not a pdf", "no fields"])
def test_out_of_order_is_refused(unsigned: bytes, technician: Credential, qa: Credential, case: str) -> None:
    first = sign(unsigned, technician, WHEN)
    tried = {
        "qa first": (unsigned, qa, WHEN),
        "technician twice": (first, technician, WHEN),
        "qa twice": (sign(first, qa, WHEN), qa, WHEN),
        "naive time": (unsigned, technician, WHEN.replace(tzinfo=None)),
        "not a pdf": (b"hello", technician, WHEN),
        "no fields": (b"", technician, WHEN),
    }
    with pytest.raises(SigningRefused):
        sign(*tried[case])


def test_a_name_in_any_script_can_sign(unsigned: bytes, home: Path) -> None:
    """The appearance is drawn with an embedded typeface, the certificate holds UTF-8."""
    root_key = authority.new_key()
    root = authority.root(root_key, WHEN)
    for person in ("Žofie Łukasz-Ångström", "Дмитрий Менделеев", "(\\) <&>", "x" * 64):
        key = authority.new_key()
        leaf = authority.leaf(TECHNICIAN, person, key.public_key(), root, root_key, WHEN)
        signed = sign(unsigned, Credential(TECHNICIAN, key, leaf, root), WHEN)
        assert PdfFileReader(io.BytesIO(signed)).embedded_signatures[0].sig_object["/Name"] == person


@pytest.mark.skipif(shutil.which("pdfsig") is None, reason="pdfsig (poppler-utils) is not installed: no second opinion")
def test_pdfsig_agrees(unsigned: bytes, technician: Credential, qa: Credential, tmp_path: Path) -> None:
    """A second opinion only: pdfsig exits 0 on tampered files, so its words are read."""
    file = tmp_path / "c.pdf"
    file.write_bytes(sign(sign(unsigned, technician, datetime.now(UTC)), qa, datetime.now(UTC)))
    said = subprocess.run(["pdfsig", str(file)], capture_output=True, text=True, env=os.environ | {"LANG": "C.UTF-8"})
    assert said.stdout.count("Signature is Valid.") == 2
    assert "Total document signed" in said.stdout
