"""The gap workflow as part of judging a unit: what its responses show beyond the model. It never touches a verdict."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from accept.base.fault_log import PLEASE_REPORT, log_fault
from accept.gap import analyse_unit
from accept.gap.improved_model import write_improved
from accept.gap.text import REFUSED
from accept.judging.result import GAP_PICTURES, UnitResult
from accept.models.model_file import open_model
from accept.units.loaded_unit import LoadedUnit
from accept.units.unit_folder import UnitError, UnitFolder
from checks.errors import ModelError, RecordError
from checks.gap.decision.panels import panels
from checks.gap.decision.result import NO_MISSING
from checks.gap.workflow import GapRefused
from specs.spec import Spec
from specs.strict import SpecError

Say = Callable[[str], None]
MODELS = "models"  # folder of improved models, in that of the results
NO_ANSWER = (GapRefused, ModelError, RecordError, SpecError, UnitError, OSError)


@dataclass(frozen=True)
class StartModel:
    """The model that the workflow starts from, by name or file, with its hash; None where it cannot be opened."""

    model: str
    sha256: str | None

    @classmethod
    def of(cls, spec: Spec, model: str | None = None) -> "StartModel | None":
        """The one named, else the spec's; None where neither names one: then no workflow is run."""
        name = model or (spec.gap.model if spec.gap else None)
        return None if name is None else cls.at(name)

    @classmethod
    def at(cls, name: str) -> "StartModel":
        return cls(name, _sha256(name))

    def answer(self, found: Mapping[str, Any]) -> dict[str, Any]:
        """The key `gap` of a result: gap.json without the serial, and the model it began from."""
        return {key: value for key, value in found.items() if key != "serial"} | self._about | {"reason": None}

    def refused(self, reason: str) -> dict[str, Any]:
        """The same where the workflow gave no answer."""
        return self._about | {"verdict": REFUSED, "reason": reason}

    @property
    def _about(self) -> dict[str, Any]:
        return {"start": self.model, "model_sha256": self.sha256}


def same_start(known: Mapping[str, Any] | None, start: StartModel | None) -> bool:
    """Whether a stored explanation began where one would begin now, from a model that is still the same."""
    if known is None or start is None:
        return known is None and start is None
    return (known.get("start"), known.get("model_sha256")) == (start.model, start.sha256)


def applies(folder: UnitFolder) -> bool:
    """Whether there are responses to explain."""
    section = folder.sections.get("frf")
    return section is not None and bool(section.entries)


def explained(
    result: UnitResult,
    unit: LoadedUnit,
    start: StartModel | None,
    say: Say = lambda _: None,
    out: Path | None = None,
) -> UnitResult:
    """The result with its key `gap`: gap.json, with the model it began from, or why there is none. The result as it is
    where no model is named or no responses were measured. out: folder of the results; the improved model goes there."""
    if start is None or not applies(unit.folder):
        return result
    try:
        done = _analysed(unit, start, say)
        improved = _improved(done, out)
    except NO_ANSWER as e:
        return replace(result, gap=start.refused(str(e)))
    document = start.answer(done.document) | {"improved": improved}
    names = on_certificate(document)
    drawn = panels(done.result) if names else {}
    shown = {f"{GAP_PICTURES}{name}": drawn[name] for name in names}
    return replace(result, gap=document, panels={**dict(result.panels), **shown})


def on_certificate(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the pictures that have a place on a certificate: magnitude and residual, before and after, of the
    channel that fitted worst; none where nothing is missing or nothing was found."""
    channels = {c: G for c, G in document.get("gap_before", {}).get("channels", {}).items() if G is not None}
    if not channels or document["verdict"] == NO_MISSING:
        return ()
    worst = max(channels, key=lambda name: channels[name])
    return f"{worst} magnitude", f"{worst} residual"


def is_there(known: Mapping[str, Any] | None, out: Path) -> bool:
    """Whether the improved model that a stored explanation speaks of lies where it says."""
    improved = (known or {}).get("improved")
    return improved is None or (out / str(improved)).is_file()


def _improved(done: analyse_unit.GapAnalysis, out: Path | None) -> str | None:
    """Name of the improved model within `out`, written there where something was named. Raises OSError."""
    if out is None or not done.result.named:
        return None
    name = f"{MODELS}/{done.measured.serial}.toml"
    write_improved(out / name, done.model, done.measured, done.result)
    return name


def _analysed(unit: LoadedUnit, start: StartModel, say: Say) -> analyse_unit.GapAnalysis:
    """Raises NO_ANSWER, into which an error of the workflow itself is turned: the unit is judged all the same."""
    try:
        return analyse_unit.analyse(unit, start.model, say=say)
    except NO_ANSWER:
        raise
    except Exception as e:
        log_fault(f"{unit.folder.serial}: gap analysis", e)
        raise GapRefused(f"the workflow stopped on an internal error ({type(e).__name__}: {e}); {PLEASE_REPORT}") from e


def _sha256(model: str) -> str | None:
    try:
        return open_model(model).sha256
    except (SpecError, ModelError, OSError):
        return None
