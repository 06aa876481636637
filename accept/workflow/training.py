"""Training: simulated units with a hidden fault, which can be put right, on instruments of their own."""

import os
import random
import re
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from accept import units
from accept.base.atomic_files import write_atomic
from accept.base.home import home
from accept.judging import default_spec, load_spec
from accept.models.model_file import SIMULATED_MODEL, open_model
from accept.pictures.labels import label_of
from accept.pictures.words import pretty
from accept.simulate import FAULTS, UnitRequest, simulate
from accept.simulate.bench_truth import world_of
from accept.simulate.faults import Remedy, remedies
from accept.simulate.unit_request import SHORT_S, drawn, on_bench
from accept.store import Event, open_store
from accept.store.payloads import RecordLinked, ValueTaken
from accept.units import UNIT_FILE, UnitFolder
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.begin import Begun
from accept.workflow.entry.passphrase_guard import refuse_passphrases
from accept.workflow.entry.record_folder import SETTLED_S
from accept.workflow.instruments.hardware import BenchInstruments
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.open_bench import LOCK_WAIT_S, BenchServices
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.steps.plan import is_needed
from accept.workflow.steps.status import Status
from hw.simulated import SimulatedBench
from specs.bench import load_bench
from specs.plugins import product_named

BYTE_S = 0.0005  # about 19200 baud
_SERIAL = "TRAIN-"


@dataclass(frozen=True)
class Label:
    """A value on a label or a scale beside the bench, such as the added mass."""

    name: str
    value: float
    unit: str

    @property
    def short_name(self) -> str:
        return self.name

    @property
    def offer(self) -> str:
        return f"{self.value:.6g} {self.unit} from {self.name}"

    def read(self) -> tuple[float, str]:
        return self.value, self.unit

    def uncertainty(self, _: float) -> float | None:
        return None

    def evidence(self) -> Mapping[str, Any]:
        return {}


class TrainingInstruments(BenchInstruments):
    """The simulated instruments, and the labels for inputs without an instrument."""

    def __init__(self, bench_file: Path, taught: UnitFolder) -> None:
        super().__init__(load_bench(bench_file))
        self._taught = taught

    def serving(self, check: str, name: str, index: int | None) -> InstrumentPort | None:
        found = super().serving(check, name, index)
        section = self._taught.sections.get(check)
        labelled = section.number(name) if section else None
        if found is None and section is not None and labelled is not None:
            declared = section.declared.inputs[name]
            return Label("the label", labelled, str(getattr(declared, "unit", "1"))) if is_needed(declared) else None
        return found


@dataclass
class TrainingScore:
    """Units whose fault was guessed since the program was started, and how many of the guesses were right."""

    guessed: int = 0
    right: int = 0


class TrainingUnit:
    """A simulated unit, its records in a folder, and what was put right so far."""

    def __init__(self, request: UnitRequest, folder: Path, score: TrainingScore | None = None) -> None:
        """Write the records, without the list of them. Raises OSError, UnitRequestError, ModelError."""
        self._asked, self._request, self.folder = request, request, folder
        self._score, self._guessed = score or TrainingScore(), False
        self._write(lambda _: True, ago_s=SETTLED_S)  # they are whole: nothing waits for them to be written to the end

    def remedies(self, session: Session) -> Sequence[Remedy]:
        """Return what can be put right at the bench, most of which is not what is wrong; then for each failed step that
        was recorded what its check advises. Its records are made again afterwards."""
        names = {step.name for step in session.steps}
        own = [remedy for remedy in remedies(self._asked.kind) if remedy.step in names]
        failed = [s for s in session.steps if session.judgements.status(s) is Status.FAIL]
        repeats = [
            Remedy(s.check.failed, s.name, record_stems(session.state(s.name).entries))
            for s in failed
            if s.check.failed and not s.derived and s.name not in {remedy.step for remedy in own}
        ]
        return [*own, *(remedy for remedy in repeats if remedy.stems)]

    @property
    def hidden(self) -> str:
        words, fault = hidden_words(self._asked.fault, self._asked.kind), self._asked.fault
        if fault is None or FAULTS[fault].remedy is None:
            return words
        if self._request.fault is None:
            return f"You found it and put it right: {FAULTS[fault].words}."
        return f"{words}\nIt was not put right."

    @property
    def choices(self) -> Sequence[str]:
        return () if self._guessed else [_choice_words(fault) for fault in self._possible]

    @property
    def _possible(self) -> list[str | None]:
        """Return what is hidden and others of the same kind of unit, in an order that tells nothing."""
        kind, rng = self._asked.kind, random.Random(f"guess {self._asked.seed}")
        others = [fault for fault in possible_faults(kind) if fault != self._asked.fault]
        found = [self._asked.fault, *rng.sample(others, min(_MOST_CHOICES - 1, len(others)))]
        rng.shuffle(found)
        return found

    def guess(self, place: int) -> str:
        right = self._possible[place] == self._asked.fault
        self._guessed = True
        self._score.guessed += 1
        self._score.right += right
        return (
            f"{'Right!' if right else 'No.'} {self._score.right} of {self._score.guessed} guessed right this session."
        )

    def put_right(self, session: Session, remedy: Remedy) -> Event:
        """Make the records of a step anew, without the fault if this is its remedy, and begin the step anew. Raises
        StoreError, OSError."""
        taken = (datetime.fromisoformat(e.time).timestamp() for e in session.events if e.what == RecordLinked.KIND)
        ago_s = min(SETTLED_S, time.time() - max(taken, default=0.0) - 1e-3)  # newer than what was taken
        event = session.entries.remeasure(remedy.step, f"{_REASON}{remedy.words}")
        self._mend(remedy, ago_s)
        return event

    def resume(self, session: Session) -> None:
        """Put right what was put right already in the present attempt. Raises OSError."""
        known = {(remedy.step, remedy.words): remedy for remedy in remedies(self._asked.kind)}
        for step in session.steps:
            state = session.state(step.name)
            for reason in (r.removeprefix(_REASON) for r in state.reasons if r.startswith(_REASON)):
                again = Remedy(reason, step.name, record_stems((*state.earlier, *state.entries)))
                self._mend(known.get((step.name, reason), again))

    def _mend(self, remedy: Remedy, ago_s: float = 0.0) -> None:
        now = self._request
        gone = now.fault is not None and FAULTS[now.fault].remedy == remedy
        self._request = replace(now, fault=None if gone else now.fault, take=now.take + 1)
        self._write(lambda name: name.startswith(remedy.stems), ago_s)

    def _write(self, wanted: Callable[[str], bool], ago_s: float = 0.0) -> None:
        """Write the records that are wanted and not there yet. ago_s: how long ago they were written [s]."""
        for name, content in simulate(self._request).files.items():
            path = self.folder / name
            if wanted(name) and not (path.exists() and path.read_bytes() == content):
                write_atomic(path, content, of_unit=True)
                os.utime(path, (time.time() - ago_s,) * 2)


_REASON = "put right: "
_MOST_CHOICES = 7


def record_stems(entries: Sequence[ValueTaken | RecordLinked]) -> tuple[str, ...]:
    """Return the names of the records of a step as the rig writes them: a copy of the same name has a number."""
    return tuple(re.sub(r"-\d+$", "", Path(e.file).stem) for e in entries if isinstance(e, RecordLinked))


@dataclass(frozen=True, eq=False)
class TrainingBench(Workbench):
    """A bench whose units are simulated when they are begun. seed: of the first that is proposed; chosen: whether it
    was asked for; running: the instruments of the present unit; score: of the guesses at all of them."""

    seed: int = 0
    chosen: bool = False
    running: ExitStack = field(default_factory=ExitStack)
    score: TrainingScore = field(default_factory=TrainingScore)

    def next_serial(self) -> str:
        """Return the serial of a unit that was not begun yet. Raises StoreError."""
        number = self.seed
        while next(self.store.events(serial := f"{_SERIAL}{number:06d}"), None) is not None:
            number += 1
        return serial

    def unfinished(self, operator: str) -> str:
        return "" if self.chosen else super().unfinished(operator)

    def session(self, serial: str, kind: str, operator: str) -> Session:
        """Open a unit that the bench simulates. Raises EntryError, UnitBusy, StoreError, OSError."""
        return open_session(self.store, self.home, self.specs[kind], operator, serial, self.stated, training=True)

    def at_unit(self, begun: Begun) -> Workbench:
        """Return the bench with the records and the instruments of a unit. Raises OSError, UnitRequestError,
        ModelError, and EntryError if the serial is a passphrase: folders get its name."""
        self.running.close()
        number = begun.serial.removeprefix(_SERIAL)
        if number == begun.serial:
            refuse_passphrases(self.home, [number])
        seed = int(number) if number.isdecimal() and number != begun.serial else zlib.crc32(begun.serial.encode())
        request = training_request(begun.kind, begun.serial, seed)
        unit = TrainingUnit(request, self.home / "records" / begun.serial, self.score)
        taught = units.read(unit.folder)
        world = world_of(unit.folder)
        simulated = SimulatedBench(world, self.home / "bench" / begun.serial, seed=seed, byte_s=BYTE_S)
        bench = self.running.enter_context(simulated)
        (unit.folder / UNIT_FILE).unlink()  # the technician finds records, not their list
        instruments = TrainingInstruments(bench.bench_file, taught)
        self.running.callback(instruments.close)
        return replace(self, instruments=instruments, records=unit.folder, training=unit)


def open_training(spec: str | None, seed: int | None) -> TrainingBench:
    """Return a bench for simulated units, with records in a folder and instruments on pseudo-terminals; of every
    simulated kind unless a spec is given. Raises what `open_bench` does."""
    place = home() / "training"
    place.mkdir(parents=True, exist_ok=True)
    chosen = seed is not None
    seed = random.SystemRandom().randrange(10**6) if seed is None else seed
    specs = [load_spec(spec)] if spec else [default_spec(kind) for kind in SIMULATED_MODEL]
    running = ExitStack()
    return TrainingBench(
        open_store(f"sqlite:///{place / 'store.sqlite'}", timeout_s=LOCK_WAIT_S, bench=place),
        place,
        {one.kind: one for one in specs},
        BenchServices(),
        proposed=f"{_SERIAL}{seed:06d}",
        closing=running.close,
        seed=seed,
        chosen=chosen,
        running=running,
    )


def training_request(kind: str, serial: str, seed: int) -> UnitRequest:
    """Return a unit with one of the faults that its kind can have, or with none."""
    fault = random.Random(seed).choice(possible_faults(kind))
    # What has nothing hidden must pass: at two standard deviations of everything some struts miss a limit by a hertz.
    most = 1.0 if fault is None else 2.0
    nominal = open_model(SIMULATED_MODEL[kind])
    payload = {"bench.payload_kg": nominal.values["bench.payload_kg"]}  # a bench has one, which the spec states
    model = on_bench(drawn(nominal, seed, most).with_values(payload), kind)
    return UnitRequest(serial, kind, model, seed=seed, fault=fault, repeats=False, low_s=SHORT_S, high_s=SHORT_S)


def possible_faults(kind: str) -> list[str | None]:
    """Return what may be hidden in a unit of a kind; None: nothing."""
    return [None, *(name for name, fault in FAULTS.items() if kind in fault.kinds)]


def _choice_words(fault: str | None) -> str:
    return "nothing: it is a good unit" if fault is None else pretty(FAULTS[fault].words)


def hidden_words(fault: str | None, kind: str) -> str:
    """Return the hidden fault of a unit of a kind, and which findings show it before any gap analysis."""
    if fault is None:
        strut = product_named(kind).family == "strut"
        unlike = " A simulated strut has no hysteresis, which its step notes." if strut else ""
        return f"Nothing was wrong with this unit: every finding should pass.{unlike}"
    hidden = FAULTS[fault]
    before, after = hidden.shown(kind), hidden.shows
    explained = f"; after the gap analysis: {_said(after)}" if after != before else ""
    return f"Hidden in this unit: {pretty(hidden.words)}.\nIt shows so: {_said(before)}{explained}."


def _said(shows: Sequence[tuple[str, str]]) -> str:
    ends = {"fail": "fails", "no_result": "has no result"}
    words = [f"{label_of(quantity)} {ends[verdict]}" for quantity, verdict in shows]
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
