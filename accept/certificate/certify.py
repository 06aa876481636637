"""From a judged unit to its stored verdict and its signed certificate: one way, for batch, report and workflow.

`examine` judges, explains and draws; `certify` then stores the verdict, signs, writes, and stores that it was signed,
in this order: whatever stops the program in between, the store never speaks of a certificate that is not there, and no
certificate states a verdict that is not stored.
"""

from datetime import UTC, datetime
from pathlib import Path

from accept.base.atomic_files import write_atomic
from accept.certificate import events
from accept.certificate.contents.disposition import Disposition
from accept.certificate.examine import JudgedUnit
from accept.certificate.trust.keys import Credential
from accept.store import Event, Store


def certify(
    judged: JudgedUnit,
    store: Store,
    path: Path,
    credential: Credential | None = None,
    *,
    stored: bool = False,
) -> Event | None:
    """Store the verdict unless it is `stored`; write its certificate, where one was drawn, to `path`, signed where
    there is a credential, and store that it was. Returns the event of the verdict.

    Raises StoreError, SigningRefused, OSError, BenchStopped where the golden units were missed."""
    event = None
    if not stored:
        event = events.judged(store, judged.folder, judged.result, judged.operator)
    if judged.unsigned is not None and credential is None:
        write_atomic(path, judged.unsigned)
    elif judged.unsigned is not None and credential is not None:
        result = judged.result
        sign_into(path, judged.unsigned, credential, store, result.serial, judged.operator, result.spec)
    return event


def sign_into(
    path: Path,
    document: bytes,
    credential: Credential,
    store: Store,
    serial: str,
    who: str,
    spec: str = "",
    disposition: Disposition | None = None,
) -> None:
    """Sign a document in the credential's role, write it to `path`, and store that it was signed, and with which
    disposition.

    Raises SigningRefused, OSError, StoreError."""
    from accept.certificate.signature.signing import sign  # loads pyhanko: only when wanted

    signed = sign(document, credential, datetime.now(UTC), disposition=disposition)
    write_atomic(path, signed)
    decided = None if disposition is None else disposition.to_json()
    events.signed(store, serial, path, signed, credential.role, who=who, spec=spec, disposition=decided)
