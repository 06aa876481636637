"""`accept lookup` and `accept misalign`: thin."""

from pathlib import Path
from typing import Annotated

import typer

from accept.commands.options import Json, ModelName, Plot

app = typer.Typer(help="Precomputed tables of the misalignment.", no_args_is_help=True)

Workers = Annotated[int | None, typer.Option(min=1, help="Processes; without it as many as there are cores.")]


@app.command()
def build(
    model: ModelName = "strut",
    nx: Annotated[int, typer.Option(min=3, max=999, help="Places along dx.")] = 41,
    ny: Annotated[int, typer.Option(min=3, max=999, help="Places along dy.")] = 41,
    workers: Workers = None,
    force: Annotated[bool, typer.Option("--force", help="Build it even if it is there.")] = False,
) -> None:
    """Tabulate the ratio de / da over dx, dy. Goes on where an earlier build was stopped."""
    from accept.commands.physics import lookup as command

    raise typer.Exit(command.run_build(model, nx, ny, workers, force))


@app.command()
def info(
    model: Annotated[str | None, typer.Option("--model", help="Say which table is this model's.")] = None,
) -> None:
    """The tables that are there, and whether they are whole."""
    from accept.commands.physics import lookup as command

    raise typer.Exit(command.run_info(model))


def misalign(
    unit: Annotated[Path, typer.Argument(help="Folder of a strut with a section [frf].")],
    model: Annotated[str | None, typer.Option("--model", help="Built-in model or TOML file; else strut.")] = None,
    json: Json = None,
    plot: Plot = None,
) -> None:
    """How far a strut's APA lies off its axis. dx, dy with U, or why that cannot be said."""
    from accept.commands.physics import misalign as command

    raise typer.Exit(command.run(unit, model, json, plot))
