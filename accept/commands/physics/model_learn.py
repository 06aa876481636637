"""`accept model learn`: a model file learned from a batch of units."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from accept.base.atomic_files import check_places, write_atomic
from accept.base.console import clear_errors, say, tell
from accept.base.exit_codes import Exit
from accept.base.progress import busy
from accept.commands.options import StartModelName
from accept.fleet.population.learn import learn_population, measured_units
from accept.fleet.population.report import document, lines, render, write_population
from accept.gap.analyse_unit import run_gap
from accept.models.model_file import DEFAULT_MODEL, opened
from accept.units.unit_folder import read

MODEL, REPORT, DATA = "population.toml", "population.pdf", "population.json"


@clear_errors
def run(
    units: Annotated[list[Path], typer.Argument(help="Unit folders of one batch, three or more.")],
    out: Annotated[Path, typer.Option(help="Folder for population.toml, population.pdf and population.json.")],
    model: StartModelName = None,
) -> Exit:
    """Learn a model from a batch. Its mean, its scatter, and which units do not belong."""
    places = [out / name for name in (MODEL, REPORT, DATA)]
    check_places(*places)  # said before the fits, not after
    kind = read(units[0]).kind
    name = model or DEFAULT_MODEL[kind]
    given = opened(name)

    def ask(i: int) -> Mapping[str, Any]:
        return run_gap(units[i], name)

    with busy("learning the batch"):
        found = learn_population(measured_units(units, given), given, say, ask)
    write_population(places[0], found)
    write_atomic(places[1], render(found))
    write_atomic(places[2], json.dumps(document(found), indent=1, allow_nan=False).encode() + b"\n")
    tell(*lines(found))
    for place in places:
        say(f"{place}: written")
    return Exit.ACCEPTED if found.holds else Exit.INCOMPLETE
