"""`accept gap`: thin."""

from pathlib import Path
from typing import Annotated

import typer

from accept.commands.options import StartModelName


def gap(
    units: Annotated[list[Path], typer.Argument(help="Unit folders with a section [frf], or parents of such.")],
    out: Annotated[Path, typer.Option(help="Folder for gap.json, gap.pdf and model.toml.")],
    model: StartModelName = None,
    fleet: Annotated[bool, typer.Option("--fleet", help="Say which effects all units have in common.")] = False,
    without: Annotated[list[str] | None, typer.Option("--without", help="Leave an effect out of the library.")] = None,
) -> None:
    """Name what is missing from the model. Where simulation and data disagree, and how the gap shrinks."""
    from accept.commands.physics import gap as command

    raise typer.Exit(command.run(units, model, out, fleet, without or []))
