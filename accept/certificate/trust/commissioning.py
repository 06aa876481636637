"""Commissioning records: the readings of an instrument of the bench file at its first run, signed by the bench's
technician.

A record stands beside the bench file, in `commissioning/NAME.json`. It holds for the driver and settings that it was
made with: it is void if the settings, the instrument or the record itself were changed. A certificate names who
commissioned an instrument only together with that technician's signature, which anybody can verify.
"""

import base64
import datetime
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.certificate.trust import keys
from accept.certificate.trust.commissioned import as_bytes, claim_of, signer_of, words_of
from accept.judging.calibration import References, Statement, statement
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
    return hashlib.sha256(as_bytes(what)).hexdigest()


def signed(record: Mapping[str, Any], credential: keys.Credential | None) -> bytes:
    """Return the file of a record. Without a credential it is unsigned and does not count."""
    file: dict[str, Any] = {"record": record}
    if credential is not None and credential.key is not None:
        claim = as_bytes(claim_of(record))
        signature = credential.key.sign(claim, ec.ECDSA(hashes.SHA256(), deterministic_signing=True))
        file["certificate"] = credential.certificate.public_bytes(Encoding.PEM).decode("ascii")
        file["signature"] = base64.b64encode(signature).decode("ascii")
    return json.dumps(file, indent=1).encode() + b"\n"


def bench_statement(
    bench: BenchFile, checks: Mapping[str, CheckSpec], on: datetime.date, home: Path, references: References
) -> Statement:
    """Return what the bench file states about the instruments used for these checks, with the evidence of their
    commissioning. on: the day of judging; references: their comparisons with their references."""
    return statement(bench, checks, on, commissioned(bench, home), references)


def commissioned(bench: BenchFile, home: Path) -> dict[str, dict[str, Any]]:
    """Return instrument on a wire -> what its row states: by whom it was commissioned and when, with the signature, or
    why it is unproven."""
    wired = {name: entry for name, entry in bench.instruments.items() if entry.driver not in WITHOUT_WIRE}
    recorders = dict.fromkeys(bench.recorders, _unproven("a recorder, which no commissioning covers yet"))
    return {name: _stated(place(bench, name), entry, home) for name, entry in wired.items()} | recorders


def _unproven(why: str) -> dict[str, Any]:
    return {"commissioned": f"unproven: {why}"}


def _stated(path: Path, entry: InstrumentEntry, home: Path) -> dict[str, Any]:
    try:
        raw = path.read_bytes() if path.stat().st_size <= MAX_BYTES else b""
        file = json_of(raw)
        record = file["record"]
        if "signature" not in file:
            return _unproven("its commissioning record is unsigned")
        if "model" not in record:
            return _unproven("its commissioning record is of an earlier program; repeat it")
        certificate = signer_of(file, claim_of(record), [keys.ca(home)])
        if record["subject"] != subject(entry):
            return _unproven("commissioned with other settings, or as another instrument")
        if not all("how" in outcome for outcome in record["outcomes"]):
            return _unproven(f"its commissioning on {record['on']} did not ask whether each change was made; repeat it")
        if not record["passed"]:
            return _unproven(f"its commissioning on {record['on']} did not pass")
        given = {**claim_of(record), "certificate": file["certificate"], "signature": file["signature"]}
        return {"commissioned": words_of(given, certificate), "commissioning": given}
    except FileNotFoundError:
        return _unproven("never commissioned")
    except (OSError, keys.KeysError, InvalidSignature, ValueError, KeyError, TypeError) as e:
        return _unproven(f"its commissioning record does not verify ({type(e).__name__})")
