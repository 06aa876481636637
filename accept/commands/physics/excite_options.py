"""Options of `accept excite`, declared once: their names, defaults and help. Light, so that help comes at once."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Law(StrEnum):
    """How a sweep's frequency grows."""

    LOG = "log"
    LINEAR = "linear"


class Lines(StrEnum):
    """Which lines of the period a multisine drives."""

    ALL = "all"
    ODD = "odd"


Out = Annotated[Path, typer.Option(help="File to write: .mat or .csv.")]
Seed = Annotated[int, typer.Option(help="Seed of the random numbers.")]


@dataclass(frozen=True)
class Shaping:
    """Amplitude over frequency. notch_from: a first record (t, Va and de) whose resonance is notched; its own width and
    depth unless they are given."""

    notch: Annotated[float | None, typer.Option(help="Less amplitude around this resonance [Hz].")] = None
    notch_width: Annotated[float | None, typer.Option(help="Width of the notch [Hz].")] = None
    notch_depth: Annotated[float | None, typer.Option(help="Amplitude left at its bottom, 0 to 1.")] = None
    notch_from: Annotated[Path | None, typer.Option(help="First record: its resonance is notched.")] = None
    low_pass: Annotated[float | None, typer.Option(help="Less amplitude above this corner [Hz].")] = None


@dataclass(frozen=True)
class Playing:
    """The rig that plays a signal, and its picture."""

    fs: Annotated[float, typer.Option(help="Sampling frequency of the rig [Hz].")] = 1e4
    mean: Annotated[
        float, typer.Option(help="Mean voltage at the DAC [V]; 3.25 V is the middle of the stack's range.")
    ] = 3.25
    ramp: Annotated[float, typer.Option(help="Length of the smooth ramps to and from the mean voltage [s].")] = 5.0
    plot: Annotated[Path | None, typer.Option(help="Picture of the signal: .png, .pdf or .svg.")] = None


@dataclass(frozen=True)
class SweepOptions:
    """A sine of rising frequency."""

    out: Out
    f_start: Annotated[float, typer.Option(help="First frequency [Hz].")] = 10.0
    f_end: Annotated[float, typer.Option(help="Last frequency [Hz].")] = 400.0
    duration: Annotated[float, typer.Option(help="Length [s], ramps not counted.")] = 100.0
    amplitude: Annotated[float, typer.Option(help="Amplitude at the DAC [V].")] = 1.0
    law: Annotated[Law, typer.Option(help="How the frequency rises.")] = Law.LOG


@dataclass(frozen=True)
class NoiseOptions:
    """Noise in a band."""

    out: Out
    f_start: Annotated[float, typer.Option(help="Lower edge of the band [Hz]; 0 for low-passed noise.")] = 300.0
    f_end: Annotated[float, typer.Option(help="Upper edge of the band [Hz].")] = 2000.0
    duration: Annotated[float, typer.Option(help="Length [s], ramps not counted.")] = 100.0
    rms: Annotated[float, typer.Option(help="Root mean square at the DAC [V].")] = 0.3
    seed: Seed = 0


@dataclass(frozen=True)
class SineOptions:
    """Slow sines of growing amplitude."""

    out: Out
    f: Annotated[float, typer.Option(help="Frequency [Hz].")] = 0.1
    amplitudes: Annotated[str, typer.Option(help="Amplitudes at the DAC [V], rising.")] = "0.1,0.2,0.4,1,2,4"
    cycles: Annotated[int, typer.Option(help="Periods of each amplitude.")] = 3


@dataclass(frozen=True)
class MultisineOptions:
    """A random-phase multisine."""

    out: Out
    f_start: Annotated[float, typer.Option(help="First line [Hz].")] = 10.0
    f_end: Annotated[float, typer.Option(help="Last line [Hz].")] = 2000.0
    resolution: Annotated[float, typer.Option(help="Distance of the lines [Hz]; its inverse is the period.")] = 0.5
    rms: Annotated[float, typer.Option(help="Root mean square at the DAC [V].")] = 0.3
    periods: Annotated[int, typer.Option(help="Periods to play.")] = 8
    lines: Annotated[Lines, typer.Option(help="Lines to drive; odd ones show even distortion between them.")] = (
        Lines.ALL
    )
    crest: Annotated[int, typer.Option(help="Iterations that lower the crest factor.")] = 0
    seed: Seed = 0
