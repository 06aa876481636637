"""The command lines of `accept frf` and `accept compare`."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Estimator(StrEnum):
    """Estimators of responses."""

    AUTO = "auto"
    H1 = "h1"
    LPM = "lpm"


Json = Annotated[Path | None, typer.Option("--json", help="Everything as numbers, to this file.")]
Plot = Annotated[Path | None, typer.Option(help="Picture: .png, .pdf or .svg.")]


def frf(
    records: Annotated[list[Path], typer.Argument(help="Record files (.mat, .csv, .uff).")],
    estimator: Annotated[Estimator, typer.Option(help="auto: over the periods of a periodic input, else h1.")] = (
        Estimator.AUTO
    ),
    segment_s: Annotated[float, typer.Option(min=1e-4, help="Length of the Hann segments of h1 [s].")] = 0.5,
    f_lo: Annotated[float, typer.Option(min=0.0, help="Lowest frequency [Hz].")] = 0.0,
    f_hi: Annotated[float | None, typer.Option(help="Highest frequency [Hz]; default half of the sampling's.")] = None,
    input: Annotated[str, typer.Option(help="Channel that drives; all others are outputs.")] = "Va",
    merge_Hz: Annotated[
        float | None, typer.Option("--merge-Hz", help="Join two records: the first up to here, the second above.")
    ] = None,
    json: Json = None,
    plot: Plot = None,
    uff: Annotated[Path | None, typer.Option(help="Universal file (data set 58) to write.")] = None,
) -> None:
    """Frequency responses of records. With coherence, variance and the largest resonance."""
    from accept.commands.physics import frf as command

    wanted = command.ResponseOptions(input, estimator.value, segment_s, f_lo, f_hi, merge_Hz)
    raise typer.Exit(command.run(records, wanted, json, plot, uff))


def compare(
    units: Annotated[list[Path], typer.Argument(help="Unit folders, or parents of unit folders.")],
    spec: Annotated[str | None, typer.Option("--spec", help="Built-in spec or TOML file; else the kind picks.")] = None,
    json: Json = None,
    plot: Plot = None,
) -> None:
    """Units side by side, and who stands out. Robust scores of quantities and curves, overlays of curves."""
    from accept.commands.units import compare as command

    raise typer.Exit(command.run(units, spec, json, plot))
