"""The services of the bench for a verification, each one function, so that it needs neither its units nor its judging,
its pages or its store. `accept.certificate.verify.rejudge` hands them over."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cryptography import x509

from accept.base.documents.results import UnitRecord
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.outcome import Step
from accept.certificate.signature.long_term import RevocationData
from accept.certificate.verify.signatures import Signed


@dataclass(frozen=True)
class AttachedUnit:
    """An attached `unit.toml` as the bench reads it. files: all that it names; records: section -> those that it reads;
    nonconformances: among its notes."""

    serial: str
    simulated: bool
    files: Collection[str]
    records: Mapping[str, Collection[str]]
    has_responses: bool
    nonconformances: Sequence[str]


ReadUnit = Callable[[bytes], AttachedUnit]
"""Reads the text of a `unit.toml`. Raises ValueError."""
Rejudge = Callable[[CertificateContent], UnitRecord]
"""Judges the attached unit by the attached spec."""
Known = Callable[
    [bytes, CertificateContent, Sequence[Signed], UnitRecord | None, Sequence[x509.Certificate]], Sequence[Step]
]
"""Asks a store or a list about a document, its content, its signatures, the unit judged again, and by which
authorities."""


@dataclass(frozen=True)
class Ports:
    """The bench that a verification asks. rejudge: None if the unit is not judged again. read_record: a file of a unit
    by folder and name. draw: a page, unsigned. sign_again: a document with one more revision, as its signer can only
    have signed it: from the document, the signature, its authority, the revocation data that it keeps, and whether the
    unit was simulated. head_problem: why a signed head of a store does not hold, None if it does."""

    rejudge: Rejudge | None
    read_unit: ReadUnit
    read_record: Callable[[Path, str], bytes]
    draw: Callable[[CertificateContent], bytes]
    sign_again: Callable[[bytes, Signed, x509.Certificate, RevocationData, bool], bytes]
    head_problem: Callable[[Mapping[str, Any]], str | None]
