"""Judging and explaining a unit's folder: here, or in another process, where it can be stopped."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

from accept import units
from accept.base.documents.results import UnitRecord, is_typed_note
from accept.base.version import code_sha256
from accept.batch.job import UnitJob
from accept.batch.pipeline import Pipeline
from accept.batch.ports import Judgement
from accept.batch.services import JudgingServices
from accept.gap import explain_folder, with_explanation
from accept.judging import Statement, judge_unit, without_bench_errors
from accept.models.model_file import default_model
from accept.store import Event
from accept.store.payloads import StepJudged
from accept.units import UnitError
from accept.workflow.session import Session
from accept.workflow.session.gap import Explanation
from accept.workflow.state.unit_state import StepState
from accept.workflow.steps.status import state_of
from accept.workflow.worker.process import Say, Work, WorkerProcess
from checks.errors import ModelError, RecordError
from specs.spec import Spec
from specs.strict import SpecError

T = TypeVar("T")
Judge = Callable[[Path, Spec, Statement | None], UnitRecord]
EXPECTED = (UnitError, RecordError, SpecError, ModelError, OSError)


def judge_here(folder: Path, spec: Spec, stated: Statement | None) -> UnitRecord:
    """Judge the unit in a folder in this process. Raises UnitError."""
    return judge_unit(units.read(folder), spec, stated)


class Elsewhere:
    """Judges and explains one unit in the other process, one thing; `cancel` stops it. say: is called, from the thread
    that waits, with the computation's progress."""

    def __init__(self, worker: WorkerProcess, session: Session, say: Say = lambda _: None) -> None:
        self._worker, self._session, self._say = worker, session, say
        self._work: Work[Any] | None = None
        self._stopped = False

    def judge_step(self, name: str) -> StepJudged:
        return judge_step(self._session, name, partial(self._run, _judge))

    def judge(self) -> UnitRecord:
        return judge_whole_unit(self._session, partial(self._run, _judge))

    def explain(self) -> Event:
        return self._session.gap.explain(partial(self._run, _explain))

    def cancel(self) -> None:
        self._stopped = True  # before there is work too: the folder is written first, and others may have their turn
        if self._work is not None:
            self._worker.cancel(self._work)

    def _run(self, work: Callable[..., T], *given: Any) -> T:
        """Return what a function of this module gives there. Raises NotDone."""
        self._work = Work(work, *given, expected=EXPECTED)
        if self._stopped:
            self.cancel()
        return cast(T, self._worker.run(self._work, self._say))


def judge_step(session: Session, name: str, judge: Judge = judge_here) -> StepJudged:
    """Judge one step by itself and store the judgement. judge: the function that does it, here or in the other
    process. Raises UnitError, EntryError, StoreError, OSError, and what `judge` does."""
    step, attempt = session.step(name), session.written()
    asked = session.spec.model_copy(update={"checks": {name: step.asked}})
    result = judge(session.folder, asked, _pipeline(session, asked).statement(units.read(session.folder)))
    session.vet(attempt, result.inputs)
    judged = judgement_of_result(name, result, state_of(attempt, step), session.spec_name)
    panels = {key.partition("/")[2]: panel for key, panel in result.panels.items()}
    session.judgements.keep_step(judged, step, panels)
    return judged


def judge_whole_unit(session: Session, judge: Judge = judge_here) -> UnitRecord:
    """Judge the whole unit and store the result; of a unit that is certified as of the day of its judgement, so that
    what stands is no other attempt. Raises as `judge_step`, and BenchStopped if the golden units were missed."""
    attempt = session.written()
    unit, pipeline = units.read(session.folder), _pipeline(session, session.spec)
    certified = attempt.judged if attempt.certificate is not None else None
    stated = pipeline.statement(unit) if certified is None else pipeline.statement_of(unit, certified.result)
    found = judge(session.folder, session.spec, stated)
    session.vet(attempt, found.inputs)
    if session.gap.found is not None:
        found = without_bench_errors(with_explanation(found, session.gap.found, session.gap.panels))
    job = UnitJob(unit, session.spec, session.operator, reason=session.attempt.reason or None)
    with session.mutex:
        result = pipeline.settle(job, Judgement(found)).result
        session.refresh()
        session.judgements.keep(attempt.given, result)
    return result


def _pipeline(session: Session, spec: Spec) -> Pipeline:
    services = JudgingServices(session.store, session.operator, place=session.home)
    specs = {spec.kind: spec}
    return Pipeline(session.store, specs, session.operator, services, bench_file=session.stated, place=session.home)


def _judge(_: Say, folder: Path, spec: Spec, stated: Statement | None) -> UnitRecord:
    return judge_here(folder, spec, stated)


def _explain(say: Say, folder: Path, spec: Spec) -> Explanation:
    return explain_folder(folder, spec.gap.model if spec.gap else default_model(spec.kind), say)


def judgement_of_result(name: str, result: UnitRecord, state: StepState, spec_name: str) -> StepJudged:
    """Return the judgement of a step to be stored; the technician's own notes are stored already."""
    notes = tuple(note.removeprefix(f"{name}: ") for note in result.notes if not is_typed_note(note))
    return StepJudged(name, state.upto, result.findings, result.information, notes, spec_name, code_sha256())
