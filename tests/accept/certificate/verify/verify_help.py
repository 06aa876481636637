"""A bench with its keys and its certificate in three states, for the tests of verification."""

import io
from binascii import hexlify, unhexlify
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from asn1crypto import cms
from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA256
from pyhanko.pdf_utils.reader import PdfFileReader

from accept.certificate import Verification, ports, verify_certificate
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import authority
from accept.certificate.trust.keys import QA, TECHNICIAN, Credential
from accept.certificate.verify.ports import Rejudge
from tests.accept.certificate.certificate_help import ROOT_KEYS, WHEN, certificate_contents, judged_again

NOW = WHEN + timedelta(days=400)
LATER = WHEN + timedelta(hours=2)


def verify(
    pdf: bytes,
    trust: Sequence[x509.Certificate],
    rejudge: Rejudge | None = None,
    now: datetime | None = None,
    **more: Any,
) -> Verification:
    """With the bench's own rooms, and this judge of the unit."""
    return verify_certificate(pdf, trust, ports(rejudge), now, **more)


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

    def check(self, pdf: bytes, **more: Any) -> Verification:
        """By who judges it again as it was judged, if no other judge is named."""
        return verify(pdf, self.trust, more.pop("rejudge", lambda _: judged_again()), **({"now": NOW} | more))


def credentials(technician: str = "M. Keller", qa: str = "Dr. A. Åström") -> tuple[Credential, Credential]:
    root_key = authority.new_key()
    root = authority.root(root_key, WHEN)
    ROOT_KEYS[root.fingerprint(SHA256())] = root_key
    made = []
    for role, person in ((TECHNICIAN, technician), (QA, qa)):
        key = authority.new_key()
        made.append(Credential(role, key, authority.leaf(role, person, key.public_key(), root, root_key, WHEN), root))
    return made[0], made[1]


def made_bench(folder: Path) -> Bench:
    """Of a unit in a folder."""
    technician, qa = credentials()
    unsigned = render(certificate_contents(folder, ca=technician.ca))
    signed = sign(unsigned, technician, WHEN)
    return Bench(technician, qa, unsigned, signed, sign(signed, qa, LATER))


def refused(report: Verification, *words: str) -> None:
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
