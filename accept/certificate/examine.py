"""A unit judged, explained and drawn: all that its certificate says, before anything is stored or signed."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from accept.gap.start_model import StartModel, applies
from accept.judging.calibration import Statement
from accept.judging.copies import Copy, withheld
from accept.judging.judge_unit import judge_unit
from accept.judging.parts import built_of
from accept.judging.result import UnitResult
from accept.units.loaded_unit import LoadedUnit, contents_of, loaded
from accept.units.unit_folder import UnitFolder
from specs.spec import Spec

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class JudgedUnit:
    """A judged unit on its way into the store. unsigned: its certificate, where one is wanted; its pictures are in
    there, and `result` has them no more."""

    folder: Path
    operator: str
    result: UnitResult
    unsigned: bytes | None = None


def examine(
    unit: UnitFolder,
    spec: Spec,
    operator: str,
    *,
    stated: Statement | None = None,
    start: StartModel | None = None,
    out: Path | None = None,
    copies: Sequence[Copy] = (),
    doubts: Sequence[str] = (),
    provenance: Mapping[str, Any] | None = None,
    say: Say = lambda _: None,
) -> JudgedUnit:
    """Judge a unit, explain its responses from the model `start` (improved models go below `out`), draw its
    certificate where there is a `provenance` to state beside the result. copies: what of its records stands elsewhere
    too; doubts: what speaks against its parts; where that is known. Plain data goes in and comes back, so that another
    process can do it.

    Raises UnitError, ContentError."""
    held = loaded(unit)
    result = built_of(withheld(judge_unit(held, spec, stated), copies), doubts)
    if start is not None and applies(unit):
        from accept.gap.attach_to_result import explained  # loads the search for what is missing

        result = explained(result, held, start, say, out)
    if provenance is None:
        return JudgedUnit(unit.path, operator, replace(result, panels={}))
    return drawn(result, spec, held, operator, provenance)


def drawn(
    result: UnitResult, spec: Spec, unit: Path | LoadedUnit, operator: str, provenance: Mapping[str, Any]
) -> JudgedUnit:
    """A unit that was judged, with its certificate drawn. Raises ContentError when an input is gone or was changed."""
    from accept.certificate.contents.content import content_of
    from accept.certificate.page.document import render  # loads reportlab: only when wanted

    folder = unit.folder.path if isinstance(unit, LoadedUnit) else unit
    contents = content_of(result, spec, folder, operator, held=contents_of(unit), provenance=provenance)
    return JudgedUnit(folder, operator, replace(result, panels={}), render(contents))
