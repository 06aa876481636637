"""Trusted timestamps: asked for over HTTP of a local authority, looked at by verify, refused where they are wrong."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest
from asn1crypto import keys as asn1_keys
from asn1crypto import tsp
from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
from pyhanko.sign.timestamps.dummy_client import DummyTimeStamper
from typer.testing import CliRunner

from accept.base.home import home
from accept.certificate.signature.signing import SigningRefused, sign
from accept.certificate.trust import keys
from accept.certificate.trust.revocation import Revoked
from accept.certificate.verify.verification import Validity
from accept.cli.main import app
from tests.accept.certificate.certificate_help import WHEN
from tests.accept.certificate.verify.verify_help import LATER, Bench, hole_of, made_bench, refused, with_cms
from tests.accept.units.units import make_unit


@dataclass(frozen=True)
class Authority:
    """A time stamping authority of its own root."""

    root: x509.Certificate
    leaf: x509.Certificate
    key: rsa.RSAPrivateKey

    def at(self, when: datetime | None = None) -> DummyTimeStamper:
        plain = self.key.private_bytes(
            serialization.Encoding.DER, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
        root = asn1_x509.Certificate.load(self.root.public_bytes(serialization.Encoding.DER))
        leaf = asn1_x509.Certificate.load(self.leaf.public_bytes(serialization.Encoding.DER))
        return DummyTimeStamper(leaf, asn1_keys.PrivateKeyInfo.load(plain), [root], fixed_dt=when)


def certified(
    name: str, key: rsa.RSAPrivateKey, issuer: x509.Name, by: rsa.RSAPrivateKey, ca: bool
) -> x509.Certificate:
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer if not ca else subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(datetime(2020, 1, 1, tzinfo=UTC))
        .not_valid_after(datetime(2050, 1, 1, tzinfo=UTC))
        .add_extension(x509.BasicConstraints(ca, None), critical=True)
    )
    if not ca:
        usage = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.TIME_STAMPING])
        builder = builder.add_extension(usage, critical=True)
    return builder.sign(by, hashes.SHA256())


def made_authority(name: str) -> Authority:
    root_key, key = (rsa.generate_private_key(65537, 2048) for _ in range(2))
    root = certified(f"{name} root", root_key, x509.Name([]), root_key, ca=True)
    return Authority(root, certified(name, key, root.subject, root_key, ca=False), key)


@pytest.fixture(scope="module")
def tsa() -> Authority:
    return made_authority("Local time")


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return made_bench(tmp_path_factory.mktemp("unit"))


@pytest.fixture(scope="module")
def stamped(bench: Bench, tsa: Authority) -> bytes:
    return sign(bench.unsigned, bench.technician, WHEN, stamping=tsa.at(WHEN + timedelta(minutes=1)))


@pytest.fixture
def server(tsa: Authority) -> Iterator[str]:
    """A responder on a port of this machine."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            asked = tsp.TimeStampReq.load(self.rfile.read(int(self.headers["Content-Length"])))
            answer = tsa.at().request_tsa_response(asked).dump()
            self.send_response(200)
            self.send_header("Content-Type", "application/timestamp-reply")
            self.send_header("Content-Length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_: object) -> None:
            pass

    running = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=running.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{running.server_port}/"
    running.shutdown()
    running.server_close()
    thread.join()


def test_verify_says_which_time_it_had(bench: Bench, stamped: bytes, tsa: Authority) -> None:
    both = sign(stamped, bench.qa, LATER)
    known = bench.check(both, stamping=[tsa.root])
    assert known.valid, known.reason
    lines = [line for line in known.details if line.startswith("time of")]
    assert "trusted timestamp of 2026" in lines[0] or "trusted timestamp of" in lines[0]
    assert "Local time" in lines[0]
    assert "ordered" in lines[1] or "order certificates" in lines[1]
    unknown = bench.check(stamped)
    assert unknown.valid
    assert any("not trusted here" in line for line in unknown.details)
    other = bench.check(stamped, stamping=[made_authority("Another").root])
    assert any("not trusted here" in line for line in other.details)


def test_a_wrong_timestamp_is_not_valid(bench: Bench, stamped: bytes, tsa: Authority) -> None:
    """Of another signature, of another day, taken out, doubled, or with anything in it changed."""
    trust = {"stamping": [tsa.root]}
    late = sign(bench.unsigned, bench.technician, WHEN, stamping=tsa.at(WHEN + timedelta(days=3)))
    refused(bench.check(late, **trust), "its timestamp says")
    foreign = sign(bench.unsigned, bench.technician, WHEN + timedelta(seconds=5), stamping=tsa.at(WHEN))
    tokens = []
    with_cms(foreign, lambda c: tokens.append(c["content"]["signer_infos"][0]["unsigned_attrs"].copy()))

    def put(content: object) -> None:
        content["content"]["signer_infos"][0]["unsigned_attrs"] = tokens[0]

    refused(bench.check(with_cms(stamped, put), **trust), "not of this signature", "canonically")
    start, end = hole_of(stamped, 0)
    used = len(stamped[start:end].rstrip(b"0"))
    for place in range(start + 2400, start + used, 211):  # behind the signature value: within the token
        changed = bytearray(stamped)
        changed[place] = ord("0") if changed[place] != ord("0") else ord("1")
        refused(bench.check(bytes(changed), **trust))


def test_a_trusted_timestamp_outlives_a_compromised_key(bench: Bench, stamped: bytes, tsa: Authority) -> None:
    entry = Revoked(bench.technician.certificate.serial_number, WHEN + timedelta(days=10), True)
    assert bench.check(bench.signed, revoked=[entry]).outcome is Validity.SIGNED
    assert bench.check(stamped, revoked=[entry]).outcome is Validity.SIGNED
    assert bench.check(stamped, revoked=[entry], stamping=[tsa.root]).outcome is Validity.VALID


def test_commands_ask_and_say(tmp_path: Path, server: str, tsa: Authority, monkeypatch: pytest.MonkeyPatch) -> None:
    pdf, unit, run = tmp_path / "a.pdf", make_unit(tmp_path / "u", "A-1"), CliRunner().invoke
    words = ["report", str(unit), "--spec", "apa-basic", "--out", str(pdf)]
    assert run(app, [*words, "--tsa", server]).exit_code == 0
    (keys.folder(home()) / "tsa.pem").write_bytes(tsa.root.public_bytes(serialization.Encoding.PEM))
    done = run(app, ["verify", str(pdf)])
    assert (done.exit_code, "trusted timestamp of" in done.stderr) == (0, True), done.output
    silent = run(app, [*words, "--tsa", "http://127.0.0.1:9/"])
    assert (silent.exit_code, "no timestamp from http://127.0.0.1:9/" in silent.stderr) == (6, True), silent.output


def test_without_an_answer_nothing_is_signed(bench: Bench) -> None:
    from accept.certificate.signature.timestamp import stamper

    with pytest.raises(SigningRefused, match="nothing was signed"):
        sign(bench.unsigned, bench.technician, WHEN, stamping=stamper("http://127.0.0.1:9/"))


def test_the_list_of_revoked_keys_is_kept_with_the_certificate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it was when the unit was judged, so that it is there when the authority is gone; one that was forged or left
    out of the authority's own says nothing."""
    from accept.certificate.trust import key_changes
    from accept.certificate.verify.attachments import read

    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple", authority_passphrase="the office")
    office = keys.folder(home())
    key_changes.revoke(home(), office, "Grace", "left", "the office", datetime.now(UTC))
    pdf, unit = tmp_path / "a.pdf", make_unit(tmp_path / "u", "A-1")
    run = CliRunner().invoke
    assert run(app, ["report", str(unit), "--spec", "apa-basic", "--out", str(pdf)]).exit_code == 0
    assert "BEGIN X509 CRL" in read(pdf.read_bytes()).provenance["crl"]
    assert run(app, ["verify", str(pdf)]).exit_code == 0
    other = keys.init(tmp_path / "other", "correct horse", "Eve", authority_passphrase="the office") / "ca.pem"
    assert run(app, ["verify", str(pdf), "--trust", str(other)]).exit_code == 3
