"""Options of `accept frf`, declared once. Light, so that help comes at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from accept.commands.options import Csv, Json, Plot


@dataclass(frozen=True)
class SourceOptions:
    """How the channels of the files are called, and their time."""

    input: Annotated[
        str | None, typer.Option(help="Channel that drives; all others are outputs. Default: Va, of a hammer Track1.")
    ] = None
    map: Annotated[
        list[str] | None, typer.Option(help="Channel of the file under another name: Va=AI0. Repeat for more.")
    ] = None
    ts: Annotated[float | None, typer.Option(help="Sampling time [s] where the file has no time vector.")] = None
    bench: Annotated[Path | None, typer.Option(help="Bench file: channels, gains and sampling time of its [rig].")] = (
        None
    )


@dataclass(frozen=True)
class HammerOptions:
    """A hammer test, and the rules by which its hits are good: the defaults are those of the check spurious_modes."""

    hammer: Annotated[
        bool, typer.Option("--hammer", help="Hits of a hammer: the average over all good ones of all records.")
    ] = False
    block_s: Annotated[float, typer.Option(min=1e-3, help="Longest block after a hit [s].")] = 4.0
    window_decay: Annotated[
        float | None,
        typer.Option(min=0.0, help="Decay rate [1/s] of the exponential window; default: what a cut decay needs."),
    ] = None
    double_hit_ms: Annotated[
        float, typer.Option(min=0.0, help="A second peak within this many ms makes a double hit.")
    ] = 100.0
    double_hit_share: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="A second peak counts from this part of the first one.")
    ] = 0.03
    ringing_samples: Annotated[
        float, typer.Option(min=0.0, help="Samples for which the analyser's filter rings after a hit.")
    ] = 5.0
    force_range_N: Annotated[
        float | None, typer.Option("--force-range-N", help="Range of the force sensor: beyond, a hit is an overload.")
    ] = None


@dataclass(frozen=True)
class ResponseOptions:
    """Statements that a file of responses lacks, and a response to compare with."""

    averages: Annotated[
        float | None, typer.Option(help="Averages behind the coherence that a file of responses states.")
    ] = None
    noise: Annotated[float | None, typer.Option(help="Relative noise of a response whose file states none: 0.005.")] = (
        None
    )
    against: Annotated[
        Path | None, typer.Option(help="File of responses to compare with: .uff, .mat, .csv or .json.")
    ] = None


@dataclass(frozen=True)
class FrfOutputs:
    """What to write."""

    json: Json = None
    csv: Csv = None
    mat: Annotated[Path | None, typer.Option(help="MATLAB file to write, with the fields of an frd object.")] = None
    plot: Plot = None
    uff: Annotated[Path | None, typer.Option(help="Universal file (data set 58) to write.")] = None
    html: Annotated[Path | None, typer.Option(help="Interactive plot, one page (extra `site`).")] = None
