"""`accept excite`: excitation signals for the rig, as .mat or .csv."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from accept.base.atomic_files import write_atomic
from accept.base.console import clear_errors, say
from accept.base.exit_codes import Exit
from accept.pictures.draw import picture
from accept.pictures.formats import format_of
from checks.declare import Series
from checks.signals.drive import excitation as ex
from checks.signals.drive.excitation import Excitation, Rig
from checks.signals.drive.excitation_panels import panels
from checks.signals.drive.shapes import AmplitudeShape, Both, Flat, LowPass, Notch, notch_at_resonance
from checks.signals.spectral.frf import h1_record
from hw.records import read
from hw.records.writers import csv_bytes, mat_bytes


@dataclass(frozen=True)
class Shaping:
    """Amplitude over frequency as asked on the command line. notch_from: a first record (t, Va and the response) whose
    resonance is notched; its own width and depth unless they are given."""

    notch_Hz: float | None = None
    notch_width_Hz: float | None = None
    notch_depth: float | None = None
    notch_from: Path | None = None
    notch_channel: str = "de"
    low_pass_Hz: float | None = None

    def shape(self) -> AmplitudeShape:
        """Raises ValueError when the parts do not fit together, RecordError for a record that cannot be used."""
        parts = [p for p in (self._notch(), self._low_pass()) if p is not None]
        return Both(*parts) if len(parts) == 2 else (parts[0] if parts else Flat())

    def _low_pass(self) -> AmplitudeShape | None:
        return None if self.low_pass_Hz is None else LowPass(self.low_pass_Hz)

    def _notch(self) -> AmplitudeShape | None:
        if self.notch_Hz is not None and self.notch_from is not None:
            raise ValueError("give the notch's frequency or a record to find it in, not both")
        if self.notch_from is not None:
            return self._asked(self._found(self.notch_from))
        if self.notch_Hz is None:
            if self.notch_width_Hz is not None or self.notch_depth is not None:
                raise ValueError("a notch's width or depth needs its frequency, or a record to find it in")
            return None
        return self._asked(Notch(self.notch_Hz, 0.2 * self.notch_Hz, 0.1))

    def _asked(self, usual: Notch) -> Notch:
        width = usual.width_Hz if self.notch_width_Hz is None else self.notch_width_Hz
        return Notch(usual.f0_Hz, width, usual.depth if self.notch_depth is None else self.notch_depth)

    def _found(self, path: Path) -> Notch:
        channels = {"t": "s", "Va": "V", self.notch_channel: "m"}
        record = read(path, Series("first", "first record", channels))
        return notch_at_resonance(h1_record(record, "Va", [self.notch_channel]), self.notch_channel)


def sweep(
    out: Path,
    f_start_Hz: float = 10.0,
    f_end_Hz: float = 400.0,
    duration_s: float = 100.0,
    amplitude_V: float = 1.0,
    law: str = "log",
    shaping: Shaping | None = None,
    rig: Rig | None = None,
    fade_s: float = 0.1,
    plot: Path | None = None,
) -> Exit:
    """Write a swept sine."""
    return _run(
        out,
        plot,
        lambda: ex.sweep(rig or Rig(), f_start_Hz, f_end_Hz, duration_s, amplitude_V, law, _shape(shaping), fade_s),
    )


def noise(
    out: Path,
    f_start_Hz: float = 300.0,
    f_end_Hz: float = 2000.0,
    duration_s: float = 100.0,
    rms_V: float = 0.3,
    seed: int = 0,
    shaping: Shaping | None = None,
    rig: Rig | None = None,
    fade_s: float = 0.1,
    plot: Path | None = None,
) -> Exit:
    """Write band-limited or low-passed noise."""
    return _run(
        out,
        plot,
        lambda: ex.noise(rig or Rig(), f_start_Hz, f_end_Hz, duration_s, rms_V, seed, _shape(shaping), fade_s),
    )


def sine(
    out: Path,
    f_Hz: float = 0.1,
    amplitudes_V: Sequence[float] = (0.1, 0.2, 0.4, 1.0, 2.0, 4.0),
    cycles: int = 3,
    rig: Rig | None = None,
    plot: Path | None = None,
) -> Exit:
    """Write sines of growing amplitude."""
    return _run(out, plot, lambda: ex.sines(rig or Rig(), f_Hz, amplitudes_V, cycles))


def multisine(
    out: Path,
    f_start_Hz: float = 10.0,
    f_end_Hz: float = 2000.0,
    resolution_Hz: float = 0.5,
    rms_V: float = 0.3,
    periods: int = 8,
    seed: int = 0,
    shaping: Shaping | None = None,
    lines: str = "all",
    crest_iterations: int = 0,
    rig: Rig | None = None,
    plot: Path | None = None,
) -> Exit:
    """Write a random-phase multisine."""

    def make() -> Excitation:
        shape = _shape(shaping)
        return ex.multisine(
            rig or Rig(), f_start_Hz, f_end_Hz, resolution_Hz, rms_V, periods, seed, shape, lines, crest_iterations
        )

    return _run(out, plot, make)


def _shape(shaping: Shaping | None) -> AmplitudeShape:
    return (shaping or Shaping()).shape()


@clear_errors
def _run(out: Path, plot: Path | None, make: Callable[[], Excitation]) -> Exit:
    format = None if plot is None else format_of(plot)
    try:
        excitation = make()
        write_atomic(out, content(excitation, out))
        if plot is not None and format is not None:
            write_atomic(plot, picture(list(panels(excitation).values()), format))
    except ValueError as e:
        say(f"accept: {e}")
        return Exit.BAD_INPUT
    say(summary(excitation, out))
    return Exit.ACCEPTED


def content(excitation: Excitation, out: Path) -> bytes:
    """The file's bytes: .mat with t, Va and what helps to read the answer, .csv with t and Va. Raises ValueError."""
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


def summary(excitation: Excitation, out: Path) -> str:
    """What was written, in a few lines."""
    Va = excitation.Va
    rms = float(np.sqrt(np.mean(excitation.proper**2)))
    lines = [
        f"{out}: {excitation.meaning}",
        f"  {Va.size} samples at {excitation.fs:g} Hz, {Va.size / excitation.fs:.1f} s with ramps",
        f"  {Va.min():.3f} to {Va.max():.3f} V at the DAC, mean {excitation.mean_V:g} V, rms about it {rms:.3g} V",
        *(f"  {note}" for note in excitation.notes),
    ]
    return "\n".join(lines)
