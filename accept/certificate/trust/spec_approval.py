"""Approval of a spec by quality assurance, with every model file that it names; it is kept at the bench."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.atomic_files import write_atomic
from accept.base.documents.manifest import hashes as model_hashes
from accept.certificate.contents.content import canonical
from accept.certificate.trust import keys
from accept.certificate.trust.approved_spec import UNREADABLE, UNSIGNED, approval_problem, other_content, uncovered
from accept.certificate.trust.authority import QA
from accept.certificate.trust.keys import Credential, KeysError
from accept.certificate.trust.revocation import Revoked
from accept.models.evidence import evidence_of, named_models
from accept.store import Store
from accept.store.payloads import SpecApproved
from specs.errors import AcceptError
from specs.files import json_of, read_bounded
from specs.spec import Spec, builtin, is_builtin

EVER = datetime.min.replace(tzinfo=UTC)


def approve(spec: Spec, credential: Credential, when: datetime) -> dict[str, Any]:
    """Approve a spec and every model file that it names, with the matrices of each, as the owner of a QA key.

    Returns plain data with a signature over name, hashes, person and time. Raises KeysError if the key has another role
    or a model file cannot be read."""
    if credential.role != QA or credential.key is None:
        raise KeysError(f"a spec is approved with a key of quality assurance, not of a {credential.role}")
    models = model_hashes(evidence_of(named_models(spec)))
    if unread := [name for name, files in models.items() if not files]:
        raise KeysError(f"spec {spec.name}: its model file {unread[0]} cannot be read, so it cannot be approved")
    stated = {"name": spec.name, "sha256": spec.sha256, "models": models, "person": credential.person}
    stated["time"] = when.astimezone(UTC).replace(microsecond=0).isoformat()
    signature = credential.key.sign(canonical(stated), ec.ECDSA(hashes.SHA256()))
    certificate = credential.certificate.public_bytes(Encoding.PEM).decode("ascii")
    return {**stated, "certificate": certificate, "signature": signature.hex()}


def write(home: Path, approval: Mapping[str, Any]) -> Path:
    """Keep an approval at the bench. Raises OSError."""
    path = _path(home, approval["sha256"])
    write_atomic(path, canonical(approval))
    return path


def approval_of(spec: Spec, home: Path, ca: x509.Certificate | None, revoked: Sequence[Revoked] = ()) -> dict[str, Any]:
    """Return what a certificate states about its spec: {"builtin": true}, the approval, or {"reason": why it is not
    approved}."""
    if is_builtin(spec.name, spec.sha256):
        return {"builtin": True}
    try:
        approval: dict[str, Any] = json_of(read_bounded(_path(home, spec.sha256)))
    except FileNotFoundError:
        return {"reason": other_content(spec.name) if spec.name in builtin() else UNSIGNED}
    except (OSError, ValueError):
        return {"reason": UNREADABLE}
    models = model_hashes(evidence_of(named_models(spec)))
    if problem := uncovered(approval, models):
        return {"reason": problem}
    if ca is not None and (problem := approval_problem(approval, spec.name, spec.sha256, [ca], revoked)):
        return {"reason": problem}
    return approval


class Approved(NamedTuple):
    """An approval of a spec, as certificates state it. seq: number of its event in the store, 0 without one."""

    stated: dict[str, Any]
    seq: int

    @property
    def time(self) -> str:
        return str(self.stated["time"])

    def is_after(self, other: "Approved") -> bool:
        """Return whether it was given after another one: as the store has them, else as both state."""
        return self.seq > other.seq if self.seq and other.seq else self.time > other.time


def approved_at(store: Store, spec: Spec, home: Path) -> tuple[str, int] | None:
    """Return when quality assurance approved a spec, ISO 8601, and by which event, 0 without one; None without an
    approval that holds at this bench. Raises StoreError."""
    try:
        stated = approval_of(spec, home, keys.ca(home), keys.revoked(home))
    except AcceptError:
        return None
    return (stated["time"], approval_number(store, stated)) if "time" in stated else None


def approval_number(store: Store, stated: Mapping[str, Any]) -> int:
    """Return the number of the first event that has an approval, 0 without one. Raises StoreError."""
    same = (event.seq for event in store.events(what=SpecApproved.KIND) if SpecApproved.of(event).approval == stated)
    return next(same, 0)


def approvals(store: Store, home: Path, name: str, roots: Sequence[x509.Certificate]) -> dict[str, Approved]:
    """Return sha256 -> the last approval of each version of a spec by quality assurance, under these authorities: what
    the store has, and what lies at the bench. A key that was lost approves nothing. Raises StoreError, KeysError."""
    found = dict[bytes, Approved]()  # by the first event that has it: told again, it is no newer
    for event in store.events(what=SpecApproved.KIND):
        stated = dict(SpecApproved.of(event).approval)
        found.setdefault(canonical(stated), Approved(stated, event.seq))
    for path in _path(home, "").parent.glob("*.json"):
        with suppress(OSError, ValueError, TypeError):
            stated = dict(json_of(read_bounded(path)))
            found.setdefault(canonical(stated), Approved(stated, 0))
    lost = [replace(entry, since=EVER) for entry in keys.revoked(home) if entry.compromised]
    held = [
        each
        for each in found.values()
        if approval_problem(each.stated, name, str(each.stated.get("sha256")), roots, lost) is None
    ]
    return {str(e.stated["sha256"]): e for e in sorted(held, key=lambda each: (each.seq, each.time))}


def is_approved(
    store: Store, home: Path, judged_by: str, models: Mapping[str, Mapping[str, str]], roots: Sequence[x509.Certificate]
) -> bool:
    """Return whether the spec of an event, `name@sha256`, comes with this program or was approved with these model
    files. Raises StoreError, KeysError."""
    name, _, sha256 = judged_by.partition("@")
    if is_builtin(name, sha256):
        return True
    approval = approvals(store, home, name, roots).get(sha256)
    return approval is not None and uncovered(approval.stated, models) is None


def _path(home: Path, sha256: str) -> Path:
    return home / "approved-specs" / f"{sha256}.json"
