"""`accept excite`: excitation signals for the rig, as .mat or .csv."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from accept.commands.answer import Answer, File, Remark, command, picture, refusal
from accept.commands.physics.excite_options import (
    Law,
    MultisineOptions,
    NoiseOptions,
    Playing,
    Shaping,
    SineOptions,
    SweepOptions,
)
from checks.declare import Series
from checks.signals import Excitation, Notch, Rig, amplitude_shape, excitation_panels, notch_of_record
from hw.records import csv_bytes, mat_bytes, read

AS_IS, PLAYED = Shaping(), Playing()
NOTCH_WIDTH, NOTCH_DEPTH = 0.2, 0.1  # of the resonance, of the amplitude beside it: where nothing else was asked for
FADE_S = 0.1  # at both ends of what ends anywhere


@command
def sweep(wanted: SweepOptions, shaping: Shaping = AS_IS, playing: Playing = PLAYED) -> Answer:
    """Write a sine of rising frequency."""
    law = "lin" if wanted.law is Law.LINEAR else "log"
    at = wanted.f_start, wanted.f_end, wanted.duration, wanted.amplitude
    return _answer(
        wanted.out, playing.plot, lambda: rig_of(playing).sweep(*at, law, amplitude_shape(*parts_of(shaping)), FADE_S)
    )


@command
def noise(wanted: NoiseOptions, shaping: Shaping = AS_IS, playing: Playing = PLAYED) -> Answer:
    """Write noise in a band."""
    at = wanted.f_start, wanted.f_end, wanted.duration, wanted.rms, wanted.seed
    return _answer(
        wanted.out, playing.plot, lambda: rig_of(playing).noise(*at, amplitude_shape(*parts_of(shaping)), FADE_S)
    )


@command
def sine(wanted: SineOptions, playing: Playing = PLAYED) -> Answer:
    """Write slow sines of growing amplitude, for the hysteresis."""

    def make() -> Excitation:
        return rig_of(playing).sines(wanted.f, levels_of(wanted.amplitudes), wanted.cycles)

    return _answer(wanted.out, playing.plot, make)


@command
def multisine(wanted: MultisineOptions, shaping: Shaping = AS_IS, playing: Playing = PLAYED) -> Answer:
    """Write a random-phase multisine. Periodic, so without leakage: the best of the four."""
    at = wanted.f_start, wanted.f_end, wanted.resolution, wanted.rms, wanted.periods, wanted.seed

    def make() -> Excitation:
        return rig_of(playing).multisine(*at, amplitude_shape(*parts_of(shaping)), str(wanted.lines), wanted.crest)

    return _answer(wanted.out, playing.plot, make)


def rig_of(playing: Playing) -> Rig:
    """Return the rig that was asked for."""
    return Rig(fs=playing.fs, mean_V=playing.mean, ramp_s=playing.ramp)


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
        usual = notch_of_record(record)
    elif shaping.notch is not None:
        usual = Notch(shaping.notch, NOTCH_WIDTH * shaping.notch, NOTCH_DEPTH)
    elif shaping.notch_width is not None or shaping.notch_depth is not None:
        raise ValueError("a notch's width or depth needs its frequency, or a record to find it in")
    else:
        return None, shaping.low_pass
    width = usual.width_Hz if shaping.notch_width is None else shaping.notch_width
    depth = usual.depth if shaping.notch_depth is None else shaping.notch_depth
    return Notch(usual.f0_Hz, width, depth), shaping.low_pass


def _answer(out: Path, plot: Path | None, make: Callable[[], Excitation]) -> Answer:
    try:
        excitation = make()
        signal = content(excitation, out)
    except ValueError as e:
        return refusal(e)
    drawn = picture(plot, lambda: list(excitation_panels(excitation).values()))
    return Answer(File(out, signal), drawn, *map(Remark, summary(excitation, out)))


def content(excitation: Excitation, out: Path) -> bytes:
    """Return the file's bytes: .mat with t, Va and what helps to read the answer, .csv with t and Va. Raises
    ValueError."""
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
