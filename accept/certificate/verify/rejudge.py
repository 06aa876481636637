"""Verifying a certificate with the bench's own rooms: its unit is read and judged again, its page drawn and signed
again, and its store asked."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path, PurePosixPath

from cryptography import x509

from accept import units
from accept.base.documents.document import DocumentError
from accept.base.documents.manifest import MODEL_FOLDER
from accept.base.documents.results import UnitRecord
from accept.base.version import code_sha256
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.disposition import parse_stated
from accept.certificate.contents.outcome import InvalidCertificate, Step
from accept.certificate.page.document import render
from accept.certificate.signature.long_term import RevocationData
from accept.certificate.signature.signing import signed_again
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.published_list import BenchList
from accept.certificate.verify import attachments
from accept.certificate.verify.against_list import check_list
from accept.certificate.verify.against_store import check_store
from accept.certificate.verify.lists_beside import ListsBeside
from accept.certificate.verify.ports import AttachedUnit, Known, Ports, Rejudge
from accept.certificate.verify.signatures import Signed
from accept.certificate.verify.structure import read_unknown
from accept.certificate.verify.verification import Verification, verify_certificate
from accept.gap import applies
from accept.judging import check_spec, contradictions, judge_unit, serial_fits, without_bench_errors
from accept.judging.reservations import Reservations
from accept.models.evidence import Models
from accept.store import head_problem
from accept.store.decisions import in_notes
from accept.units import RESPONSES, UnitError
from hw.records import DEFAULT_LIMITS
from specs.files import CERTIFICATE_BYTES, UNIT_FILE, read_bounded
from specs.spec import parse
from specs.strict import SpecError


def rejudge(attached: CertificateContent) -> UnitRecord:
    """Return the unit judged from the attached inputs by the attached spec. The result of the gap workflow is taken as
    it was signed: it makes no verdict better, its search takes long, and the rounding of another machine may lead a
    search elsewhere. `verify` states that it was not searched for again.

    Raises InvalidCertificate, also if the attached verdicts do not follow from the attached numbers.
    """
    try:
        own = attached.code_sha256 == code_sha256()  # another program may not have known what this one weighs
        spec = parse(attached.spec_text.encode(), "the attached spec")
        entry = attached.record
        if wrong := contradictions(entry, spec):
            raise InvalidCertificate(f"the attached result contradicts itself: {'; '.join(wrong[:3])}")
        with tempfile.TemporaryDirectory(prefix="accept-verify-") as place:
            models = unpack(attached, Path(place))
            unit = units.read(Path(place), latest=date.max)  # a slow clock says nothing about the unit
            if own:
                check_spec(spec, "the attached spec")
                serial_fits(unit, spec)
            weighed = own or any(i.against for f in entry.findings for i in f.inputs)  # by what it states itself
            again = judge_unit(unit, spec, entry.calibration, models, own=weighed)
            again, reservations = replace(again, gap=entry.gap), Reservations.stated(entry)
            if own:
                again, reservations = without_bench_errors(again), reservations.with_notes(unit.notes)
            return reservations.apply(again)
    except InvalidCertificate:
        raise  # it is a ValueError too
    except DocumentError as e:
        raise InvalidCertificate(f"the attached result cannot be read ({e})") from e
    except (UnitError, SpecError) as e:
        raise InvalidCertificate(f"the attached unit cannot be judged: {e}") from e
    except (KeyError, TypeError, ValueError) as e:
        raise InvalidCertificate(f"the attached statement of calibration is not valid ({type(e).__name__}: {e})") from e


def unpack(contents: CertificateContent, folder: Path) -> Models:
    """Write the inputs as the unit folder they were, and return the models of the spec, opened from there. Raises
    InvalidCertificate if a name leads out of the folder."""
    for name, content in (dict(contents.files) | contents.model_attachments()).items():
        parts = PurePosixPath(name).parts
        if not parts or name.startswith("/") or ".." in parts or "\\" in name or ":" in name:
            raise InvalidCertificate(f"the attachment '{name}' has a name that leads out of its folder")
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)  # of a folder that is thrown away: nothing to keep through a crash
    return Models(contents.models, folder / MODEL_FOLDER)


def ports(judge: Rejudge | None = None) -> Ports:
    """Return this program as a verification asks it. judge: `rejudge`, `rejudge_demo`, or None: then the unit is not
    judged again."""
    return Ports(judge, read_unit, read_record, render, sign_again, head_problem)


def read_unit(text: bytes) -> AttachedUnit:
    """Read an attached `unit.toml`. Raises UnitError, ValueError."""
    unit = units.parsed(text)
    records = {name: list(section.files) for name, section in unit.sections.items()}
    for each in unit.experiments.values():  # the responses are compared with theirs
        records.setdefault(RESPONSES, []).extend(each.files)
    return AttachedUnit(unit.serial, unit.header.simulated, unit.files, records, applies(unit), in_notes(unit.notes))


def read_record(folder: Path, name: str) -> bytes:
    """Return a file of a unit folder. Raises RecordError if the name leads out of it, OSError."""
    return read_bounded(units.inside(folder, name), DEFAULT_LIMITS.max_bytes)


def sign_again(pdf: bytes, signed: Signed, ca: x509.Certificate, kept: RevocationData, simulated: bool) -> bytes:
    """Return a document as `sign` writes it for a signature on it."""
    credential, disposition = Credential(signed.role, None, signed.certificate, ca), parse_stated(signed.disposition)
    return signed_again(pdf, credential, signed.when, kept, disposition, simulated, signed.stamped is not None)


def at_bench(listed: ListsBeside, published: Sequence[BenchList] | None = None) -> Known:
    """Return a function that looks a certificate up in the bench's store, in the lists of revoked keys, and in the
    lists that benches published if any are given."""

    def ask(
        pdf: bytes,
        contents: CertificateContent,
        signatures: Sequence[Signed],
        again: UnitRecord | None,
        roots: Sequence[x509.Certificate],
    ) -> list[Step]:
        steps = [*check_store(pdf, contents, signatures, again, roots), *listed.steps(contents, published or ())]
        if published is not None:
            signed = pdf[: signatures[0].place[2]]
            steps += check_list(signed, contents, signatures[0].when, published, listed.entries)
        return steps

    return ask


def read_contents(pdf: bytes) -> CertificateContent:
    """Return the content of a certificate of which nothing is known, its attachments verified by their hashes, its
    signatures not. Raises InvalidCertificate."""
    return read_unknown(_contents, pdf)


def _contents(pdf: bytes) -> CertificateContent:
    attachments.unit_of(contents := attachments.read(pdf), read_unit)
    return contents


def verify_file(path: Path, trust: Sequence[x509.Certificate], demo: bool = False) -> Verification:
    """Return the verification of a certificate file, which includes judging it again. Raises OSError if it cannot be
    read."""
    return verify_certificate(read_certificate(path), trust, ports(rejudge_demo if demo else rejudge), demo=demo)


def read_certificate(path: Path) -> bytes:
    """Return the bytes of a certificate file. Raises OSError."""
    return read_bounded(path, CERTIFICATE_BYTES)


def is_valid_demo(path: Path, ca_pem: bytes) -> bool:
    """Return whether a certificate of the demo verifies under its CA; takes plain data, so that another process can run
    it."""
    return verify_file(path, [x509.load_pem_x509_certificate(ca_pem)], demo=True).valid


def ready() -> None:
    """Do nothing: the call makes a process start and import this module."""


def rejudge_demo(attached: CertificateContent) -> UnitRecord:
    """Judge again like `rejudge` what the demo's key signed: its passphrase is no secret, so it is trusted only for the
    demo's own built-in units."""
    from accept.simulate import published_units

    if attached.files.get(UNIT_FILE) not in published_units.unit_texts() and not _is_demo_strut(attached):
        raise InvalidCertificate("it is signed by the key of the demo, but is not a unit of the demo")
    return rejudge(attached)


def _is_demo_strut(attached: CertificateContent) -> bool:
    """Return whether every byte is what the demo simulates on this machine: its numbers depend on the machine, as its
    key does."""
    from accept.simulate import demo

    if f'"{demo.SERIAL}"'.encode() not in attached.files.get(UNIT_FILE, b""):
        return False
    return dict(attached.files) == dict(demo.demo_strut().files)
