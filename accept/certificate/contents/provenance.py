"""What a certificate states beside its result: which attempt it is, what it replaces, where the bench's store stood,
who approved the spec, whether a demo made it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from accept.store import SignedHead, UnitState


@dataclass(frozen=True)
class Provenance:
    """attempt: its number. replaces: verdict, time and certificate of the unit's last judgement, None for a first one;
    where that had no certificate, the last one that there was, of which attempt.
    approval: of the spec, as it is attached. head: of the store when the unit was judged. crl: the authority's list of
    revoked keys as it was then, PEM, for whoever verifies when the authority is gone.
    """

    attempt: int
    replaces: Mapping[str, str | int | None] | None
    approval: Mapping[str, Any]
    head: SignedHead | None = None
    demo: bool = False
    crl: str | None = None

    @classmethod
    def of(
        cls,
        before: UnitState | None,
        head: SignedHead | None,
        approval: Mapping[str, Any],
        *,
        attempt: int | None = None,
        demo: bool = False,
        crl: str | None = None,
    ) -> "Provenance":
        """before: what the store knows of the unit's last judgement; attempt: where it is not one more than that."""
        if before is None:
            return cls(attempt or 1, None, approval, head, demo, crl)
        certificate = before.certificate.sha256 if before.certificate else None
        replaces: dict[str, str | int | None] = {
            "verdict": before.verdict,
            "time": before.time,
            "certificate": certificate,
        }
        if certificate is None and before.handed_out is not None:
            replaces["earlier_attempt"], replaces["earlier_certificate"] = before.handed_out
        return cls(attempt or before.attempts + 1, replaces, approval, head, demo, crl)

    def to_json(self) -> dict[str, Any]:
        """As it stands in the certificate's manifest."""
        more = {"head": self.head and self.head.to_json(), "crl": self.crl, "demo": self.demo or None}
        stated = {"attempt": self.attempt, "replaces": self.replaces, "approval": dict(self.approval)}
        return stated | {key: value for key, value in more.items() if value is not None}
