"""One technician at one unit: every entry goes to the store first, and the screens show the state folded from there.

Each method may block (disk, lock, physics): screens call them from thread workers. One lock keeps entries in order.
"""

import math
import threading
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from accept.base.documents.results import UnitRecord
from accept.base.version import code_sha256
from accept.batch.job import Judgement, UnitJob
from accept.batch.pipeline import Pipeline
from accept.certificate.contents.provenance import amended
from accept.gap.attach_to_result import with_explanation
from accept.judging.advice import ADVICE, action, record_advice
from accept.judging.bench_errors import BY_RESONANCE, withhold_bench_errors
from accept.judging.nonconformance import open_nonconformances
from accept.store import Event, Store
from accept.store.errors import Overtaken
from accept.store.payloads import (
    AttemptStarted,
    EntryUndone,
    GapExplained,
    NotedFile,
    Payload,
    ReadingFailed,
    RecordLinked,
    RecordRefused,
    RunOpened,
    StepJudged,
    StepNoted,
    StepRemeasured,
    ValueTaken,
    payload_of,
)
from accept.store.spelling import mistaken_for
from accept.store.undone import undone
from accept.units import attach, unit_folder
from accept.units.attempt_folder import attempt_folder
from accept.workflow import print_picture, record_folder
from accept.workflow.entry.parse_entry import EntryError, check_plausible, plain_words, serial_problem
from accept.workflow.instruments.port import InstrumentPort, reading
from accept.workflow.passphrase_guard import refuse_passphrases
from accept.workflow.record_folder import Proposals
from accept.workflow.state.lock import UnitLock
from accept.workflow.state.unit_state import (
    Attempt,
    Given,
    StepState,
    UnitRun,
    fold_run,
)
from accept.workflow.state.usual_values import usual_values
from accept.workflow.status import Status, judgement_of, open_steps, state_of, status_of
from accept.workflow.steps import section
from accept.workflow.steps.plan import WorkflowStep, steps_of
from accept.workflow.steps.section import note_lines, ready, value_words
from accept.workflow.worker import panel_cache
from accept.workflow.worker.judging import Explain, Judge, judge_here, judgement_of_result
from checks.cause import Cause
from checks.consistency import check_consistency
from checks.declare import CsvTable, Form, Input, Measured, Scalar, Series
from checks.errors import RecordError
from checks.picture import Panel
from checks.quantity import Quantity
from checks.verdict import Finding, Verdict
from hw.errors import InstrumentError
from specs.bench import NO_CHANNELS, BenchFile, Channels, channel_map
from specs.spec import Spec

NOTES_FOLDER = "notes"  # in that of an attempt: photos and other files
_FILE_BYTES = 200_000_000  # of one of them
_ENTRIES = (ValueTaken.KIND, RecordLinked.KIND, RecordRefused.KIND, StepJudged.KIND, ReadingFailed.KIND)  # hold no unit
_EVENTS_BACK = 5000  # of the store: whether a file belongs to another unit is asked of these


class Session:
    """A unit that is open at the bench; holds its lock until `close`."""

    def __init__(
        self,
        store: Store,
        home: Path,
        spec: Spec,
        operator: str,
        serial: str,
        stated: BenchFile | None = None,
        training: bool = False,
        simulated: bool = False,
    ) -> None:
        """Open a unit. stated: the bench file whose calibrations stand behind the findings, None without one. training:
        the unit is simulated, and signed with keys that are of no bench. simulated: so are its instruments.

        Raises EntryError if the serial is not valid, UnitBusy, StoreError, OSError."""
        if problem := serial_problem(serial, spec):
            raise EntryError(f"serial '{serial}': {problem}")
        self.store, self.home, self.spec, self.operator, self.serial = store, home, spec, operator, serial
        self.steps, self.stated, self.training = steps_of(spec), stated, training
        self.simulates = training or simulated or (stated is not None and stated.simulated)
        self.spec_name = f"{spec.name}@{spec.sha256}"
        self._mutex = threading.RLock()
        self._panels: dict[tuple[str, int], Mapping[str, Panel]] = {}
        self._result: tuple[Given, UnitRecord] | None = None
        self._held: tuple[int, Sequence[str]] | None = None
        self._compared: tuple[int, Sequence[Finding]] | None = None
        self.usual = usual_values(store, spec.kind, but=serial)
        self._lock = UnitLock(home / "units" / serial)
        try:
            self._events = list(store.events(serial))
            self.run = fold_run(serial, self._events)
            if self.run.attempt is None and (known := store.other_spelling(serial)) is not None:
                raise EntryError(mistaken_for(serial, known))
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
        """Return the folder of the present attempt."""
        return self.home / "units" / self.serial / attempt_folder(self.attempt.number)

    def step(self, name: str) -> WorkflowStep:
        return next(step for step in self.steps if step.name == name)

    def state(self, step: str) -> StepState:
        """Return the state of a step; of a derived one, that of the step whose data it reads."""
        return state_of(self.attempt, self.step(step))

    def status(self, step: WorkflowStep) -> Status:
        status = status_of(step, self.state(step.name), self.judgement(step.name))
        return Status.HELD if status is Status.PASS and self.nonconformances else status

    @property
    def nonconformances(self) -> Sequence[str]:
        """Return the nonconformances that hold the unit, noted in this attempt or an earlier one. Raises StoreError."""
        upto = max((e.seq for e in self._events if e.what not in _ENTRIES), default=0)
        if self._held is None or self._held[0] != upto:
            notes = {step.name: note_lines(self.state(step.name)) for step in self.steps}
            self._held = upto, open_nonconformances(self.store, self.serial, notes)
        return self._held[1]

    def next_step(self, after: str | None = None) -> WorkflowStep | None:
        """Return the first step that is not complete, at which a restarted workflow stands; of those behind `after`,
        then of those before it that were not judged: one without a result stays behind, and the way leads on."""
        at = next((i + 1 for i, step in enumerate(self.steps) if step.name == after), 0)
        behind = {step.name for step in self.steps[at:]}
        ahead = [step for step in self.waiting if step.name in behind]
        left = [s for s in self.waiting if s.name not in {after, *behind} and self.judgement(s.name) is None]
        return next(iter(ahead + left), None)

    def judgement(self, step: str) -> StepJudged | None:
        """Return the stored judgement of a step if it still holds, as the judgement of the whole unit leaves it: what
        another step contradicts has no result, nor has what a reservation of the last summary took it from."""
        own = judgement_of(self.state(step), self.spec_name, code_sha256())
        if own is None:
            return own
        refuted = {f.quantity: f for f in self._last_findings if f.check == step and _is_reserved(f)}
        refuted = {f.quantity: f for f in self._consistent() if f.check == step} | refuted
        return replace(own, findings=tuple(refuted.get(f.quantity, f) for f in own.findings))

    def _consistent(self) -> Sequence[Finding]:
        """Return the findings of all steps that are judged; without a result where steps contradict each other, or
        where they show an error of the bench."""
        if self._compared is None or self._compared[0] != self.run.seq:
            states = (self.state(step.name) for step in self.steps)
            own = [j for state in states if (j := judgement_of(state, self.spec_name, code_sha256())) is not None]
            findings = [finding for each in own for finding in each.findings]
            known = {i.quantity: i.measured() for each in own for i in each.information}
            known |= {f.quantity: Quantity(f.quantity, f.value, f.U) for f in findings if f.value is not None}
            stiffness = known[BY_RESONANCE].value if BY_RESONANCE in known else math.nan
            compared = withhold_bench_errors(check_consistency(findings, known), stiffness, self.gap)
            self._compared = self.run.seq, compared
        return self._compared[1]

    def action_at_source(self, step: WorkflowStep) -> str | None:
        """Return what to put right first at the records that a derived step reads; None if nothing is known there."""
        read = self.judgement(step.check.reads) if step.derived else None
        return None if read is None else action(read.findings)

    @property
    def _last_findings(self) -> Sequence[Finding]:
        """Return the findings of the last judgement of the unit, made by this or an earlier run of the program; none if
        its inputs, spec or program have changed since."""
        if self.result is not None:
            return self.result.findings
        judged = self.attempt.judged
        same = judged is not None and (judged.spec_sha256, judged.code_sha256) == (self.spec.sha256, code_sha256())
        return judged.result.findings if judged is not None and same else ()

    def panels(self, step: str) -> Mapping[str, Panel]:
        """Return the pictures of the last judgement of a step by this program, none before it; of a slow step also
        those kept by an earlier run."""
        key = (step, self.state(step).upto)
        if key not in self._panels and self.step(step).check.model is not None:
            self._panels[key] = panel_cache.load(self.folder, *key)
        return self._panels.get(key, {})

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
        day: str | None = None,
        evidence: Mapping[str, Any] | None = None,
    ) -> Event:
        """Store a value in the unit that its input declares. index: place in a vector. repeat: one more reading of the
        same value, not a correction. source: `typed` or the instrument's name; text: what it was read from. day: of
        measuring, if that is not today. evidence: of the instrument, its calibration and its line.

        Raises EntryError if it is not plausible, StoreError."""
        if isinstance(declared, Scalar):
            check_plausible(measured.value, declared)
        form = self.step(step).form_with(declared.name).name
        unit_name = getattr(declared, "unit", "1")
        taken = ValueTaken(
            step, form, declared.name, measured.value, measured.U, unit_name,
            index=index, repeat=repeat, text=text, source=source, day=day, evidence=evidence or None,
        )  # fmt: skip
        return self.append(taken)

    def read(
        self, step: str, declared: Input, instrument: InstrumentPort, *, index: int | None = None, repeat: bool = False
    ) -> Event:
        """Read an instrument and store its value with the traffic of its line; if it gives none, store that.

        Raises InstrumentError, EntryError for a reading that cannot be, StoreError."""
        unit_name = str(getattr(declared, "unit", "1"))
        try:
            measured = reading(instrument, unit_name)
            if isinstance(declared, Scalar):
                check_plausible(measured.value, declared)
        except (InstrumentError, EntryError) as e:
            self.append(ReadingFailed(step, declared.name, str(e), instrument.name, instrument.evidence()))
            raise
        text = f"{measured.value:.9g} {unit_name}"
        return self.take(
            step, declared, measured,
            index=index, repeat=repeat, text=text, source=instrument.name, evidence=instrument.evidence(),
        )  # fmt: skip

    def link(
        self,
        step: str,
        declared: Series | CsvTable,
        source: Path,
        day: str | None = None,
        instrument: str | None = None,
        evidence: Mapping[str, Any] | None = None,
    ) -> Event:
        """Copy a record into the unit's folder and store that it is there, or that it was refused and why. instrument,
        evidence: of the readings, if it was measured live. Raises RecordError, OSError, StoreError."""
        form = self.step(step).form_with(declared.name).name
        try:
            name, digest = attach.take_in(source, declared, self.folder, channel_map(self.attempt.channels))
        except RecordError as refused:
            e = attach.pointed(refused, source, declared, self.spec.kind, channel_map(self.attempt.channels))
            if source.is_file():
                written, action = source.stat().st_mtime, self.link_advice(source, e)
                self.append(
                    RecordRefused(step, form, declared.name, source.name, str(source), written, e.reason, action)
                )
            raise e from refused
        return self.append(
            RecordLinked(step, form, declared.name, name, digest, str(source), day, instrument, evidence)
        )

    def link_advice(self, source: Path, why: RecordError) -> str:
        """Return what to do about a record that could not be linked."""
        if attach.damage(source):
            return ADVICE[Cause.FILE_DAMAGED]
        return next(iter(record_advice(why.reason)), "F2: choose another file")

    def may_fit(self, declared: Series | CsvTable, source: Path) -> bool:
        """Return whether a file has the channels of a record of this unit, by their names."""
        return attach.may_fit(source, declared, channel_map(self.attempt.channels))

    def refusal(self, finding: Finding) -> RecordRefused | None:
        """Return the record that was refused for a quantity that has no result for want of it, None without one."""
        reasons = () if finding.cause is None else finding.cause.all()
        missing = [reason.record for reason in reasons if reason.cause is Cause.NOT_MEASURED]
        refused = self.state(finding.check).refused if missing else {}
        named = [refused[name] for name in missing if name in refused]
        return next(iter(named or ([] if all(missing) else refused.values())), None)

    def proposals(self, step: WorkflowStep, form: Form, folder: Path) -> Proposals:
        """Return the records in a folder that are proposed for the inputs of a form that have none yet. One that was
        refused is proposed again when it was written anew."""
        state = self.state(step.name)
        files = [i for i in form.inputs if isinstance(i, Series | CsvTable)]
        given = {i.name for i in files if state.link(i.name) is not None}
        if len(given) == len(files):
            return {}
        known = self._sources()

        def taken(path: Path, mtime: float) -> bool:
            return mtime <= known.get(str(path), -math.inf) or mtime == state.unusable.get(str(path))

        others = self._inputs_of_others(step)
        return record_folder.proposals(folder, files, _about(step), self.may_fit, taken, attach.damage, others, given)

    def name_score(self, step: WorkflowStep, declared: Series | CsvTable, file: str) -> tuple[int, str]:
        """Return how far the name of a file speaks for an input of a step, and the step that it speaks for instead."""
        if any(isinstance(e, RecordLinked) and e.file == file for e in self.state(step.name).entries):
            return -1, "in use"
        wanted = [i for i in step.form_with(declared.name).inputs if isinstance(i, Series | CsvTable)]
        return record_folder.name_score(file, declared, wanted, _about(step), self._inputs_of_others(step))

    def _inputs_of_others(self, step: WorkflowStep) -> Mapping[str, Sequence[Series | CsvTable]]:
        """Return words -> inputs of the steps whose records may lie in the same folder."""
        others = [other for other in self.steps if other is not step and not other.derived]
        inputs = {_about(other): [i for form in other.check.forms for i in form.inputs] for other in others}
        return {about: [i for i in given if isinstance(i, Series | CsvTable)] for about, given in inputs.items()}

    def _sources(self) -> dict[str, float]:
        """Return when [s of the epoch] each file was last taken for a unit, among the latest events of the store. What
        was undone or replaced in this attempt is free again."""
        latest = self.store.events(what=RecordLinked.KIND, after=max(0, self.store.head().seq - _EVENTS_BACK))
        gone = undone(self._events)
        gone |= self._replaced(gone)
        return {
            str(event.data["origin"]): datetime.fromisoformat(event.time).timestamp()
            for event in latest
            if event.seq not in gone
        }

    def _replaced(self, undone: AbstractSet[int]) -> set[int]:
        """Return the numbers of the events by which a record was linked in whose place another one was linked since.
        What went before a step was begun anew is not among them: it was measured then."""
        replaced, last = set[int](), dict[tuple[str, str], int]()
        for event in self._events:
            match payload_of(event, RecordLinked, StepRemeasured):
                case RecordLinked() as link if event.seq > self._begun and event.seq not in undone:
                    replaced |= {last[link.step, link.input]} if (link.step, link.input) in last else set()
                    last[link.step, link.input] = event.seq
                case StepRemeasured() as again:
                    last = {key: seq for key, seq in last.items() if key[0] != again.step}
        return replaced

    def note(
        self,
        step: str,
        text: str,
        nonconformance: bool = False,
        files: Sequence[Path] = (),
        internal: bool = False,
        printed: bool = False,
    ) -> Event:
        """Keep a note about a step, with copies of its photos or other files. internal: not on the certificate, where
        every nonconformance is; printed: its photos are shown there, scaled. Raises EntryError if it is empty or a
        passphrase, or if a file to print is no picture, OSError if a file cannot be read."""
        words, folder = plain_words(text, "a note"), self.folder / NOTES_FOLDER
        refuse_passphrases(self.home, [text])
        kept = []
        for path in files:
            scaled = print_picture.scaled(path) if printed else b""  # a file that is no picture stops here
            name, digest = attach.copy_in(path, folder, _FILE_BYTES)
            shown = f"{NOTES_FOLDER}/{print_picture.keep(scaled, folder, name)}" if scaled else ""
            kept.append(NotedFile(name, digest, str(path), shown))
        return self.append(StepNoted(step, words, nonconformance, tuple(kept), internal and not nonconformance))

    def remeasure(self, step: str, reason: str) -> Event:
        """Begin a step anew; its earlier entries stay in the store. Raises EntryError without a reason, and if it is a
        passphrase."""
        refuse_passphrases(self.home, [reason])
        return self.append(StepRemeasured(step, plain_words(reason, "the reason")))

    def undo(self, step: str = "") -> Event:
        """Take back the last entry of this attempt, by an event. step: only if it belongs to this one. Raises
        EntryError if there is no entry, or one of another step, or a nonconformance, which only quality assurance
        releases."""
        with self._mutex:
            last = self.last_entry()
            if last is None:
                raise EntryError("there is nothing to undo in this attempt")
            if step and last.data.get("step") != step:
                raise EntryError("the last entry belongs to another step; undo it in the step list")
            if last.what == StepNoted.KIND and (note := StepNoted.of(last)).nonconformance:
                raise EntryError(f"'{note.text}' holds this unit; only quality assurance releases it (F9, then F3)")
            return self.append(EntryUndone(last.seq))

    def words_of(self, undo: Event) -> str:
        """Return what an event took back, and the step that it belonged to."""
        of = EntryUndone.of(undo).undoes
        event = next(each for each in self._events if each.seq == of)
        match payload_of(event):
            case ValueTaken() as taken:
                words = value_words(taken.input, taken.index, taken.value, taken.unit)
            case RecordLinked() as link:
                words = link.file
            case StepNoted() as note:
                words = f"note '{note.text}'"
            case _:
                words = "measuring again"
        return f"{words} ({self.step(str(event.data['step'])).short})"

    def take_off(self) -> Event:
        """Take back that this unit was begun, as if its serial had not been entered. Raises EntryError if anything was
        done at it, StoreError."""
        with self._mutex:
            done = {event.what for event in self._events if event.seq > self._begun} - {RunOpened.KIND}
            if done or self.attempt.number > 1:
                raise EntryError(f"{self.serial} stays: something was done at it")
            return self.append(EntryUndone(self._begun))

    @property
    def waiting(self) -> list[WorkflowStep]:
        """Return the steps that are not complete."""
        states = {step.name: self.state(step.name) for step in self.steps}
        return open_steps(self.steps, states, self.spec_name, code_sha256())

    @property
    def unjudged(self) -> list[WorkflowStep]:
        """Return the steps that could be judged and were not since their last entry, by this spec and this program."""
        return [s for s in self.steps if ready(s, self.state(s.name)) and self.judgement(s.name) is None]

    def ever_given(self) -> frozenset[tuple[str, str, int | None]]:
        """Return (step, input, index) of every entry of the present attempt, undone or not."""
        given = (payload_of(e, ValueTaken, RecordLinked) for e in self._events if e.seq > self._begun)
        return frozenset(
            (p.step, p.input, p.index if isinstance(p, ValueTaken) else None)
            for p in given
            if isinstance(p, ValueTaken | RecordLinked)
        )

    def before_attempt(self) -> list[Event]:
        """Return the unit's events from before the present attempt."""
        return [e for e in self._events if e.seq < self._begun]

    @property
    def _begun(self) -> int:
        """Return the number of the event that started the present attempt, 0 without one."""
        return max((e.seq for e in self._events if e.what == AttemptStarted.KIND), default=0)

    def last_entry(self) -> Event | None:
        """Return the entry that `undo` would take back."""
        seqs = self.attempt.undoable
        return next((e for e in reversed(self._events) if seqs and e.seq == seqs[-1]), None)

    def judge_step(self, name: str, judge: Judge = judge_here) -> StepJudged:
        """Judge one step by itself and store the judgement. judge: the function that does it, here or in the other
        process. Raises UnitError, StoreError, OSError, and what `judge` does."""
        attempt = self._written()
        asked = self.spec.model_copy(update={"checks": {name: self.step(name).asked}})
        result = judge(self.folder, asked, self._pipeline(asked).statement(unit_folder.read(self.folder)))
        state = state_of(attempt, self.step(name))
        panels = {key.partition("/")[2]: panel for key, panel in result.panels.items()}
        self._panels[name, state.upto] = panels
        if self.step(name).check.model is not None:
            panel_cache.save(self.folder, name, state.upto, panels)
        judged = judgement_of_result(name, result, state, self.spec_name)
        with self._mutex:
            now = self.state(name)  # an entry that came meanwhile may be in the folder: it is judged by itself
            if now.upto == state.upto and judgement_of(now, self.spec_name, code_sha256()) != judged:
                self.append(judged)
        return judged

    @property
    def responses(self) -> StepState | None:
        """Return the step whose records the gap workflow explains; None if the spec asks for none."""
        return self.attempt.step("frf") if "frf" in {step.name for step in self.steps} else None

    @property
    def gap(self) -> Mapping[str, Any] | None:
        """Return the answer of the gap workflow for the present responses, None before it."""
        found, state = self.attempt.gap, self.responses
        return found[1] if found and state and found[0] == state.upto else None

    @property
    def gap_panels(self) -> Mapping[str, Panel]:
        state = self.responses
        return {} if self.gap is None or state is None else panel_cache.load(self.folder, "gap", state.upto)

    def explain(self, explain: Explain) -> Event:
        """Run the gap workflow on the present responses and store its answer. Raises EntryError without responses,
        StoreError, OSError, and what `explain` does."""
        attempt, state = self._written(), self.responses
        if state is None or not state.entries:
            raise EntryError("load the frequency responses first")
        document, drawn = explain(self.folder, self.spec)
        panel_cache.save(self.folder, "gap", attempt.step("frf").upto, drawn)
        return self.append(GapExplained(attempt.step("frf").upto, document))

    def judge(self, judge: Judge = judge_here) -> UnitRecord:
        """Judge the whole unit and store the result. Raises UnitError, StoreError, OSError, BenchStopped if the golden
        units were missed, and what `judge` does."""
        given = self._written().given
        unit, pipeline = unit_folder.read(self.folder), self._pipeline(self.spec)
        found = judge(self.folder, self.spec, pipeline.statement(unit))
        if self.gap is not None:
            found = with_explanation(found, self.gap, self.gap_panels)
        job = UnitJob(unit, self.spec, self.operator, reason=self.attempt.reason or None)
        with self._mutex:
            result = pipeline.settle(job, Judgement(found)).result
            self._catch_up()
            self._result = given, result
        return result

    @property
    def result(self) -> UnitRecord | None:
        """Return the last result of `judge`, None if its inputs have changed since."""
        if self._result is None or self.attempt.verdict is None or self._result[0] != self.attempt.given:
            return None
        return self._result[1]

    @property
    def amends(self) -> str:
        """Return the certificate with another result that one of the present result replaces, "" for none."""
        return amended(self.serial, self.run.state, self.result) if self.result is not None else ""

    def append(self, payload: Payload, after: int | None = None) -> Event:
        """Store an event about this unit. after: number of the last one that it follows from. Raises StoreError, and
        then nothing is stored."""
        with self._mutex:
            event = self.store.write(payload, self.serial, who=self.operator, spec=self.spec_name, after=after)
            self._catch_up()
            return event

    def refresh(self) -> UnitRun:
        """Fold in the events stored since, by this or another program."""
        with self._mutex:
            self._catch_up()
            return self.run

    def _pipeline(self, spec: Spec) -> Pipeline:
        return Pipeline(self.store, {spec.kind: spec}, self.operator, bench_file=self.stated, place=self.home)

    def _catch_up(self) -> None:
        self._events += self.store.events(self.serial, after=self.run.seq)
        self.run = fold_run(self.serial, self._events)

    def _written(self) -> Attempt:
        """Return the present attempt, with `unit.toml` in its folder as the state has it."""
        with self._mutex:
            attempt = self.attempt
            document = section.document(self.serial, attempt, self.steps, attempt.simulated or self.simulates)
            attach.write_document(self.folder, document)
            return attempt


def _is_reserved(finding: Finding) -> bool:
    """Return whether the judgement of the whole unit may have changed a finding; a nonconformance, which holds every
    step, is shown by itself."""
    held = finding.cause is not None and finding.cause.cause is Cause.NONCONFORMANCE
    return finding.verdict is Verdict.NO_RESULT or (finding.verdict is Verdict.CONDITIONAL and not held)


def _about(step: WorkflowStep) -> str:
    """Return the words of a step that the names of its records may hold, its name in a list last."""
    return f"{step.name}\n{step.short}"
