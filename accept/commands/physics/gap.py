"""`accept gap`: compare data with a model, name the missing effects, and show the gap before and after."""

import json
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from accept.base.cluster.connect import connected
from accept.base.console import say, tell
from accept.base.exit_codes import Exit
from accept.base.progress import steps
from accept.base.runner import GivenUp
from accept.batch.executors import run_jobs
from accept.commands.answer import Answer, File, command
from accept.commands.options import ClusterAt, StartModelName
from accept.gap import GapJob, are_settled, common, lines
from accept.models.model_file import default_model
from accept.pictures.formats import PictureError
from accept.pictures.interactive import MISSING
from accept.units import UNIT_FILE, UnitError, UnitFolder, find, read
from checks.errors import RecordError
from checks.gap import effect_named

FILE_TOO_LITTLE = (
    "is a file; the gap analysis compares with a second realisation that was not fitted and asks the records "
    "themselves, so it needs a unit folder. `accept model fit` and `accept misalign` take a file of responses"
)


@command
def run(
    units: Annotated[list[Path], Argument(help="Unit folders with a section [frf], or folders that contain them.")],
    out: Annotated[Path, Option(help="Folder for gap.json, gap.pdf and model.toml.")],
    model: StartModelName = None,
    fleet: Annotated[bool, Option("--fleet", help="Say which effects all units have in common.")] = False,
    without: Annotated[list[str] | None, Option("--without", help="Leave an effect out of the library.")] = None,
    empirical: Annotated[bool, Option("--empirical", help="Add unidentified effects to the model.")] = False,
    html: Annotated[bool, Option("--html", help="Also write gap.html, plots to zoom in.")] = False,
    cluster: ClusterAt = None,
) -> Answer:
    """Name what is missing from the model. Where simulation and data disagree, and how the gap shrinks."""
    left_out = without or []
    for name in left_out:
        effect_named(name)  # raises ModelError
    if html and find_spec("plotly") is None:
        raise PictureError(MISSING)
    folders = _units(units)
    out.mkdir(parents=True, exist_ok=True)  # a folder that cannot be written is said before the search, not after
    places = [out / u.serial for u in folders] if len(folders) > 1 else [out]
    jobs = [
        GapJob(u, place, model or default_model(u.kind), tuple(left_out), empirical, html)
        for u, place in zip(folders, places, strict=True)
    ]
    found: dict[str, Mapping[str, Any] | None] = {}
    with connected(cluster, say) as workers:
        for job, given in steps(run_jobs(jobs, 1, cluster=workers), "gap analysis", len(jobs)):
            found[job.unit.serial] = _print_answer(job.unit.serial, given, job.out, html)
    done = [document for one in folders if (document := found[one.serial]) is not None]
    if not done:
        return Answer(exit=Exit.BAD_INPUT)
    exit = Exit.ACCEPTED if are_settled(found.values()) else Exit.INCOMPLETE
    if not fleet:
        return Answer(exit=exit)
    shared = common(done)
    content = json.dumps(shared, indent=1, allow_nan=False).encode()
    return Answer(*lines(shared), File(out / "fleet.json", content, announced=True), exit=exit)


def _units(paths: Sequence[Path]) -> list[UnitFolder]:
    """Return the units at or below the paths. Raises UnitError, also if two units have the same serial."""
    for path in paths:
        if path.is_file() and path.name != UNIT_FILE:
            raise RecordError(f"{path}: {FILE_TOO_LITTLE}")
    units = {folder.resolve(): read(folder) for path in paths for folder in find(path)}
    by_serial: dict[str, Path] = {}
    for unit in units.values():
        if unit.serial in by_serial:
            also = f"serial = '{unit.serial}' is also that of {by_serial[unit.serial]}; serials must be unique"
            raise UnitError(unit.path / UNIT_FILE, [also])
        by_serial[unit.serial] = unit.path
    return list(units.values())


def _print_answer(serial: str, given: Any, place: Path, html: bool) -> Mapping[str, Any] | None:
    """Print the answer of a job, or why the unit was refused, and return gap.json, None if it was refused."""
    if isinstance(given, str | GivenUp):
        words = str(given)
        say(f"accept: {words if words.startswith(f'{serial}:') else f'{serial}: {words}'}")
        return None
    tell(*given.words)
    say(f"{place}: {'gap.html, ' if html else ''}gap.json, gap.pdf, model.toml written")
    document: Mapping[str, Any] = given.document
    return document
