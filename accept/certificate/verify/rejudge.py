"""Judging a unit again from what is attached to its certificate."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

from cryptography import x509

from accept.base.documents.document import DocumentError
from accept.base.documents.results import UnitRecord
from accept.base.version import code_sha256
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.errors import InvalidCertificate
from accept.certificate.verify.attachments import unpack
from accept.certificate.verify.verification import Verification, verify
from accept.judging import judge_unit
from accept.judging.bench_errors import without_bench_errors
from accept.judging.consistency import contradictions
from accept.judging.reservations import Reservations
from accept.units import unit_folder
from accept.units.unit_folder import UNIT_FILE, UnitError
from specs.files import CERTIFICATE_BYTES, read_bounded
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
            unit = unit_folder.read(Path(place), latest=date.max)  # a slow clock says nothing about the unit
            if own:
                judge_unit.check_spec(spec, "the attached spec")
                judge_unit.serial_fits(unit, spec)
            again = judge_unit.judge_unit(unit, spec, entry.calibration, models, own=own)
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


def verify_file(path: Path, trust: Sequence[x509.Certificate], demo: bool = False) -> Verification:
    """Return the verification of a certificate file, which includes judging it again. Raises OSError if it cannot be
    read."""
    return verify(read_certificate(path), trust, rejudge_demo if demo else rejudge, demo=demo)


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
