"""Judging and explaining a unit's folder: here, or in another process, where it can be stopped."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from accept.base.documents.results import UnitRecord
from accept.base.version import code_sha256
from accept.gap import analyse_unit
from accept.gap.attach_to_result import NO_ANSWER
from accept.gap.start_model import StartModel
from accept.judging import judge_unit
from accept.judging.calibration import Statement
from accept.models.model_file import default_model
from accept.store.payloads import StepJudged
from accept.units import unit_folder
from accept.units.unit_folder import UnitError
from accept.workflow.state.unit_state import StepState
from accept.workflow.steps.section import note_lines
from accept.workflow.worker.process import Say, Work, WorkerProcess
from checks.errors import ModelError, RecordError
from checks.gap import gap_panels
from checks.picture import Panel
from specs.spec import Spec
from specs.strict import SpecError

T = TypeVar("T")
Judge = Callable[[Path, Spec, Statement | None], UnitRecord]
Explanation = tuple[Mapping[str, Any], Mapping[str, Panel]]  # the key `gap` of a result ([DESIGN] 6), all its pictures
Explain = Callable[[Path, Spec], Explanation]
EXPECTED = (UnitError, RecordError, SpecError, ModelError, OSError)


def judge_here(folder: Path, spec: Spec, stated: Statement | None) -> UnitRecord:
    """Judge the unit in a folder in this process. Raises UnitError."""
    return judge_unit.judge_unit(unit_folder.read(folder), spec, stated)


class Elsewhere:
    """Judges and explains in the other process, one thing; `cancel` stops it. say: is called, from the thread that
    waits, with the computation's progress."""

    def __init__(self, worker: WorkerProcess, say: Say = lambda _: None) -> None:
        self._worker, self._say = worker, say
        self._work: Work[Any] | None = None

    def judge(self, folder: Path, spec: Spec, stated: Statement | None) -> UnitRecord:
        """Judge as `judge_here` does. Raises NotDone."""
        return self._run(Work(_judge, folder, spec, stated, expected=EXPECTED))

    def explain(self, folder: Path, spec: Spec) -> Explanation:
        """Return the gap workflow from the spec's model. Raises NotDone."""
        return self._run(Work(_explain, folder, spec, expected=EXPECTED))

    def cancel(self) -> None:
        if self._work is not None:
            self._worker.cancel(self._work)

    def _run(self, work: Work[T]) -> T:
        self._work = work
        return self._worker.run(work, self._say)


def _judge(_: Say, folder: Path, spec: Spec, stated: Statement | None) -> UnitRecord:
    return judge_here(folder, spec, stated)


def _explain(say: Say, folder: Path, spec: Spec) -> Explanation:
    """Return the answer of the gap workflow, or why it gives none; writes gap.json, gap.pdf and model.toml below the
    folder."""
    name = spec.gap.model if spec.gap else default_model(spec.kind)
    start = StartModel.at(name)
    try:
        done = analyse_unit.analyse(folder, name, say=say)
    except NO_ANSWER as e:
        return start.refused(str(e)), {}
    say("writing")
    analyse_unit.write(done, folder / "gap")
    return start.answer(done.document), gap_panels(done.result)


def judgement_of_result(name: str, result: UnitRecord, state: StepState, spec_name: str) -> StepJudged:
    """Return the judgement of a step to be stored; the technician's own notes are stored already."""
    own = {f"{name}: {line}" for line in note_lines(state)}
    notes = tuple(note.removeprefix(f"{name}: ") for note in result.notes if note not in own)
    return StepJudged(name, state.upto, result.findings, result.information, notes, spec_name, code_sha256())
