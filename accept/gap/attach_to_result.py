"""The gap workflow as part of judging a unit: what its responses show beyond the model. It changes no finding; what
failed because of a payload that it names is withheld by `accept.judging.without_bench_errors`."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from accept.base.documents.analyses import GAP_PICTURES, on_certificate
from accept.base.documents.results import UnitRecord
from accept.base.fault_log import PLEASE_REPORT, log_fault
from accept.gap import analyse_unit
from accept.gap.improved_model import write_improved
from accept.gap.start_model import StartModel
from accept.units import LoadedUnit, UnitError
from checks.errors import ModelError, RecordError
from checks.gap import GapRefused, gap_panels
from checks.picture import Panel
from specs.strict import SpecError

Say = Callable[[str], None]
MODELS = "models"  # folder of improved models, in that of the results
NO_ANSWER = (GapRefused, ModelError, RecordError, SpecError, UnitError, OSError)


def explain_result(result: UnitRecord, unit: LoadedUnit, start: StartModel, say: Say, out: Path | None) -> UnitRecord:
    """Return the result with its key `gap`: gap.json with the start model, or the reason why there is no analysis. out:
    folder of the results; the improved model goes there."""
    try:
        done = _analyse(unit, start, say)
        improved = _write_improved(done, out)
    except NO_ANSWER as e:
        return replace(result, gap=start.refused(str(e)))
    document = start.answer(done.document) | {"improved": improved}
    return with_explanation(result, document, gap_panels(done.result) if on_certificate(document) else {})


def explain_folder(folder: Path, name: str, say: Say) -> tuple[dict[str, Any], Mapping[str, Panel]]:
    """Return the key `gap` of the unit in a folder and the pictures of the answer, or the reason of a refusal; write
    gap.json, gap.pdf and model.toml below the folder. name: of the start model. Raises OSError."""
    start = StartModel.at(name)
    try:
        done = analyse_unit.analyse(folder, name, say=say)
    except NO_ANSWER as e:
        return start.refused(str(e)), {}
    say("writing")
    analyse_unit.write(done, folder / "gap")
    return start.answer(done.document), gap_panels(done.result)


def with_explanation(result: UnitRecord, document: Mapping[str, Any], drawn: Mapping[str, Panel]) -> UnitRecord:
    """Return the result with the missing effects, and those of its pictures that a certificate shows."""
    shown = {f"{GAP_PICTURES}{name}": drawn[name] for name in on_certificate(document) if name in drawn}
    return replace(result, gap=document, panels={**result.panels, **shown})


def _write_improved(done: analyse_unit.GapAnalysis, out: Path | None) -> str | None:
    """Write the improved model if a cause was found and return its name within `out`. Raises OSError."""
    if out is None or not done.result.found:
        return None
    name = f"{MODELS}/{done.measured.serial}.toml"
    write_improved(out / name, done.model, done.measured, done.result)
    return name


def _analyse(unit: LoadedUnit, start: StartModel, say: Say) -> analyse_unit.GapAnalysis:
    """Run the workflow. Raises one of NO_ANSWER, also for its own errors, so that the unit is still judged."""
    try:
        return analyse_unit.analyse(unit, start.model, say=say)
    except NO_ANSWER:
        raise
    except Exception as e:
        log_fault(f"{unit.folder.serial}: gap analysis", e)
        raise GapRefused(f"the workflow stopped on an internal error ({type(e).__name__}: {e}); {PLEASE_REPORT}") from e
