"""What the pipeline asks of the bench beside its store: judging, explaining, keys and certificates.

`accept.batch.services` hands it over; it takes long to import."""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, Protocol

from accept.base.documents.results import UnitRecord
from accept.judging.calibration import Statement
from accept.judging.superseded import Approval
from accept.store import Event, UnitState
from accept.store.payloads import PlaceInBatch
from accept.units.unit_folder import UnitFolder
from specs.bench import BenchFile
from specs.spec import CheckSpec, Spec

Say = Callable[[str], None]


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
        """Judge the unit, explain its responses, and hand on the files that its certificate attaches. Raises UnitError,
        ContentError."""

    @abstractmethod
    def run(self) -> Judgement | Refusal:
        """Judge the unit for a batch, which goes on with the next unit if this one cannot be judged."""

    @abstractmethod
    def contents(self, judgement: Judgement, stated: Any = None) -> Any:
        """Return what the certificate of a judgement states, beside its provenance. Raises ContentError if an input is
        gone or was changed."""


class JudgingPort(Protocol):
    """What the bench does for its pipeline, with its keys or without."""

    @property
    def signs(self) -> bool:
        """Return whether certificates are signed: there is a key."""

    @property
    def job(self) -> type[JudgingOrder]:
        """Return the kind of job that judges a unit."""

    def start(self, unit: UnitFolder, spec: Spec) -> Any | None:
        """Return the model that is to explain a unit's responses, None without responses or model."""

    def explained(self, known: Mapping[str, Any] | None, start: Any | None, out: Path) -> bool:
        """Return whether a stored explanation, or None, began from this model, and what it names is in `out`."""

    def statement(self, bench: BenchFile, checks: Mapping[str, CheckSpec], on: date) -> Statement:
        """Return what the bench file states of the instruments behind these checks on a day. Raises StoreError."""

    def approval(self, spec: Spec) -> Approval | None:
        """Return the approval of a spec by quality assurance, None without a valid one."""

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
