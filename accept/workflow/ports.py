"""The bench's services for screens and dialogues that take long to import: judging, explaining, measuring, signing.

`accept.workflow.open_bench` hands them over."""

import threading
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from accept.base.documents.results import UnitRecord
from accept.store import Event, Store
from accept.store.payloads import StepJudged
from accept.units import UnitFolder
from accept.workflow.dialogue.summary_effects import Ask, BenchKeys, Report
from accept.workflow.instruments.port import Instruments
from accept.workflow.session import Session
from checks.picture import Panel
from specs.bench import BenchFile
from specs.spec import Spec

if TYPE_CHECKING:
    from checks.acceptance import HitsSoFar


class Computation(Protocol):
    """Judges and explains one unit in the other process, one thing at a time. Raises NotDone, StoreError, OSError."""

    def judge_step(self, name: str) -> StepJudged:
        """Judge one step by itself and store the judgement."""

    def judge(self) -> UnitRecord:
        """Judge the whole unit and store the result. Raises BenchStopped if the golden units were missed."""

    def explain(self) -> Event:
        """Run the gap workflow on the responses and store its answer. Raises EntryError without responses."""

    def cancel(self) -> None:
        """Stop what is under way, or what comes."""


class Talk(Protocol):
    """The person at a measurement. stopped: set when it is to end."""

    @property
    def stopped(self) -> threading.Event: ...

    def ask(self, words: str) -> str:
        """Return what the person types."""

    def say(self, words: str) -> None:
        """Tell the person."""

    def show(self, place: str, so_far: "HitsSoFar") -> None:
        """Show the hits of the hammer at a place so far."""


class SigningPort(Protocol):
    """Signs the certificate of one unit. Raises KeysError, SigningRefused, ContentError, OSError, StoreError."""

    def keys(self, role: str) -> BenchKeys:
        """Return what is known of the keys of a role at this bench."""

    def problem(self, asked: Ask, place: int, given: Sequence[str]) -> str:
        """Return why a line of a question cannot stay as it was typed, "" if it can. A passphrase is compared with what
        was typed beside it, and tried."""

    def make_keys(self, passphrase: str) -> Path:
        """Make the bench's authority and the operator's key; return the file with the authority's passphrase, which
        belongs off the bench. Raises KeysError, also if keys exist already."""

    def sign(self, passphrase: str, reason: str = "") -> Report:
        """Sign as technician, and verify what was written."""

    def countersign(self, passphrase: str, choice: str = "", reason: str = "") -> Report:
        """Verify, then sign as quality assurance."""


class Services(Protocol):
    """The services of the bench for its screens."""

    def warm(self) -> None:
        """Let the other process start, without waiting for it. Raises OSError."""

    def close(self) -> None:
        """End the other process, with the work under way."""

    def refuse_passphrases(self, home: Path, texts: Iterable[str]) -> None:
        """Raise EntryError if one of the texts, which are about to be stored, is a passphrase of this bench."""

    def serial_doubt(self, store: Store, serial: str, unit: UnitFolder | None) -> str | None:
        """Return the question about a serial in doubt, None without. unit: its folder, or None. Raises StoreError."""

    def tell_apart(self, store: Store, serial: str, who: str) -> None:
        """Store that a person told a serial apart from those that look like it. Raises StoreError."""

    def open_session(
        self, store: Store, home: Path, spec: Spec, operator: str, serial: str, stated: BenchFile | None
    ) -> Session:
        """Open a unit. Raises EntryError, UnitBusy, StoreError, OSError."""

    def computation(self, session: Session, say: Callable[[str], None] = ...) -> Computation:
        """Return a computation about a unit. say: is called, from the thread that waits, with its progress."""

    def key_problem(self, home: Path, operator: str) -> str:
        """Return why an operator cannot sign as technician with the keys at this bench, and what to do; "" if nothing
        is known against it, or the bench has no keys yet."""

    def signing(self, session: Session) -> SigningPort:
        """Return what signs the certificate of a unit."""

    def draw(self, panels: Sequence[Panel], columns: int) -> bytes:
        """Return panels as SVG at full resolution."""

    def measure(self, session: Session, step: str, instruments: Instruments, talk: Talk) -> Sequence[str]:
        """Measure a whole step by its recipe and store its values; return notes. Raises InstrumentError, EntryError,
        RecordError, StoreError, OSError."""
