"""A folder with everything that an auditor needs: certificates of units, what verifies them, and what the bench's store
has of these units. `accept verify FOLDER` checks it with what lies in it."""

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from glob import escape
from importlib import resources
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

from accept.base.atomic_files import write_atomic
from accept.base.documents.document import DocumentError
from accept.base.documents.listings import EvidenceFolder
from accept.base.version import program
from accept.certificate.contents.content import canonical
from accept.certificate.trust import authority, keys
from accept.certificate.trust.published_list import LARGEST, publish
from accept.certificate.trust.revocation import FILE as REVOKED
from accept.store import BENCH_KEY, Event, Store, UnitState, fold, own_key
from accept.store.payloads import CertificateSigned
from specs.errors import AcceptError
from specs.files import read_bounded

EVIDENCE, LIST, AUTHORITY = "evidence.json", "list.json", f"{keys.CA}.pem"
SUPERSEDED = "superseded"  # folder of the certificates that later ones replace
GONE = "it was in the package when it was made, and is gone"


class EvidenceError(AcceptError, ValueError):
    """A package that cannot be written or read; the text names the file and what is wrong."""


@dataclass
class _Package:
    """A folder that is being written, and what it lacks."""

    out: Path
    files: dict[str, str] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)

    def put(self, name: str, content: bytes) -> None:
        (self.out / name).parent.mkdir(parents=True, exist_ok=True)
        write_atomic(self.out / name, content)
        self.files[name] = hashlib.sha256(content).hexdigest()

    def copy(self, path: Path) -> None:
        if path.is_file():
            self.put(path.name, path.read_bytes())
        else:
            self.missing.append(f"{path.name}: {path} is not there")


def write_evidence(
    store: Store,
    out: Path,
    serials: Iterable[str],
    home: Path,
    line: Callable[[Event], str],
    table: Callable[[Sequence[Mapping[str, object]]], bytes],
) -> EvidenceFolder:
    """Write a package of these units into a new folder. line: an event in words; table: rows as a file.

    Raises EvidenceError if the folder is there already, StoreError, KeysError, ListError, OSError."""
    if out.exists():
        raise EvidenceError(f"{out}: is there already; name a folder that is not")
    ca, package = keys.ca(home), _Package(out)
    rows, lines, units, key = list[Mapping[str, object]](), list[str](), list[str](), None
    for serial in serials:
        events = list(store.events(serial))
        if (unit := fold(events)) is None:
            package.missing.append(f"{serial}: this bench's store knows no judgement of it")
            continue
        units.append(serial)
        lines += map(line, events)
        rows += _certificates(package, unit, events)
    for path in (keys.folder(home) / AUTHORITY, keys.folder(home) / REVOKED, *keys.stamping_files(home)):
        package.copy(path)
    if (bench := keys.bench_certificate(home, ca)) is None:
        package.missing.append(f"{LIST}: this bench has no certificate of the authority, so it publishes no list")
    else:
        key = own_key(home / BENCH_KEY)
        publish(store, out / LIST, bench, key, ca)
        package.files[LIST] = hashlib.sha256((out / LIST).read_bytes()).hexdigest()
    if (head := store.signed_head()) is not None:
        package.put("head.json", json.dumps(head.to_json()).encode() + b"\n")
    package.put("summary.csv", table(rows))
    package.put("history.txt", "".join(f"{words}\n" for words in lines).encode())
    made, fingerprint = f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC", authority.fingerprint(ca)
    seq = store.head().seq
    about = (
        resources.files("accept.certificate")
        .joinpath("evidence.md")
        .read_text("utf-8")
        .format(units=len(units), program=f"accept {program()}", made=made, seq=seq, fingerprint=fingerprint)
    )
    package.put("README.md", about.encode())
    evidence = EvidenceFolder(made, tuple(units), dict(sorted(package.files.items())), tuple(package.missing))
    if key is not None:
        evidence = replace(evidence, signature=key.sign(_signed_text(evidence)).hex())
    write_atomic(out / EVIDENCE, json.dumps(evidence.to_json(), indent=1).encode() + b"\n")
    return evidence


def _certificates(package: _Package, unit: UnitState, events: Sequence[Event]) -> Iterator[Mapping[str, object]]:
    """Copy the certificate of each attempt that was signed last, and yield its row of the summary."""
    told = [(event, CertificateSigned.of(event)) for event in events if event.what == CertificateSigned.KIND]
    by_hash = {signed.sha256: (event, signed) for event, signed in told}
    last = {attempt: sha256 for sha256, (attempt, _) in unit.certificates.items()}
    if unit.attempts not in last:
        package.missing.append(f"{unit.serial}: attempt {unit.attempts}, its last, has no certificate")
    for attempt, sha256 in sorted(last.items()):
        path = Path(unit.certificates[sha256][1])
        if (content := _file_of(path, sha256)) is None or sha256 not in by_hash:
            package.missing.append(f"{unit.serial}: the certificate of attempt {attempt} is not at {path}")
            continue
        newest = attempt == max(last)
        name = f"certificates/{unit.serial}.pdf" if newest else f"{SUPERSEDED}/{unit.serial}-{attempt}.pdf"
        package.put(name, content)
        event, signed = by_hash[sha256]
        qa = event if signed.role == authority.QA else None
        by = event if qa is None else by_hash.get(signed.before or "", (None,))[0]
        decided = signed.disposition
        yield {
            "serial": unit.serial,
            "attempt": attempt,
            "number": signed.number or next((s.number for _, s in told if s.sha256 == signed.before), ""),
            "verdict": unit.ended[attempt - 1][1],
            "signed_by": by.who if by else "",
            "signed_at": by.time[:19] if by else "",
            "countersigned_by": qa.who if qa else "",
            "countersigned_at": qa.time[:19] if qa else "",
            "disposition": f"{decided.choice}: {decided.reason}" if decided else "",
            "file": name,
            "sha256": sha256,
        }


def _file_of(path: Path, sha256: str) -> bytes | None:
    """Return the certificate with this hash: at its place, or set aside beside it by a later one."""
    for place in (path, *sorted(path.parent.glob(f"{escape(path.stem)}_{SUPERSEDED}-*.pdf"))):
        if place.is_file() and hashlib.sha256(content := place.read_bytes()).hexdigest() == sha256:
            return content
    return None


def is_set_aside(path: Path) -> bool:
    """Return whether a certificate was set aside by a later one: in the folder of a package, or by its name."""
    return path.parent.name == SUPERSEDED or f"_{SUPERSEDED}-" in path.stem


def evidence_in(folder: Path) -> EvidenceFolder | None:
    """Return the statement of a package about its files, None for another folder. Raises EvidenceError, OSError."""
    path = folder / EVIDENCE
    if not path.is_file():
        return None
    try:
        return EvidenceFolder.from_text(read_bounded(path))
    except (DocumentError, ValueError) as e:
        raise EvidenceError(f"{path}: is not the statement of a package: {e}") from e


def differences(folder: Path, stated: EvidenceFolder) -> Iterator[str]:
    """Yield each file that is gone, was changed or was added since the package was made, or lies outside."""
    for name, sha256 in stated.files.items():
        try:
            real = os.path.realpath(folder / name)
            if not Path(real).is_relative_to(os.path.realpath(folder)):
                yield f"{name}: lies outside the package, and was not read"
            elif hashlib.sha256(read_bounded(Path(real), LARGEST)).hexdigest() != sha256:
                yield f"{name}: it was changed since the package was made"
        except FileNotFoundError:
            yield f"{name}: {GONE}"
        except (OSError, ValueError) as e:
            yield f"{name}: cannot be read ({getattr(e, 'strerror', None) or e})"
    here = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    yield from (f"{name}: it was added since the package was made" for name in sorted(here - {*stated.files, EVIDENCE}))


def is_signed(stated: EvidenceFolder, benches: Iterable[x509.Certificate]) -> bool:
    """Return whether one of these benches signed the statement of a package."""
    for key in (bench.public_key() for bench in benches):
        with suppress(InvalidSignature, ValueError):
            if isinstance(key, Ed25519PublicKey):
                key.verify(bytes.fromhex(stated.signature), _signed_text(stated))
                return True
    return False


def _signed_text(stated: EvidenceFolder) -> bytes:
    return b"accept evidence\n" + canonical(replace(stated, signature="").to_json())
