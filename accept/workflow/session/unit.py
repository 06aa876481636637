"""A unit that is open at the bench: its events, the state folded from them, and the lock that keeps both in order."""

import hashlib
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from accept.base.spelling import mistaken_for
from accept.store import Event, Overtaken, Store
from accept.store.payloads import AttemptStarted, Payload, RecordLinked, RunOpened
from accept.units import UNIT_FILE, attach, attempt_folder
from accept.workflow.entry.parse_entry import EntryError, serial_problem
from accept.workflow.state.unit_state import Attempt, StepState, UnitRun, fold_run
from accept.workflow.steps import section
from accept.workflow.steps.plan import WorkflowStep, steps_of
from accept.workflow.steps.status import state_of
from specs.bench import NO_CHANNELS, BenchFile, Channels
from specs.errors import AcceptError
from specs.spec import Spec


class UnitBusy(AcceptError, RuntimeError):
    """Another program has the unit open; the text says what to do."""


def _locked(folder: Path) -> FileLock:
    """Return the lock of a unit's folder, which the system frees when the program dies, however it dies."""
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / ".lock", mode=0o600, thread_local=False)
    try:
        lock.acquire(blocking=False)
    except Timeout as e:
        raise UnitBusy(f"{folder.name} is open in another program; finish there, then go on here") from e
    return lock


@dataclass(eq=False, repr=False)
class OpenUnit:
    """Holds the lock of its unit until `close`. refuse: raises EntryError if a text that is about to be stored is a
    passphrase of this bench; the others as `open_session` has them."""

    store: Store
    home: Path
    spec: Spec
    operator: str
    serial: str
    refuse: Callable[[Iterable[str]], None]
    stated: BenchFile | None
    training: bool
    simulated: bool

    def __post_init__(self) -> None:
        """Open the unit. Raises EntryError, UnitBusy, StoreError, OSError."""
        if problem := serial_problem(self.serial, self.spec):
            raise EntryError(f"serial '{self.serial}': {problem}")
        self.steps, self.spec_name = steps_of(self.spec), self.spec.with_hash
        self.simulates = self.training or self.simulated or (self.stated is not None and self.stated.simulated)
        self.mutex = threading.RLock()
        self._lock = _locked(self.home / "units" / self.serial)
        try:
            self.events = list(self.store.events(self.serial))
            self.run = fold_run(self.serial, self.events)
            if self.run.attempt is None and (known := self.store.other_spelling(self.serial)) is not None:
                raise EntryError(mistaken_for(self.serial, known))
        except BaseException:
            self._lock.release()
            raise

    def close(self) -> None:
        self._lock.release()

    @property
    def attempt(self) -> Attempt:
        """Return the present attempt. Raises EntryError if none was begun."""
        if self.run.attempt is None:
            raise EntryError(f"{self.serial}: no attempt was started")
        return self.run.attempt

    @property
    def folder(self) -> Path:
        return self.home / "units" / self.serial / attempt_folder(self.attempt.number)

    def step(self, name: str) -> WorkflowStep:
        return next(step for step in self.steps if step.name == name)

    def state(self, step: str) -> StepState:
        """Return the state of a step; of a derived one, that of the step whose data it reads."""
        return state_of(self.attempt, self.step(step))

    def begin(
        self, parts: Mapping[str, str], reason: str = "", channels: Channels = NO_CHANNELS, simulated: bool = False
    ) -> Event:
        """Start the next attempt; earlier ones stay as they are. channels: their names in the lab's records.
        simulated: no instrument measures the unit."""
        written = {name: source.to_toml() for name, source in channels.items()}
        simulated = simulated or self.simulates
        while True:  # another program may begin an attempt at once: each gets a number of its own
            number, known = len(self.run.attempts) + 1, self.run.seq
            begun = AttemptStarted(number, self.spec.kind, dict(parts), reason, written, simulated)
            with suppress(Overtaken):
                return self.append(begun, after=known)
            self.refresh()

    def resume(self) -> Event:
        """Note that the present attempt is taken up again. Raises EntryError if it is one of another kind, or if it is
        measured and the instruments are simulated."""
        if self.simulates and not (self.training or self.attempt.simulated):
            raise EntryError(f"{self.serial} is being measured: simulated instruments need an attempt of their own")
        if self.attempt.kind != self.spec.kind:
            raise EntryError(
                f"{self.serial} is of kind {self.attempt.kind}, spec {self.spec.name} judges kind {self.spec.kind}"
            )
        return self.append(RunOpened(self.attempt.number))

    def append(self, payload: Payload, after: int | None = None) -> Event:
        """Store an event about this unit. after: number of the last one that it follows from. Raises StoreError, and
        then nothing is stored."""
        with self.mutex:
            event = self.store.write(payload, self.serial, who=self.operator, spec=self.spec_name, after=after)
            self.refresh()
            return event

    def refresh(self) -> UnitRun:
        """Fold in the events stored since, by this or another program."""
        with self.mutex:
            self.events += self.store.events(self.serial, after=self.run.seq)
            self.run = fold_run(self.serial, self.events)
            return self.run

    @property
    def begun(self) -> int:
        """Return the number of the event that started the present attempt, 0 without one."""
        return max((e.seq for e in self.events if e.what == AttemptStarted.KIND), default=0)

    def written(self) -> Attempt:
        """Return the present attempt, with `unit.toml` in its folder as the state has it."""
        with self.mutex:
            attempt = self.attempt
            attach.write_document(self.folder, self._document(attempt))
            return attempt

    def vet(self, attempt: Attempt, inputs: Mapping[str, str]) -> None:
        """Raise EntryError if what was judged is not what was entered: the store has the hash of each record as it was
        taken, and `unit.toml` follows from the entries, those that came meanwhile too: what is judged with them does
        not stand for those before. inputs: file -> sha256, as it was judged."""
        entries = (entry for step in attempt.steps.values() for entry in step.entries)
        taken = {entry.file: [entry.sha256] for entry in entries if isinstance(entry, RecordLinked)}
        texts = (attach.text_of(self._document(each)) for each in (attempt, self.attempt))
        taken[UNIT_FILE] = [hashlib.sha256(text).hexdigest() for text in texts]
        for name in sorted(taken.keys() & inputs.keys()):
            if inputs[name] not in taken[name]:
                remedy = "Judge once more" if name == UNIT_FILE else "F2: take it again"
                stored = f"sha256 {inputs[name][:12]}, the store has {taken[name][0][:12]}"
                raise EntryError(f"{self.folder / name} is not what was entered ({stored}). {remedy}")

    def _document(self, attempt: Attempt) -> dict[str, Any]:
        return section.document(self.serial, attempt, self.steps, attempt.simulated or self.simulates)


class Subject:
    """A part of the work at an open unit that serves by itself."""

    def __init__(self, unit: OpenUnit) -> None:
        self._unit = unit
