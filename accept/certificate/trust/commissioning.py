"""Commissioning records: the readings of an instrument of the bench file at its first run, signed by the bench's
technician.

A record stands beside the bench file, in `commissioning/NAME.json`. It holds for the driver and settings that it was
made with: it is void if the settings, the instrument or the record itself were changed.
"""

import base64
import datetime
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.atomic_files import write_atomic
from accept.certificate.trust import authority, keys
from accept.judging import References, Statement, statement
from specs.bench import OFFLINE, BenchFile, InstrumentEntry
from specs.files import json_of
from specs.spec import CheckSpec

FOLDER = "commissioning"
WITHOUT_WIRE = (OFFLINE, "manual")
MAX_BYTES = 5_000_000  # of a record of commissioning: far above the readings of a day


def place(bench: BenchFile, name: str) -> Path:
    """Return the file of an instrument's record."""
    return Path(bench.path).parent / FOLDER / f"{name}.json"


def subject(entry: InstrumentEntry) -> str:
    """Return the SHA-256 of the subject of a record: driver, instrument, line and settings. The port may change."""
    what = entry.model_dump(mode="json", include={"driver", "model", "serial", "link", "settings"})
    what["link"] = {key: value for key, value in (what["link"] or {}).items() if key != "port"}
    return hashlib.sha256(_bytes(what)).hexdigest()


def write_commissioning(
    bench: BenchFile, name: str, found: Mapping[str, Any], credential: keys.Credential | None
) -> Path:
    """Write the record of an instrument and return its file. found: at its first run; credential: as `signed`. Raises
    OSError."""
    path, record = place(bench, name), {"instrument": name, "subject": subject(bench.instruments[name]), **found}
    write_atomic(path, signed(record, credential))
    return path


def signed(record: Mapping[str, Any], credential: keys.Credential | None) -> bytes:
    """Return the file of a record. Without a credential it is unsigned and does not count."""
    file: dict[str, Any] = {"record": record}
    if credential is not None and credential.key is not None:
        signature = credential.key.sign(_bytes(record), ec.ECDSA(hashes.SHA256(), deterministic_signing=True))
        file["certificate"] = credential.certificate.public_bytes(Encoding.PEM).decode("ascii")
        file["signature"] = base64.b64encode(signature).decode("ascii")
    return json.dumps(file, indent=1).encode() + b"\n"


def bench_statement(
    bench: BenchFile, checks: Mapping[str, CheckSpec], on: datetime.date, home: Path, references: References
) -> Statement:
    """Return what the bench file states about the instruments used for these checks, with the evidence of their
    commissioning. on: the day of judging; references: their comparisons with their references."""
    return statement(bench, checks, on, commissioned(bench, home), references)


def commissioned(bench: BenchFile, home: Path) -> dict[str, str]:
    """Return instrument on a wire -> statement on its commissioning: by whom and when, or why it is unproven."""
    wired = {name: entry for name, entry in bench.instruments.items() if entry.driver not in WITHOUT_WIRE}
    recorders = dict.fromkeys(bench.recorders, "unproven: a recorder, which no commissioning covers yet")
    return {name: _words(place(bench, name), entry, home) for name, entry in wired.items()} | recorders


def _words(path: Path, entry: InstrumentEntry, home: Path) -> str:
    try:
        raw = path.read_bytes() if path.stat().st_size <= MAX_BYTES else b""
        file = json_of(raw)
        if "signature" not in file:
            return "unproven: its commissioning record is unsigned"
        record, certificate = _verified(file, keys.ca(home))
        if record["subject"] != subject(entry):
            return "unproven: commissioned with other settings, or as another instrument"
        if not all("how" in outcome for outcome in record["outcomes"]):
            return f"unproven: its commissioning on {record['on']} did not ask whether each change was made; repeat it"
        if not record["passed"]:
            return f"unproven: its commissioning on {record['on']} did not pass"
        return f"commissioned on {record['on']} by {authority.person_of(certificate)}"
    except FileNotFoundError:
        return "unproven: never commissioned"
    except (OSError, keys.KeysError, InvalidSignature, ValueError, KeyError, TypeError) as e:
        return f"unproven: its commissioning record does not verify ({type(e).__name__})"


def _verified(file: Mapping[str, Any], ca: x509.Certificate) -> tuple[Mapping[str, Any], x509.Certificate]:
    certificate = x509.load_pem_x509_certificate(file["certificate"].encode("ascii"))
    certificate.verify_directly_issued_by(ca)
    key = certificate.public_key()
    if authority.role_of(certificate) != authority.TECHNICIAN or not isinstance(key, ec.EllipticCurvePublicKey):
        raise ValueError("not signed by a technician")
    key.verify(base64.b64decode(file["signature"], validate=True), _bytes(file["record"]), ec.ECDSA(hashes.SHA256()))
    return file["record"], certificate


def _bytes(record: object) -> bytes:
    return json.dumps(record, sort_keys=True, separators=(",", ":")).encode()
