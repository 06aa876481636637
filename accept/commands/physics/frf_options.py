"""Options of `accept frf`, declared once: names, defaults and help. Light, so that help comes at once."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from accept.commands.options import Json, Plot


class Estimator(StrEnum):
    """Estimators of responses."""

    AUTO = "auto"
    H1 = "h1"
    LPM = "lpm"


@dataclass(frozen=True)
class ResponseOptions:
    """How to estimate."""

    estimator: Annotated[Estimator, typer.Option(help="auto: over the periods of a periodic input, else h1.")] = (
        Estimator.AUTO
    )
    segment_s: Annotated[float, typer.Option(min=1e-4, help="Length of the Hann segments of h1 [s].")] = 0.5
    f_lo: Annotated[float, typer.Option(min=0.0, help="Lowest frequency [Hz].")] = 0.0
    f_hi: Annotated[float | None, typer.Option(help="Highest frequency [Hz]; default half of the sampling's.")] = None
    input: Annotated[str, typer.Option(help="Channel that drives; all others are outputs.")] = "Va"
    merge_Hz: Annotated[
        float | None, typer.Option("--merge-Hz", help="Join two records: the first up to here, the second above.")
    ] = None


@dataclass(frozen=True)
class ResponseFiles:
    """What to write, and how the file is to be read."""

    json: Json = None
    plot: Plot = None
    uff: Annotated[Path | None, typer.Option(help="Universal file (data set 58) to write.")] = None
    html: Annotated[Path | None, typer.Option(help="Interactive plot, one page (extra `site`).")] = None
    map: Annotated[
        list[str] | None, typer.Option(help="Channel of the file under another name: Va=AI0. Repeat for more.")
    ] = None
    ts: Annotated[float | None, typer.Option(help="Sampling time [s] where the file has no time vector.")] = None
