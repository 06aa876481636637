"""One technician at one unit: every entry goes to the store first, and what is shown is folded from there.

Each method may block (disk, lock, physics): screens call them from thread workers. One lock keeps entries in order.
"""

import re
import threading
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from accept import campaign, ledger, unit
from accept.calibration import Statement, statement
from accept.result import UnitResult, finding_json, information_json
from accept.store import Entry, Event, Store
from accept.unit import SERIAL, UnitFolder
from accept.version import code_sha256
from accept.workflow import entries, folder, section
from accept.workflow.judgement import StepJudgement
from accept.workflow.lock import UnitLock
from accept.workflow.state import Attempt, StepState, UnitRun, fold_run, folder_name
from accept.workflow.status import Status, judgement_of, status_of
from accept.workflow.steps import Step, steps_of
from accept.workflow.typed import EntryError, check_plausible
from checks.declare import Input, Measured, Scalar, Series, Table
from checks.picture import Panel
from specs import Spec
from specs.bench import Bench


def serial_problem(serial: str, spec: Spec) -> str | None:
    """Why a serial cannot be that of a unit of this spec, None when it can."""
    if not SERIAL.fullmatch(serial):
        return "1 to 64 letters, digits, '.', '_' or '-', the first not a mark"
    if not re.fullmatch(spec.serial_pattern, serial):
        return f"does not fit the pattern {spec.serial_pattern} of spec {spec.name}"
    return None


class Session:
    """A unit that is open at the bench; holds its lock until `close`."""

    def __init__(
        self, store: Store, home: Path, spec: Spec, operator: str, serial: str, stated: Bench | None = None
    ) -> None:
        """stated: the bench file whose calibrations stand behind the findings, None where there is none.

        Raises EntryError for a serial that cannot be, UnitBusy, StoreError, OSError."""
        if problem := serial_problem(serial, spec):
            raise EntryError(f"serial '{serial}': {problem}")
        self.store, self.home, self.spec, self.operator, self.serial = store, home, spec, operator, serial
        self.steps, self.stated = steps_of(spec), stated
        self.spec_name = f"{spec.name}@{spec.sha256}"
        self._mutex = threading.RLock()
        self._panels: dict[tuple[str, int], Mapping[str, Panel]] = {}
        self._result: tuple[int, UnitResult] | None = None
        self._lock = UnitLock(home / "units" / serial)
        try:
            self._events = list(store.events(serial))
            self.run = fold_run(serial, self._events)
        except BaseException:
            self._lock.release()
            raise

    def close(self) -> None:
        self._lock.release()

    @property
    def attempt(self) -> Attempt:
        """The present attempt. Raises EntryError when none was begun."""
        if self.run.attempt is None:
            raise EntryError(f"{self.serial}: no attempt was begun")
        return self.run.attempt

    @property
    def folder(self) -> Path:
        """Folder of the present attempt."""
        return self.home / "units" / self.serial / folder_name(self.attempt.number)

    def step(self, name: str) -> Step:
        return next(step for step in self.steps if step.name == name)

    def state(self, step: str) -> StepState:
        return self.attempt.step(step)

    def status(self, step: Step) -> Status:
        return status_of(step, self.state(step.name), self.spec_name, code_sha256())

    def judgement(self, step: str) -> StepJudgement | None:
        """The stored judgement of a step where it still holds."""
        return judgement_of(self.state(step), self.spec_name, code_sha256())

    def panels(self, step: str) -> Mapping[str, Panel]:
        """Pictures of the last judgement of a step made by this program, none before it."""
        return self._panels.get((step, self.state(step).upto), {})

    def begin(self, parts: Mapping[str, str], reason: str = "") -> Event:
        """Start the next attempt; earlier ones stay as they are."""
        number = len(self.run.attempts) + 1
        return self._append(entries.started(self.serial, number, self.spec.kind, parts, reason, self.spec_name))

    def resume(self) -> Event:
        """Note that the present attempt is taken up again. Raises EntryError when it is one of another kind."""
        if self.attempt.kind != self.spec.kind:
            raise EntryError(f"{self.serial} is a {self.attempt.kind}, spec {self.spec.name} judges {self.spec.kind}")
        return self._append(entries.opened(self.serial, self.attempt.number, self.spec_name))

    def take(
        self,
        step: str,
        declared: Input,
        measured: Measured,
        *,
        index: int | None = None,
        repeat: bool = False,
        text: str = "",
        source: str = "typed",
    ) -> Event:
        """Store a value. Raises EntryError where it is not plausible, StoreError."""
        if isinstance(declared, Scalar):
            check_plausible(measured.value, declared)
        form = self.step(step).form_with(declared.name).name
        unit_name = getattr(declared, "unit", "1")
        entry = entries.taken(
            self.serial, step, form, declared.name, measured, unit_name,
            index=index, repeat=repeat, text=text, source=source,
        )  # fmt: skip
        return self._append(entry)

    def link(self, step: str, declared: Series | Table, source: Path) -> Event:
        """Copy a record into the unit's folder and store that it is there. Raises RecordError, OSError, StoreError."""
        form = self.step(step).form_with(declared.name).name
        name, digest = folder.take_in(source, declared, self.folder)
        return self._append(entries.linked(self.serial, step, form, declared.name, name, digest, str(source)))

    def note(self, step: str, text: str, nonconformance: bool = False) -> Event:
        """Keep words about a step. Raises EntryError for none."""
        return self._append(entries.noted(self.serial, step, _words(text, "a note"), nonconformance))

    def remeasure(self, step: str, reason: str) -> Event:
        """Begin a step anew; what was taken before stays in the store. Raises EntryError without a reason."""
        return self._append(entries.remeasured(self.serial, step, _words(reason, "the reason")))

    def undo(self) -> Event:
        """Take back the last entry of this attempt, by an event. Raises EntryError when there is none."""
        if not self.attempt.undoable:
            raise EntryError("there is nothing to undo in this attempt")
        return self._append(entries.undone(self.serial, self.attempt.undoable[-1]))

    def last_entry(self) -> Event | None:
        """What `undo` would take back."""
        seqs = self.attempt.undoable
        return next((e for e in reversed(self._events) if seqs and e.seq == seqs[-1]), None)

    def judge_step(self, name: str) -> StepJudgement:
        """Judge one step by itself and store what was found. Raises UnitError, StoreError, OSError."""
        taken, state = self._written()
        asked = self.spec.model_copy(update={"checks": {name: self.step(name).asked}})
        result = campaign.judge_unit(taken, asked, self._statement(asked))
        upto = state.step(name).upto
        self._panels[name, upto] = {key.partition("/")[2]: panel for key, panel in result.panels.items()}
        judged = StepJudgement(
            upto,
            self.spec_name,
            code_sha256(),
            tuple(finding_json(f) for f in result.findings),
            tuple(information_json(check, q) for check, q in result.information),
            tuple(note.removeprefix(f"{name}: ") for note in result.notes),
        )
        if self.judgement(name) != judged:
            self._append(entries.step_judged(self.serial, name, judged, self.spec_name))
        return judged

    def judge(self) -> UnitResult:
        """Judge the whole unit and store the result. Raises UnitError, StoreError, OSError."""
        taken, _ = self._written()
        at = self.run.seq
        result = campaign.judge_unit(taken, self.spec, self._statement(self.spec))
        with self._mutex:
            ledger.judged(self.store, self.folder, result.to_json(), self.spec, self.operator)
            unchanged = at == self.run.seq
            self._catch_up()
            self._result = (self.run.seq, result) if unchanged else None
        return result

    @property
    def result(self) -> UnitResult | None:
        """The last result of `judge`, None when anything was stored since."""
        return self._result[1] if self._result and self.attempt.verdict is not None else None

    def append(self, entry: Entry) -> Event:
        """Store an entry about this unit. Raises StoreError; then nothing of it is stored."""
        return self._append(entry)

    def refresh(self) -> UnitRun:
        """Fold in what was stored since, here or by another program."""
        with self._mutex:
            self._catch_up()
            return self.run

    def _statement(self, spec: Spec) -> Statement | None:
        if self.stated is None:
            return None
        return statement(self.stated, spec.checks, datetime.now(UTC).date())

    def _append(self, entry: Entry) -> Event:
        with self._mutex:
            event = self.store.append(
                entry.what, entry.subject, entry.payload, who=self.operator, spec=entry.spec or self.spec_name
            )
            self._catch_up()
            return event

    def _catch_up(self) -> None:
        self._events += self.store.events(self.serial, after=self.run.seq)
        self.run = fold_run(self.serial, self._events)

    def _written(self) -> tuple[UnitFolder, Attempt]:
        """The attempt's folder with its `unit.toml` as the state has it, read back, and that state."""
        with self._mutex:
            attempt = self.attempt
            folder.write_document(self.folder, section.document(self.serial, attempt, self.steps))
            return unit.read(self.folder), attempt


def _words(text: str, what: str) -> str:
    words = " ".join(text.split())
    if not words:
        raise EntryError(f"{what} is empty")
    if not words.isprintable() or len(words) > 2000:
        raise EntryError(f"{what} is too long or holds characters that cannot be printed")
    return words
