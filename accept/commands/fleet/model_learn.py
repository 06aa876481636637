"""`accept model learn`: a model file learned from a batch of units."""

from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept.base.atomic_files import check_places
from accept.base.console import say
from accept.base.exit_codes import Exit
from accept.base.progress import busy
from accept.commands.answer import Answer, File, Remark, command, refusal
from accept.commands.options import StartModelName
from accept.fleet.population.bench import changes_since
from accept.fleet.population.learn import learn, measured_units
from accept.fleet.population.report import document, lines, render, write_population
from accept.models.model_file import default_model, open_model_file
from accept.units import read
from checks.population import NothingLearned
from specs.model import load_model
from specs.strict import SpecError

MODEL, REPORT, DATA = "population.toml", "population.pdf", "population.json"


@command
def run(
    units: Annotated[list[Path], Argument(help="Unit folders of one batch, three or more.")],
    out: Annotated[Path, Option(help="Folder for population.toml, population.pdf and population.json.")],
    model: StartModelName = None,
) -> Answer:
    """Learn a model from a batch. Its mean, its scatter, what its bench adds, and which units do not belong."""
    places = [out / name for name in (MODEL, REPORT, DATA)]
    check_places(*places)  # said before the fits, not after
    given = open_model_file(model or default_model(read(units[0]).kind))
    earlier = None
    with suppress(SpecError, OSError):  # what an earlier run wrote there may be no model any more
        earlier = load_model(places[0]) if places[0].exists() else None
    try:
        with busy("learning bench and batch"):
            found = learn(measured_units(units, given), given, say)
    except NothingLearned as e:
        return refusal(e, Exit.INCOMPLETE)
    today = datetime.now(UTC).date().isoformat()
    changed = [] if earlier is None else changes_since(earlier, found)
    write_population(places[0], found, today)
    return Answer(
        *lines(found, changed),
        Remark(f"{places[0]}: written"),
        File(places[1], render(found, changed), announced=True),
        File(places[2], document(found, today, changed), announced=True),
        exit=Exit.ACCEPTED if found.holds else Exit.INCOMPLETE,
    )
