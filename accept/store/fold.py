"""The state of the bench is a fold over its events; nothing else is remembered.

Payloads: unit_judged {path, inputs, spec_sha256, code_sha256, result}, unit_refused {path, reason},
certificate_written {path, sha256}, certificate_signed {path, sha256, role}. Other kinds do not change the state.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from accept.store.errors import StoreError
from accept.store.event import Event


@dataclass(frozen=True)
class Signature:
    """Who signed a certificate, as what, when (UTC, ISO 8601)."""

    who: str
    role: str
    time: str


@dataclass(frozen=True)
class Certificate:
    """The file of a certificate, its present hash and the signatures on it, in order."""

    path: str
    sha256: str
    signatures: tuple[Signature, ...] = ()


@dataclass(frozen=True)
class UnitState:
    """What is known of one serial: its last judgement, how many there were, the certificate of the last one, and of
    which attempt the last certificate is that there ever was, with its hash."""

    serial: str
    path: str
    inputs: Mapping[str, str]
    spec_sha256: str
    code_sha256: str
    result: Mapping[str, Any]
    verdict: str
    attempts: int = 1
    certificate: Certificate | None = None
    handed_out: tuple[int, str] | None = None
    seq: int = 0  # the event of the last judgement
    time: str = ""  # of it, UTC, ISO 8601
    who: str = ""  # who judged

    def unchanged(self, inputs: Mapping[str, str], spec_sha256: str, code_sha256: str) -> bool:
        """Whether judging again could only repeat the result: same inputs, same spec, same code."""
        return (dict(self.inputs), self.spec_sha256, self.code_sha256) == (dict(inputs), spec_sha256, code_sha256)


@dataclass(frozen=True)
class BenchState:
    """Every unit by its serial; refused folders by path with the reason; the number of the last event folded in."""

    units: Mapping[str, UnitState] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)
    seq: int = 0


_Step = Callable[[dict[str, UnitState], dict[str, str], Event], None]


def fold(events: Iterable[Event], state: BenchState | None = None) -> BenchState:
    """State after these events, from `state` (default: an empty bench). Raises StoreError for an unusable payload."""
    state = state or BenchState()
    units, refused, seq = dict(state.units), dict(state.refused), state.seq
    for event in events:
        seq = event.seq
        try:
            _STEPS.get(event.what, _nothing)(units, refused, event)
        except (KeyError, TypeError, ValueError) as e:
            raise StoreError(f"{event.name}: its payload cannot be used: {type(e).__name__} {e}") from e
    return BenchState(units, refused, seq)


def _nothing(units: dict[str, UnitState], refused: dict[str, str], event: Event) -> None:
    """A kind that only the history tells of."""


def _judged(units: dict[str, UnitState], refused: dict[str, str], event: Event) -> None:
    data = event.data
    before = units.get(event.subject)
    judgement = {name: data[name] for name in ("path", "inputs", "spec_sha256", "code_sha256", "result")}
    verdict, attempts = str(data["result"]["verdict"]), before.attempts + 1 if before else 1
    # Without a certificate: the old one certifies an old result.
    units[event.subject] = UnitState(
        event.subject,
        **judgement,
        verdict=verdict,
        attempts=attempts,
        handed_out=before.handed_out if before else None,
        seq=event.seq,
        time=event.time,
        who=event.who,
    )
    refused.pop(data["path"], None)


def _refused(_: dict[str, UnitState], refused: dict[str, str], event: Event) -> None:
    refused[event.data["path"]] = event.data["reason"]


def _written(units: dict[str, UnitState], _: dict[str, str], event: Event) -> None:
    certificate = Certificate(event.data["path"], event.data["sha256"])
    units[event.subject] = _certified(units[event.subject], certificate)


def _signed(units: dict[str, UnitState], _: dict[str, str], event: Event) -> None:
    data = event.data
    unit = units[event.subject]
    before = unit.certificate.signatures if unit.certificate else ()
    signature = Signature(event.who, data["role"], event.time)
    certificate = Certificate(data["path"], data["sha256"], (*before, signature))
    units[event.subject] = _certified(unit, certificate)


def _certified(unit: UnitState, certificate: Certificate) -> UnitState:
    return replace(unit, certificate=certificate, handed_out=(unit.attempts, certificate.sha256))


_STEPS: Mapping[str, _Step] = {
    "unit_judged": _judged,
    "unit_refused": _refused,
    "certificate_written": _written,
    "certificate_signed": _signed,
}
