"""`accept misalign`: estimate where the APA sits between its joints, with its uncertainty, or the cause without one."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept.analysis.imported_response import ImportedResponse, import_response
from accept.analysis.misalignment import as_document, estimate_or_reason
from accept.base.exit_codes import Exit
from accept.base.progress import busy
from accept.commands.answer import Answer, File, Remark, command, picture
from accept.commands.options import JsonAnswer, Plot
from accept.gap import data_words
from accept.units import UNIT_FILE, UnitError, UnitFolder, read
from checks.cause import Reason
from checks.misalignment import MisalignmentEstimate, misalignment_panels
from checks.rounding import fixed
from specs.plugins import product_named


@command
def run(
    unit: Annotated[Path, Argument(help="Folder of a strut with a section [frf], or a file of its responses.")],
    model: Annotated[str | None, Option("--model", help="Built-in model or file; else strut-as-built.")] = None,
    json: JsonAnswer = None,
    plot: Plot = None,
) -> Answer:
    """Measure how far a strut's APA lies off its axis. dx, dy with U, or why there is no result."""
    given, serial = _unit_or_response(unit)
    with busy(f"{serial}: misalignment"):
        found = estimate_or_reason(given, model)
    document = as_document(serial, found)
    notes, drawn = "", None
    if isinstance(found, MisalignmentEstimate):
        drawn = picture(plot, lambda: list(misalignment_panels(found).values()), 1, announced=True)
        if found.reason is None:
            notes = "\n".join([f"dx, dy: {found.meaning}", f"fitted to {data_words(found.fit)}", *found.notes])
    return Answer(
        File(json, document),
        drawn,
        *words(serial, found),
        Remark(notes),
        exit=Exit.ACCEPTED if document.reason is None else Exit.INCOMPLETE,
    )


def _unit_or_response(path: Path) -> tuple[UnitFolder | ImportedResponse, str]:
    """Return a unit, or the response of a file, with its name. Raises UnitError for an APA, RecordError."""
    if path.is_file() and path.name != UNIT_FILE:
        response = import_response(path)
        return response, response.title
    folder = read(path)
    if product_named(folder.kind).family != "strut":
        raise UnitError(path / UNIT_FILE, [f"kind = '{folder.kind}': only a strut has joints to be misaligned from"])
    return folder, folder.serial


def words(serial: str, found: MisalignmentEstimate | Reason) -> list[str]:
    """Return a few lines for a person."""
    if isinstance(found, Reason) or found.reason is not None:
        return [f"{serial}: no result: {found if isinstance(found, Reason) else found.reason}"]
    return [
        f"{serial}: {axis}: no result: {found.unknown[axis]}"
        if (along := found.answer(axis)) is None
        else f"{serial}: {axis} = {fixed(along.value, 1)} ± {along.U:.1f} um"
        for axis in ("dx", "dy")
    ]
