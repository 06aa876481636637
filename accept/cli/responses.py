"""The command lines that take responses: `accept frf`, `compare`, `gap`, `misalign` and `lookup`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.cli.options import spread
from accept.commands.options import ClusterAt, Json, ModelName, Plot, SpecName, StartModelName
from accept.commands.physics.frf_options import ResponseFiles, ResponseOptions

lookup_app = typer.Typer(help="Precomputed tables of the misalignment.", no_args_is_help=True)

Workers = Annotated[int | None, typer.Option(min=1, help="Processes; without it as many as there are cores.")]


@spread
def frf(
    records: Annotated[list[Path], typer.Argument(help="Record files (.mat, .csv, .txt, .uff, .tdms).")],
    wanted: ResponseOptions,
    files: ResponseFiles,
) -> None:
    """Compute frequency responses of records. With coherence, variance and the largest resonance."""
    from accept.commands.physics import frf as command

    raise typer.Exit(command.run(records, wanted, files))


def compare(
    units: Annotated[list[Path], typer.Argument(help="Unit folders, or parents of unit folders.")],
    spec: SpecName = None,
    json: Json = None,
    plot: Plot = None,
) -> None:
    """Compare units and find which stand out. Robust scores of quantities and curves, overlays of curves."""
    from accept.commands.units import compare as command

    raise typer.Exit(command.run(units, spec, json, plot))


def gap(
    units: Annotated[
        list[Path], typer.Argument(help="Unit folders with a section [frf], or folders that contain them.")
    ],
    out: Annotated[Path, typer.Option(help="Folder for gap.json, gap.pdf and model.toml.")],
    model: StartModelName = None,
    fleet: Annotated[bool, typer.Option("--fleet", help="Say which effects all units have in common.")] = False,
    without: Annotated[list[str] | None, typer.Option("--without", help="Leave an effect out of the library.")] = None,
    empirical: Annotated[bool, typer.Option("--empirical", help="Add unidentified effects to the model.")] = False,
    html: Annotated[bool, typer.Option("--html", help="Also write gap.html, plots to zoom in.")] = False,
    cluster: ClusterAt = None,
) -> None:
    """Name what is missing from the model. Where simulation and data disagree, and how the gap shrinks."""
    from accept.commands.physics import gap as command

    raise typer.Exit(command.run(units, model, out, fleet, without or [], cluster, empirical, html))


@lookup_app.command()
def build(
    model: ModelName = "strut-as-built",
    nx: Annotated[int, typer.Option(min=3, max=999, help="Places along dx.")] = 41,
    ny: Annotated[int, typer.Option(min=3, max=999, help="Places along dy.")] = 41,
    workers: Workers = None,
    cluster: ClusterAt = None,
    force: Annotated[bool, typer.Option("--force", help="Build it even if it is there.")] = False,
) -> None:
    """Tabulate the ratio de / da over dx, dy. Goes on where an earlier build was stopped."""
    from accept.commands.physics import lookup as command

    raise typer.Exit(command.run_build(model, nx, ny, workers, force, cluster))


@lookup_app.command()
def info(
    model: Annotated[str | None, typer.Option("--model", help="Say which table is this model's.")] = None,
) -> None:
    """Show the tables that are there, and whether they are whole."""
    from accept.commands.physics import lookup as command

    raise typer.Exit(command.run_info(model))


def misalign(
    unit: Annotated[Path, typer.Argument(help="Folder of a strut with a section [frf].")],
    model: Annotated[str | None, typer.Option("--model", help="Built-in model or file; else strut-as-built.")] = None,
    json: Json = None,
    plot: Plot = None,
) -> None:
    """Measure how far a strut's APA lies off its axis. dx, dy with U, or why there is no result."""
    from accept.commands.physics import misalign as command

    raise typer.Exit(command.run(unit, model, json, plot))
