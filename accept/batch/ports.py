"""The services of the bench for the pipeline beside its store: judging, explaining, keys and certificates.

`accept.batch.services` hands them over; it takes long to import."""

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, Protocol

from accept.base.documents.results import UnitRecord
from accept.store import Event, UnitState
from accept.store.payloads import PlaceInBatch
from accept.units import UnitFolder
from specs.bench import BenchFile
from specs.spec import CheckSpec, Spec

Say = Callable[[str], None]
Statement = Mapping[str, Any]  # as `accept.judging` has it


@dataclass(frozen=True, eq=False)
class Judgement:
    """The judgement of a unit, before the store's reservations. result: with its pictures only if a certificate is
    wanted; files: those that it attaches, as they were judged, by name; the others are read again."""

    result: UnitRecord
    files: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Refusal:
    """A unit that could not be judged, and why."""

    reason: str


@dataclass(frozen=True, eq=False)
class JudgingOrder:
    """One unit to be judged.

    stated : the calibration of the instruments behind it, None without a bench file. start : the model that explains
    its responses, None if there is nothing to explain. out : folder of the results; an improved model goes below it.
    certificate : the file wanted, None for none. home, bench : folder and public key of the bench that certifies it.
    uncertified : number of the stored judgement that only lacks its certificate. place : where the unit stands in its
    batch, None without one. reason : why it is judged again, "" if no reason was given, None if none is asked for.
    """

    unit: UnitFolder
    spec: Spec
    operator: str
    stated: Statement | None = None
    start: Any = None
    out: Path | None = None
    certificate: Path | None = None
    home: Path = Path()
    bench: str = ""
    uncertified: int | None = None
    place: PlaceInBatch | None = None
    reason: str | None = None

    @abstractmethod
    def judge(self, say: Say = lambda _: None) -> Judgement:
        """Judge the unit, explain its responses, and hand on the attached files. Raises UnitError, ContentError."""

    @abstractmethod
    def run(self) -> Judgement | Refusal:
        """Judge the unit for a batch, which goes on with the next unit if this one cannot be judged."""

    @abstractmethod
    def contents(self, judgement: Judgement, stated: Any = None) -> Any:
        """Return what a judgement's certificate states, beside provenance. Raises ContentError for a changed input."""


class JudgingPort(Protocol):
    """The services of the bench for its pipeline, with keys or without. Readers of the store raise StoreError."""

    @property
    def signs(self) -> bool:
        """Return whether certificates are signed: there is a key."""

    @property
    def job(self) -> type[JudgingOrder]:
        """Return the kind of job that judges a unit."""

    def start(self, unit: UnitFolder, spec: Spec) -> Any | None:
        """Return the model that is to explain a unit's responses, None without responses or model."""

    def stands(
        self, entry: UnitRecord, unit: UnitFolder, spec: Spec, stated: Statement | None, held: Any, out: Path | None
    ) -> bool:
        """Return whether a result stands beside its inputs: models, calibration, reservations and explanation are as
        they were, and what the explanation names is in `out`."""

    def statement(
        self, bench: BenchFile, checks: Mapping[str, CheckSpec], on: date, measured: Mapping[str, date]
    ) -> Statement:
        """Return what the bench file states on a day of the instruments behind these checks, held against the days on
        which a unit was measured."""

    def same_calibration(self, one: Statement | None, other: Statement | None) -> bool:
        """Return whether two statements are equal apart from the day on which they were made."""

    def check_may_judge(self, serial: str, known: bool = False) -> None:
        """Raise BenchStopped if the bench missed its golden units. known: as it was when this was first asked."""

    def is_golden(self, serial: str) -> bool:
        """Return whether a unit shows that the bench measures as before."""

    def state(self, past: Sequence[Event], before: float = math.inf) -> UnitState | None:
        """Return what its events before one of them say of a unit; decisions that do not count are left out."""

    def reservations(
        self, unit: UnitFolder, result: UnitRecord | None, spec: Spec, confirmed_by: str, past: Sequence[Event]
    ) -> Any:
        """Return the `accept.judging.reservations.Reservations` about a unit with this result, None before the first.
        confirmed_by: who confirmed its serial in this run; past: its events."""

    def question(self, serial: str, doubted: Mapping[str, str]) -> str:
        """Return the question about a serial that is in doubt."""

    def tell_apart(self, serial: str) -> None:
        """Store that the operator told a serial apart from those that look like it."""

    def withhold_others(self, serial: str, copies: Sequence[Mapping[str, Any]]) -> dict[str, int]:
        """Judge the other units that hold a copy without it; return serial -> number of the event."""

    def amended(self, before: UnitState | None, result: UnitRecord) -> str:
        """Return the certificate that one with this result amends, "" if it amends none."""

    def waits(self, before: UnitState | None, result: UnitRecord) -> bool:
        """Return whether a certificate in place of another one waits for a reason."""

    def draw(
        self,
        path: Path,
        job: JudgingOrder,
        judgement: Judgement,
        before: UnitState | None,
        past: Sequence[Event],
        **stated: str | None,
    ) -> Callable[[int], None]:
        """Draw the certificate of a judgement; return what signs and writes it, given the number of its event. before:
        state of the unit that it replaces; past: its events; stated: `reason`, `amends`, `judged`, `signed_because` of
        the certificate. Raises ContentError; what is returned raises SigningRefused, OSError, StoreError."""
