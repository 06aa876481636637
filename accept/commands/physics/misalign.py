"""`accept misalign`: where the APA sits between its joints, with its uncertainty, or why that cannot be said."""

from json import dumps
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from accept.base.atomic_files import check_places, write_atomic
from accept.base.console import clear_errors, say, tell
from accept.base.exit_codes import Exit
from accept.base.progress import busy
from accept.commands.options import Json, Plot
from accept.commands.physics.model import draw_to
from accept.gap.responses import Responses, responses
from accept.models.lookup_cache import table_for
from accept.models.model_file import AS_BUILT, Opened, as_weighed, opened
from accept.pictures.formats import format_of
from accept.units.unit_folder import UNIT_FILE, UnitError, UnitFolder, read
from checks.cause import NoResult, Reason
from checks.errors import RecordError
from checks.misalignment.estimate import RATIO, WITH_SENSOR, estimate
from checks.misalignment.estimate_types import Along, MisalignmentEstimate
from checks.misalignment.panels import panels
from checks.misalignment.table import MisalignmentTable
from checks.verdict import Verdict


@clear_errors
def run(
    unit: Annotated[Path, typer.Argument(help="Folder of a strut with a section [frf].")],
    model: Annotated[str | None, typer.Option("--model", help="Built-in model or file; else strut-as-built.")] = None,
    json: Json = None,
    plot: Plot = None,
) -> Exit:
    """Measure how far a strut's APA lies off its axis. dx, dy with U, or why there is no result."""
    check_places(json, plot)  # said before the search, not after
    if plot is not None:
        format_of(plot)
    folder = read(unit)
    if folder.kind != "strut":
        raise UnitError(unit / UNIT_FILE, [f"kind = '{folder.kind}': only a strut has joints to be misaligned from"])
    with busy(f"{folder.serial}: misalignment"):
        found = _found(folder, model)
    document = as_document(folder.serial, found)
    if json is not None:
        write_atomic(json, dumps(document, indent=1, allow_nan=False).encode() + b"\n")
    if plot is not None and isinstance(found, MisalignmentEstimate):
        draw_to(plot, list(panels(found).values()), 1)
    tell(*words(folder.serial, found))
    if isinstance(found, MisalignmentEstimate) and found.reason is None:
        say(f"dx, dy: {found.meaning}")
    return Exit.ACCEPTED if document["reason"] is None else Exit.INCOMPLETE


def estimate_unit(folder: UnitFolder, model: str | None = None) -> MisalignmentEstimate:
    """The estimate of a strut, in this process alone: a caller's script that starts others would be run by each of them
    again. Raises NoResult where the data cannot tell, UnitError, RecordError, ModelError."""
    found = _found(folder, model, workers=1)
    reason = found if isinstance(found, Reason) else found.reason
    if reason is not None:
        raise NoResult(reason)
    return cast(MisalignmentEstimate, found)


def _found(folder: UnitFolder, model: str | None, workers: int | None = None) -> MisalignmentEstimate | Reason:
    given = opened(model or AS_BUILT)
    table = table_for(given.model, say, workers=workers)
    return _estimate(given, _measured(folder), table)


def _measured(unit: UnitFolder) -> Responses:
    """With the sensor stack, which helps, where it was recorded."""
    try:
        return responses(unit, channels=WITH_SENSOR)
    except RecordError:
        return responses(unit, channels=RATIO)


def _estimate(given: Opened, measured: Responses, table: MisalignmentTable) -> MisalignmentEstimate | Reason:
    """The estimate, or why the data cannot tell."""
    model = as_weighed(given, measured.serial, measured.payload_kg).model
    try:
        return estimate(model, measured.first, table, measured.second)
    except NoResult as e:
        return e.reason


def as_document(serial: str, found: MisalignmentEstimate | Reason) -> dict[str, Any]:
    """The JSON of the design. Without a result no number stands where a script would read it."""
    reason = found if isinstance(found, Reason) else found.reason

    def of(along: Along | None) -> dict[str, float | None]:
        return {"value": None, "U": None} if along is None else {"value": along.value, "U": along.U}

    dx, dy = (None, None) if isinstance(found, Reason) or reason is not None else (found.dx, found.dy)
    verdict = Verdict.PASS if reason is None else Verdict.NO_RESULT
    words = None if reason is None else str(reason)
    return {"serial": serial, "dx_um": of(dx), "dy_um": of(dy), "verdict": verdict.value, "reason": words}


def words(serial: str, found: MisalignmentEstimate | Reason) -> list[str]:
    """A few lines for a person."""
    reason = found if isinstance(found, Reason) else found.reason
    if isinstance(found, Reason) or reason is not None:
        return [f"{serial}: no result: {reason}"]
    along = {"dx": found.dx, "dy": found.dy}
    return [f"{serial}: {axis} = {one.value:.1f} ± {one.U:.1f} um" for axis, one in along.items()]
