"""From a judged unit to a signed certificate that is verified on the spot."""

import os
from pathlib import Path

from accept.certificate import keys
from accept.certificate.certify import certify, sign_into
from accept.certificate.examine import drawn
from accept.certificate.keys import QA, TECHNICIAN, Credential
from accept.certificate.signing import SigningRefused
from accept.verify.rejudge import verify_file
from accept.verify.verification import Verification
from accept.workflow.session import Session
from accept.workflow.state.unit_state import certificate_name


def make_keys(home: Path, operator: str, passphrase: str, qa_passphrase: str) -> None:
    """The bench's first keys. Raises KeysError, for keys that exist already too."""
    keys.init(home, passphrase, operator, "quality assurance", qa_passphrase or None)


def sign_unit(session: Session, passphrase: str) -> Verification:
    """Judge where needed, draw, sign as technician, write, store, and verify what was written.

    Raises KeysError for a passphrase that does not open the key (nothing was done then), SigningRefused, DossierError,
    OSError, StoreError.
    """
    credential = _unlocked(session, TECHNICIAN, passphrase)
    if session.attempt.certificate is not None:
        raise SigningRefused(f"{session.serial}: this result is signed already")
    result = session.result or session.judge()
    judged = drawn(result, session.spec, session.folder, session.operator)
    path = session.home / "certificates" / certificate_name(session.serial, session.attempt.number)
    _keep_older(path)
    certify(judged, session.store, path, credential, stored=True, who=credential.person)
    return _verified(session, path, credential)


def countersign_unit(session: Session, passphrase: str) -> Verification:
    """Verify, then sign as quality assurance. Raises as `sign_unit`; what does not verify is not signed."""
    if session.attempt.certificate is None:
        raise SigningRefused(f"{session.serial}: the technician signs first")
    path = Path(session.attempt.certificate)
    credential = _unlocked(session, QA, passphrase)
    before = verify_file(path, [credential.ca])
    if not before.valid:
        raise SigningRefused(f"{path.name} does not verify and is not countersigned: {before.reason}")
    sign_into(path, path.read_bytes(), credential, session.store, session.serial, credential.person, session.spec)
    return _verified(session, path, credential)


def _unlocked(session: Session, role: str, passphrase: str) -> Credential:
    if not passphrase:
        raise keys.KeysError("no passphrase was typed; nothing was signed")
    return keys.unlock(session.home, role, passphrase)


def _keep_older(path: Path) -> None:
    """A certificate of an earlier result of the same attempt was signed: it is set aside, never overwritten."""
    number = 1
    while path.exists():
        aside = path.with_name(f"{path.stem}_superseded-{number}.pdf")
        if not aside.exists():
            os.replace(path, aside)
        number += 1


def _verified(session: Session, path: Path, credential: Credential) -> Verification:
    session.refresh()
    return verify_file(path, [credential.ca])
