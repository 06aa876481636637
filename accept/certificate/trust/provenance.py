"""What a certificate states beside its result: which attempt it is, what it replaces, where the bench's store stood,
who approved the spec, whether a demo made it."""

from pathlib import Path
from typing import Any

from accept.certificate.trust import keys, revocation
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.spec_approval import approval_of
from accept.store import SignedHead, UnitState
from specs.spec import Spec


def provenance(
    spec: Spec,
    before: UnitState | None,
    head: SignedHead | None,
    home: Path,
    credential: Credential | None,
    attempt: int | None = None,
) -> dict[str, Any]:
    """As it stands in the certificate's manifest. before: what the store knows of the unit's last judgement; attempt:
    its number, where it is not one more than that; head: of the store when the unit was judged.

    replaces: verdict, time and certificate of the last judgement, None for a first one; where that had no certificate,
    the last one that there was, of which attempt. approval: of the spec, as it is attached. crl: the authority's list
    of revoked keys as it is now, PEM, for whoever verifies when the authority is gone. Raises RevocationError."""
    listed = keys.folder(home) / revocation.FILE
    ca = credential.ca if credential else None
    demo = credential is not None and credential.demo
    gone = () if ca is None or demo else revocation.revoked_in(listed, ca)
    stated = {
        "attempt": attempt or (before.attempts + 1 if before else 1),
        "replaces": replaced_by(before),
        "approval": approval_of(spec, home, ca, gone),
    }
    more = {"head": head and head.to_json(), "crl": revocation.kept(listed), "demo": demo or None}
    return stated | {key: value for key, value in more.items() if value is not None}


def replaced_by(before: UnitState | None) -> dict[str, Any] | None:
    """Return what the next judgement of a unit replaces, as its certificate states it; None for a first one."""
    if before is None:
        return None
    certificate = before.certificate.sha256 if before.certificate else None
    replaces: dict[str, Any] = {"verdict": before.verdict, "time": before.time, "certificate": certificate}
    if certificate is None and before.handed_out is not None:
        replaces["earlier_attempt"], replaces["earlier_certificate"] = before.handed_out
    return replaces
