"""A key on a token signs certificates that verify like any other; tried on a software token."""

import importlib.util
import os
import shutil
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import load_der_public_key

from accept.certificate import SigningRefused
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import key_changes, keys
from accept.certificate.trust.keys import TECHNICIAN, Credential, KeysError
from tests.accept.certificate.certificate_help import WHEN, certificate_contents
from tests.accept.certificate.verify.verify_help import verify

LIBRARIES = ("/usr/lib/softhsm/libsofthsm2.so", "/usr/lib64/pkcs11/libsofthsm2.so")
LIBRARY = next((path for path in LIBRARIES if os.path.exists(path)), None)
MISSING = [
    name
    for name, found in {
        "softhsm2": LIBRARY is not None and shutil.which("softhsm2-util"),
        "pkcs11-tool (opensc)": shutil.which("pkcs11-tool"),
        "python-pkcs11": importlib.util.find_spec("pkcs11"),
    }.items()
    if not found
]


@pytest.fixture
def bench(bench_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    keys.init(bench_home, "correct horse", "T", authority_passphrase="battery staple", when=WHEN)
    return bench_home


def test_a_certificate_for_a_key_elsewhere(bench: Path) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    leaf = key_changes.issue(keys.folder(bench), TECHNICIAN, "M. Keller", key.public_key(), "battery staple", WHEN)
    assert leaf.issuer == keys.ca(bench).subject
    with pytest.raises(KeysError, match="does not open"):
        key_changes.issue(keys.folder(bench), TECHNICIAN, "M. Keller", key.public_key(), "wrong", WHEN)
    with pytest.raises(KeysError, match="P-256"):
        key_changes.issue(
            keys.folder(bench),
            TECHNICIAN,
            "M. Keller",
            ec.generate_private_key(ec.SECP384R1()).public_key(),
            "battery staple",
            WHEN,
        )


def test_without_a_key_and_without_a_token_nothing_is_signed(bench: Path, tmp_path: Path) -> None:
    known = keys.unlock(bench, TECHNICIAN, "correct horse")
    with pytest.raises(SigningRefused, match="no key found to sign as"):
        sign(render(certificate_contents(tmp_path)), Credential(TECHNICIAN, None, known.certificate, known.ca), WHEN)


@pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
def test_a_token_signs(bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from accept.certificate.signature.token import Token, token_signer

    assert LIBRARY is not None
    (tmp_path / "tokens").mkdir()
    (tmp_path / "conf").write_text(f"directories.tokendir={tmp_path}/tokens\nobjectstore.backend=file\n")
    monkeypatch.setenv("SOFTHSM2_CONF", str(tmp_path / "conf"))
    make = ["softhsm2-util", "--init-token", "--free", "--label", "bench", "--pin", "1234", "--so-pin", "5678"]
    subprocess.run(make, check=True, capture_output=True)
    tool = ["pkcs11-tool", "--module", LIBRARY, "--token-label", "bench", "--login", "--pin", "1234", "--label", "tech"]
    subprocess.run([*tool, "--keypairgen", "--key-type", "EC:prime256v1"], check=True, capture_output=True)
    out = tmp_path / "public.der"
    subprocess.run([*tool, "--read-object", "--type", "pubkey", "-o", str(out)], check=True, capture_output=True)
    public = load_der_public_key(out.read_bytes())
    assert isinstance(public, ec.EllipticCurvePublicKey)
    now = datetime.now(UTC)
    leaf = key_changes.issue(keys.folder(bench), TECHNICIAN, "M. Keller", public, "battery staple", now)
    credential = Credential(TECHNICIAN, None, leaf, keys.ca(bench))
    unsigned = render(certificate_contents(tmp_path / "unit"))
    with token_signer(Token(LIBRARY, "bench", "tech"), "1234", credential) as signer:
        for _ in range(6):  # the token takes a random nonce: half of its values of s are the upper ones
            report = verify(sign(unsigned, credential, now, signer=signer), [keys.ca(bench)])
            assert report.valid, report.reason
