"""A time stamping authority with a root of its own, and a responder on a port of this machine that gives its timestamps
and its list of revoked certificates, or one answer about its certificate (OCSP)."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from asn1crypto import keys as asn1_keys
from asn1crypto import tsp
from asn1crypto import x509 as asn1_x509
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509 import ocsp
from cryptography.x509.oid import AuthorityInformationAccessOID, ExtendedKeyUsageOID, NameOID
from pyhanko.sign.timestamps.dummy_client import DummyTimeStamper

LISTED = timedelta(days=7)  # a list is good for so long


@dataclass(frozen=True)
class Authority:
    """revoked: from when its certificate stands on its list, none as a rule."""

    root: x509.Certificate
    root_key: rsa.RSAPrivateKey
    leaf: x509.Certificate
    key: rsa.RSAPrivateKey
    revoked: list[datetime] = field(default_factory=list)

    def at(self, when: datetime | None = None) -> DummyTimeStamper:
        plain = self.key.private_bytes(
            serialization.Encoding.DER, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
        root = asn1_x509.Certificate.load(self.root.public_bytes(serialization.Encoding.DER))
        leaf = asn1_x509.Certificate.load(self.leaf.public_bytes(serialization.Encoding.DER))
        return DummyTimeStamper(leaf, asn1_keys.PrivateKeyInfo.load(plain), [root], fixed_dt=when)

    def crl(self, of: datetime) -> bytes:
        """Its list of a day, DER."""
        builder = x509.CertificateRevocationListBuilder().issuer_name(self.root.subject)
        builder = builder.last_update(of).next_update(of + LISTED)
        for when in self.revoked:
            entry = x509.RevokedCertificateBuilder().serial_number(self.leaf.serial_number).revocation_date(when)
            builder = builder.add_revoked_certificate(entry.build())
        return builder.sign(self.root_key, hashes.SHA256()).public_bytes(serialization.Encoding.DER)

    def ocsp(self, of: datetime) -> bytes:
        """Whether its certificate is good, as its root answers on a day ([RFC6960]), DER."""
        revoked = self.revoked[0] if self.revoked else None
        status = ocsp.OCSPCertStatus.REVOKED if revoked else ocsp.OCSPCertStatus.GOOD
        builder = ocsp.OCSPResponseBuilder().add_response(
            self.leaf, self.root, hashes.SHA1(), status, of, of + LISTED, revoked, None
        )
        builder = builder.responder_id(ocsp.OCSPResponderEncoding.NAME, self.root)
        return builder.sign(self.root_key, hashes.SHA256()).public_bytes(serialization.Encoding.DER)


def _certified(
    name: str,
    key: rsa.RSAPrivateKey,
    issuer: x509.Name | None,
    by: rsa.RSAPrivateKey,
    list_at: str | None = None,
    ocsp_at: str | None = None,
) -> x509.Certificate:
    """issuer: None for a root. list_at: URL of the issuer's list. ocsp_at: of its answers."""
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer or subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(datetime(2020, 1, 1, tzinfo=UTC))
        .not_valid_after(datetime(2050, 1, 1, tzinfo=UTC))
        .add_extension(x509.BasicConstraints(issuer is None, None), critical=True)
    )
    if issuer is not None:
        usage = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.TIME_STAMPING])
        builder = builder.add_extension(usage, critical=True)
    if list_at is not None:
        point = x509.DistributionPoint([x509.UniformResourceIdentifier(list_at)], None, None, None)
        builder = builder.add_extension(x509.CRLDistributionPoints([point]), critical=False)
    if ocsp_at is not None:
        place = x509.AccessDescription(AuthorityInformationAccessOID.OCSP, x509.UniformResourceIdentifier(ocsp_at))
        builder = builder.add_extension(x509.AuthorityInformationAccess([place]), critical=False)
    return builder.sign(by, hashes.SHA256())


def made_authority(name: str, list_at: str | None = None, ocsp_at: str | None = None) -> Authority:
    root_key, key = (rsa.generate_private_key(65537, 2048) for _ in range(2))
    root = _certified(f"{name} root", root_key, None, root_key)
    return Authority(root, root_key, _certified(name, key, root.subject, root_key, list_at, ocsp_at), key)


WRONG = {  # how an answer is wrong -> what is said of it
    "of another signature": "of another signature",
    "years ahead": "here it is",
    "with another number than asked": "no timestamp",
    "no encoding at all": "no timestamp",
    "empty": "no timestamp",
    "a refusal": "no timestamp",
    "a page": "it answered 404",
    "without end": "more than",
    "a byte at a time": "no answer within",
}


@contextmanager
def responder(asked: list[Authority], wrong: str = "") -> Iterator[str]:
    """Answers for the authority in `asked`, at the URL that it gives: timestamps by POST, the list at URL + "crl",
    whether its certificate is good at URL + "ocsp". wrong: one of `WRONG`, for its timestamps."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            content = self.rfile.read(int(self.headers["Content-Length"]))
            if self.path == "/ocsp":
                self.answer("application/ocsp-response", asked[0].ocsp(datetime.now(UTC) - timedelta(minutes=1)))
                return
            request, when = tsp.TimeStampReq.load(content), None
            if wrong == "of another signature":
                request["message_imprint"]["hashed_message"] = bytes(32)
            elif wrong == "with another number than asked":
                request["nonce"] = 12345
            elif wrong == "years ahead":
                when = datetime.now(UTC) + timedelta(days=400)
            refusal = bytes.fromhex("30053003020102")  # a status and no token
            other = {"no encoding at all": b"\x30\x82\xff\xff", "empty": b"", "a refusal": refusal}
            good = asked[0].at(when).request_tsa_response(request).dump()
            pieces, pause = [other.get(wrong, good)], 0.0
            if wrong == "without end":
                pieces = [bytes(100_000)] * 100
            elif wrong == "a byte at a time":
                pieces, pause = [bytes([each]) for each in good[:10]], 0.5
            self.send_response(404 if wrong == "a page" else 200)
            self.send_header("Content-Type", "text/html" if wrong == "a page" else "application/timestamp-reply")
            self.end_headers()
            with suppress(OSError):  # nobody listens any more
                for piece in pieces:
                    self.wfile.write(piece)
                    time.sleep(pause)

        def do_GET(self) -> None:
            if wrong.startswith("list "):
                self.send_response(200)
                self.end_headers()
                with suppress(OSError):  # nobody listens any more
                    for _ in range(200):
                        self.wfile.write(bytes(100_000 if wrong == "list without end" else 1))
                        time.sleep(0.0 if wrong == "list without end" else 0.05)
                return
            self.answer("application/pkix-crl", asked[0].crl(datetime.now(UTC) - timedelta(minutes=1)))

        def answer(self, kind: str, content: bytes) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: object) -> None:
            pass

    running = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=running.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{running.server_port}/"
    running.shutdown()
    running.server_close()
    thread.join()
