"""`accept excite`: excitation signals for the rig, as .mat or .csv."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from typer import Option

from accept.commands.answer import Answer, File, Remark, command, picture, refusal
from checks.declare import Series
from checks.signals import Excitation, Notch, Rig, amplitude_shape, excitation_panels
from hw.records import csv_bytes, mat_bytes, read

Law = StrEnum("Law", "LOG LINEAR")  # how a sweep's frequency grows
Lines = StrEnum("Lines", "ALL ODD")  # of the period, that a multisine drives
Out = Annotated[Path, Option(help="File to write: .mat or .csv.")]
Seed = Annotated[int, Option(help="Seed of the random numbers.")]


@dataclass(frozen=True)
class Shaping:
    """Amplitude over frequency. notch_from: a first record (t, Va and de) whose resonance is notched; its own width and
    depth unless they are given."""

    notch: Annotated[float | None, Option(help="Less amplitude around this resonance [Hz].")] = None
    notch_width: Annotated[float | None, Option(help="Width of the notch [Hz].")] = None
    notch_depth: Annotated[float | None, Option(help="Amplitude left at its bottom, 0 to 1.")] = None
    notch_from: Annotated[Path | None, Option(help="First record: its resonance is notched.")] = None
    low_pass: Annotated[float | None, Option(help="Less amplitude above this corner [Hz].")] = None


@dataclass(frozen=True)
class Playing:
    """The rig that plays a signal, and its picture."""

    fs: Annotated[float, Option(help="Sampling frequency of the rig [Hz].")] = 1e4
    mean: Annotated[float, Option(help="Mean voltage at the DAC [V]; 3.25 V is the middle of the stack's range.")] = (
        3.25
    )
    ramp: Annotated[float, Option(help="Length of the smooth ramps to and from the mean voltage [s].")] = 5.0
    plot: Annotated[Path | None, Option(help="Picture of the signal: .png, .pdf or .svg.")] = None


@dataclass(frozen=True)
class SweepOptions:
    """A sine of rising frequency."""

    out: Out
    f_start: Annotated[float, Option(help="First frequency [Hz].")] = 10.0
    f_end: Annotated[float, Option(help="Last frequency [Hz].")] = 400.0
    duration: Annotated[float, Option(help="Length [s], ramps not counted.")] = 100.0
    amplitude: Annotated[float, Option(help="Amplitude at the DAC [V].")] = 1.0
    law: Annotated[Law, Option(help="How the frequency rises.")] = Law.LOG


@dataclass(frozen=True)
class NoiseOptions:
    """Noise in a band."""

    out: Out
    f_start: Annotated[float, Option(help="Lower edge of the band [Hz]; 0 for low-passed noise.")] = 300.0
    f_end: Annotated[float, Option(help="Upper edge of the band [Hz].")] = 2000.0
    duration: Annotated[float, Option(help="Length [s], ramps not counted.")] = 100.0
    rms: Annotated[float, Option(help="Root mean square at the DAC [V].")] = 0.3
    seed: Seed = 0


@dataclass(frozen=True)
class SineOptions:
    """Slow sines of growing amplitude."""

    out: Out
    f: Annotated[float, Option(help="Frequency [Hz].")] = 0.1
    amplitudes: Annotated[str, Option(help="Amplitudes at the DAC [V], rising.")] = "0.1,0.2,0.4,1,2,4"
    cycles: Annotated[int, Option(help="Periods of each amplitude.")] = 3


@dataclass(frozen=True)
class MultisineOptions:
    """A random-phase multisine."""

    out: Out
    f_start: Annotated[float, Option(help="First line [Hz].")] = 10.0
    f_end: Annotated[float, Option(help="Last line [Hz].")] = 2000.0
    resolution: Annotated[float, Option(help="Distance of the lines [Hz]; its inverse is the period.")] = 0.5
    rms: Annotated[float, Option(help="Root mean square at the DAC [V].")] = 0.3
    periods: Annotated[int, Option(help="Periods to play.")] = 8
    lines: Annotated[Lines, Option(help="Lines to drive; odd ones show even distortion between them.")] = Lines.ALL
    crest: Annotated[int, Option(help="Iterations that lower the crest factor.")] = 0
    seed: Seed = 0


AS_IS, PLAYED = Shaping(), Playing()
NOTCH_WIDTH, NOTCH_DEPTH = 0.2, 0.1  # of the resonance, of the amplitude beside it: where nothing else was asked for
FADE_S = 0.1  # at both ends of what ends anywhere


@command
def sweep(wanted: SweepOptions, shaping: Shaping = AS_IS, playing: Playing = PLAYED) -> Answer:
    """Write a sine of rising frequency."""
    law = "lin" if wanted.law is Law.LINEAR else "log"
    at = wanted.f_start, wanted.f_end, wanted.duration, wanted.amplitude, law
    return _answer(wanted.out, playing, lambda rig: rig.sweep(*at, amplitude_shape(*parts_of(shaping)), FADE_S))


@command
def noise(wanted: NoiseOptions, shaping: Shaping = AS_IS, playing: Playing = PLAYED) -> Answer:
    """Write noise in a band."""
    at = wanted.f_start, wanted.f_end, wanted.duration, wanted.rms, wanted.seed
    return _answer(wanted.out, playing, lambda rig: rig.noise(*at, amplitude_shape(*parts_of(shaping)), FADE_S))


@command
def sine(wanted: SineOptions, playing: Playing = PLAYED) -> Answer:
    """Write slow sines of growing amplitude, for the hysteresis."""
    f, cycles = wanted.f, wanted.cycles
    return _answer(wanted.out, playing, lambda rig: rig.sines(f, levels_of(wanted.amplitudes), cycles))


@command
def multisine(wanted: MultisineOptions, shaping: Shaping = AS_IS, playing: Playing = PLAYED) -> Answer:
    """Write a random-phase multisine. Periodic, so without leakage: the best of the four."""
    at = wanted.f_start, wanted.f_end, wanted.resolution, wanted.rms, wanted.periods, wanted.seed
    more = str(wanted.lines), wanted.crest
    return _answer(wanted.out, playing, lambda rig: rig.multisine(*at, amplitude_shape(*parts_of(shaping)), *more))


def levels_of(text: str) -> list[float]:
    """Return amplitudes [V] as typed. Raises ValueError."""
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise ValueError(f"'{text}' is not a list of numbers. Example: 0.1,0.2,0.4") from None


def parts_of(shaping: Shaping) -> tuple[Notch | None, float | None]:
    """Return the notch and the corner of the low-pass [Hz] that were asked for. Raises ValueError if the notch's parts
    do not fit together, RecordError if the record cannot be used."""
    if shaping.notch is not None and shaping.notch_from is not None:
        raise ValueError("give the notch's frequency or a record to find it in, not both")
    if shaping.notch_from is not None:
        record = read(shaping.notch_from, Series("first", "first record", {"t": "s", "Va": "V", "de": "m"}))
        usual = Notch.of_record(record)
    elif shaping.notch is not None:
        usual = Notch(shaping.notch, NOTCH_WIDTH * shaping.notch, NOTCH_DEPTH)
    elif shaping.notch_width is not None or shaping.notch_depth is not None:
        raise ValueError("a notch's width or depth needs its frequency, or a record to find it in")
    else:
        return None, shaping.low_pass
    width = usual.width_Hz if shaping.notch_width is None else shaping.notch_width
    depth = usual.depth if shaping.notch_depth is None else shaping.notch_depth
    return Notch(usual.f0_Hz, width, depth), shaping.low_pass


def _answer(out: Path, playing: Playing, make: Callable[[Rig], Excitation]) -> Answer:
    try:
        excitation = make(Rig(fs=playing.fs, mean_V=playing.mean, ramp_s=playing.ramp))
        signal = content(excitation, out)
    except ValueError as e:
        return refusal(e)
    drawn = picture(playing.plot, lambda: list(excitation_panels(excitation).values()))
    return Answer(File(out, signal), drawn, *map(Remark, summary(excitation, out)))


def content(excitation: Excitation, out: Path) -> bytes:
    """Return the file's bytes: .mat with t, Va and how it was made, .csv with t and Va. Raises ValueError."""
    signal: Mapping[str, ArrayLike] = {"t": excitation.t, "Va": excitation.Va}
    if out.suffix.lower() == ".csv":
        return csv_bytes(signal)
    if out.suffix.lower() != ".mat":
        raise ValueError(f"{out.name}: excitation is written as .mat or .csv")
    return mat_bytes(
        {
            **signal,
            "fs": excitation.fs,
            "V_mean": excitation.mean_V,
            "t_start": excitation.start / excitation.fs,
            "t_end": excitation.stop / excitation.fs,
            "period_samples": float(excitation.period or 0),
        }
    )


def summary(excitation: Excitation, out: Path) -> list[str]:
    """Return a summary of the signal in a few lines."""
    Va = excitation.Va
    rms = float(np.sqrt(np.mean(excitation.proper**2)))
    return [
        f"{out}: {excitation.meaning}",
        f"  {Va.size} samples at {excitation.fs:g} Hz, {Va.size / excitation.fs:.1f} s with ramps",
        f"  {Va.min():.3f} to {Va.max():.3f} V at the DAC, mean {excitation.mean_V:g} V, rms about it {rms:.3g} V",
        *(f"  {note}" for note in excitation.notes),
    ]
