"""The state of the bench, which is a fold over its events and nothing else."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from accept.base.documents.results import UnitRecord
from accept.store.event import Event
from accept.store.payloads import (
    AttemptVoided,
    CertificateSigned,
    CertificateWritten,
    UnitJudged,
    UnitRefused,
    payload_of,
)

TECHNICIAN = "technician"  # the role of the first signature
VOIDED = "voided"  # how an attempt ended that quality assurance declared void


@dataclass(frozen=True)
class Signature:
    """The signature of a person on a certificate, with role and time (UTC, ISO 8601)."""

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
class HandedOut:
    """A certificate as handed out: its attempt, hash, number ("" without one), spec and result (None if another
    judgement came before the signature)."""

    attempt: int
    sha256: str
    number: str
    spec_sha256: str
    result: UnitRecord | None


@dataclass(frozen=True)
class UnitState:
    """State of one serial: its last judgement with its certificate, how each judgement ended, and the certificate of
    the latest attempt that ever had one (`handed_out`)."""

    serial: str
    path: str
    inputs: Mapping[str, str]
    spec_sha256: str
    code_sha256: str
    result: UnitRecord
    ended: tuple[tuple[int, str, str], ...] = ()  # event, verdict (`VOIDED` too) and time of each judgement, in order
    certificate: Certificate | None = None
    handed_out: HandedOut | None = None
    certificates: Mapping[str, tuple[int, str]] = field(default_factory=dict)  # sha256 -> attempt, path
    seq: int = 0  # the event of the last judgement
    time: str = ""  # of it, UTC, ISO 8601
    who: str = ""  # who judged
    reason: str | None = None  # why it was judged again; "" if no reason was given, None if none was asked for
    voided: str = ""  # why the last judgement was declared void, by whom and when

    @property
    def attempts(self) -> int:
        """The number of judgements."""
        return len(self.ended)

    @property
    def verdict(self) -> str:
        return str(self.result.verdict)

    def unchanged(self, inputs: Mapping[str, str], spec_sha256: str, code_sha256: str) -> bool:
        """Return whether inputs, spec and code are those of the last judgement, which was not declared void."""
        same = (dict(self.inputs), self.spec_sha256, self.code_sha256) == (dict(inputs), spec_sha256, code_sha256)
        return same and not self.voided


@dataclass(frozen=True)
class BenchState:
    """Every unit by its serial; refused folders by path with the reason; the number of the last event folded in."""

    units: Mapping[str, UnitState] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)
    seq: int = 0


def fold(events: Iterable[Event], state: BenchState | None = None) -> BenchState:
    """Return the state after these events, from `state` (default: an empty bench). Raises StoreError for a bad
    payload."""
    state = state or BenchState()
    units, refused, seq = dict(state.units), dict(state.refused), state.seq
    for event in events:
        seq = event.seq
        match payload_of(event, UnitJudged, UnitRefused, CertificateWritten, CertificateSigned, AttemptVoided):
            case UnitJudged() as judged:
                units[event.subject] = _judged(units.get(event.subject), event, judged)
                refused.pop(judged.path, None)
            case UnitRefused(path, reason):
                refused[path] = reason
            case CertificateWritten() | CertificateSigned() as certified if event.subject in units:
                units[event.subject] = _certified(units[event.subject], event, certified)
            case AttemptVoided() as void if event.subject in units:
                units[event.subject] = _voided(units[event.subject], event, void)
            # A certificate of a unit that was judged elsewhere, as at QA's own desk, is a line of the history.
    return BenchState(units, refused, seq)


def _judged(before: UnitState | None, event: Event, judged: UnitJudged) -> UnitState:
    """Return the unit's new state, without a certificate: the previous one certifies the previous result."""
    return UnitState(
        event.subject,
        judged.path,
        judged.inputs,
        judged.spec_sha256,
        judged.code_sha256,
        judged.result,
        ended=(*(before.ended if before else ()), (event.seq, str(judged.result.verdict), event.time)),
        handed_out=before.handed_out if before else None,
        certificates=before.certificates if before else {},
        seq=event.seq,
        time=event.time,
        who=event.who,
        reason=judged.reason,
    )


def _voided(unit: UnitState, event: Event, void: AttemptVoided) -> UnitState:
    ended = tuple((seq, VOIDED if seq == void.judged else verdict, time) for seq, verdict, time in unit.ended)
    words = f"{void.reason} ({event.who}, {event.time[:10]})" if unit.seq == void.judged else unit.voided
    return replace(unit, ended=ended, voided=words)


def _certified(unit: UnitState, event: Event, certified: CertificateWritten | CertificateSigned) -> UnitState:
    """Return the unit with a new or newly signed certificate: of its last attempt, unless an earlier one is stated."""
    path, sha256 = certified.path, certified.sha256
    attempt = _attempt_of(unit, certified)
    known = {**unit.certificates, sha256: (attempt, path)}
    before = unit.handed_out
    if before is None or before.attempt < attempt:
        result = unit.result if attempt == unit.attempts else None
        handed_out = HandedOut(attempt, sha256, getattr(certified, "number", ""), unit.spec_sha256, result)
    elif before.attempt == attempt:  # countersigned, or signed a second time
        handed_out = replace(before, sha256=sha256, number=getattr(certified, "number", "") or before.number)
    else:
        handed_out = before
    if attempt < unit.attempts:
        return replace(unit, certificates=known, handed_out=handed_out)
    signatures: tuple[Signature, ...] = ()
    if isinstance(certified, CertificateSigned):
        earlier = unit.certificate.signatures if unit.certificate else ()
        signatures = (*earlier, Signature(event.who, certified.role, event.time))
    return replace(unit, certificate=Certificate(path, sha256, signatures), certificates=known, handed_out=handed_out)


def _attempt_of(unit: UnitState, certified: CertificateWritten | CertificateSigned) -> int:
    """Return the number of the attempt that a certificate states: that of the file which was countersigned or, for
    events from before they named that file, that of the last certificate at the same place."""
    if isinstance(certified, CertificateWritten) or certified.role == TECHNICIAN:
        judged = getattr(certified, "judged", 0)  # another program may have judged the unit before it was signed
        return next((n for n, (seq, _, _) in enumerate(unit.ended, 1) if seq == judged), unit.attempts)
    if certified.before is not None and certified.before in unit.certificates:
        return unit.certificates[certified.before][0]
    return max((n for n, path in unit.certificates.values() if path == certified.path), default=unit.attempts)
