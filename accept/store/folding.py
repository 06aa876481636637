"""The state of a unit at the bench, which is a fold over its events and nothing else; which of them are undone."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

from accept.base.documents.results import UnitRecord
from accept.store.event import Event
from accept.store.payloads import (
    VOIDED,
    AttemptStarted,
    AttemptVoided,
    CertificateSigned,
    CertificateWritten,
    EntryUndone,
    Payload,
    StepNoted,
    UnitJudged,
    payload_of,
)

TECHNICIAN = "technician"  # the role of the first signature


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
    judged: UnitJudged
    who: str  # judged it
    ended: tuple[tuple[int, str, str], ...]  # event, verdict (`VOIDED` too) and time of each judgement, in order
    certificate: Certificate | None = None
    handed_out: HandedOut | None = None
    certificates: Mapping[str, tuple[int, str]] = field(default_factory=dict)  # sha256 -> attempt, path
    voided: str = ""  # why the last judgement was declared void, by whom and when

    @property
    def seq(self) -> int:
        """The event of the last judgement."""
        return self.ended[-1][0]

    @property
    def time(self) -> str:
        """When the last judgement was stored, UTC, ISO 8601."""
        return self.ended[-1][2]

    @property
    def attempts(self) -> int:
        return len(self.ended)

    @property
    def result(self) -> UnitRecord:
        return self.judged.result

    @property
    def verdict(self) -> str:
        return str(self.result.verdict)

    def unchanged(self, inputs: Mapping[str, str], spec_sha256: str, code_sha256: str) -> bool:
        """Return whether inputs, spec and code are those of the last judgement, which was not declared void."""
        judged = self.judged
        same = (dict(judged.inputs), judged.spec_sha256, judged.code_sha256) == (dict(inputs), spec_sha256, code_sha256)
        return same and not self.voided


def fold(events: Iterable[Event], state: UnitState | None = None, before: float = math.inf) -> UnitState | None:
    """Return the state of a unit after these of its events, from `state`; None before its first judgement. before:
    number of an event; it and later ones are not counted. Raises StoreError for a bad payload."""
    for event in takewhile(lambda e: e.seq < before, events):
        state = after(state, event, payload_of(event, UnitJudged, CertificateWritten, CertificateSigned, AttemptVoided))
    return state


def after(unit: UnitState | None, event: Event, payload: Payload | None) -> UnitState | None:
    """Return the state of a unit after one of its events. A certificate of a unit that was judged elsewhere, as at QA's
    own desk, is a line of the history."""
    match payload:
        case UnitJudged() as judged:  # without a certificate: the one before certifies the result before
            ended = (event.seq, str(judged.result.verdict), event.time)
            if unit is None:
                return UnitState(event.subject, judged, event.who, (ended,))
            return UnitState(
                unit.serial, judged, event.who, (*unit.ended, ended), None, unit.handed_out, unit.certificates
            )
        case CertificateWritten() | CertificateSigned() as certified if unit is not None:
            return _certified(unit, event, certified)
        case AttemptVoided() as void if unit is not None:
            return _voided(unit, event, void)
    return unit


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
        handed_out = HandedOut(attempt, sha256, getattr(certified, "number", ""), unit.judged.spec_sha256, result)
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


NAMING = (UnitJudged.KIND, AttemptStarted.KIND)  # the events that bring a unit into the store


def undone(events: Iterable[Event]) -> set[int]:
    """Return the numbers of undone events. Raises StoreError.

    A nonconformance is never undone: only a decision of quality assurance releases it; nor is a judgement."""
    stored = list(events)
    holding = {e.seq for e in stored if e.what == StepNoted.KIND and StepNoted.of(e).nonconformance}
    holding |= {e.seq for e in stored if e.what == UnitJudged.KIND}
    return {EntryUndone.of(event).undoes for event in stored if event.what == EntryUndone.KIND} - holding


def is_named(events: Sequence[Event]) -> bool:
    """Return whether the events put the unit on the list: not if its beginning was undone. Raises StoreError."""
    return bool({event.seq for event in events if event.what in NAMING} - undone(events))
