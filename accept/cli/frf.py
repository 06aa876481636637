"""The command lines of `accept frf` and `accept compare`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.cli.options import spread
from accept.commands.options import Json, Plot, SpecName
from accept.commands.physics.frf_options import ResponseFiles, ResponseOptions


@spread
def frf(
    records: Annotated[list[Path], typer.Argument(help="Record files (.mat, .csv, .uff).")],
    wanted: ResponseOptions,
    files: ResponseFiles,
) -> None:
    """Frequency responses of records. With coherence, variance and the largest resonance."""
    from accept.commands.physics import frf as command

    raise typer.Exit(command.run(records, wanted, files))


def compare(
    units: Annotated[list[Path], typer.Argument(help="Unit folders, or parents of unit folders.")],
    spec: SpecName = None,
    json: Json = None,
    plot: Plot = None,
) -> None:
    """Units side by side, and who stands out. Robust scores of quantities and curves, overlays of curves."""
    from accept.commands.units import compare as command

    raise typer.Exit(command.run(units, spec, json, plot))
