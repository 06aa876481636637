"""Excitation signals for the rig: sweeps, shaped noise, sines of growing amplitude and random-phase multisines, each
between smooth ramps from 0 V to the mean voltage and back ([STB] 3.1.1, 3.1.6, 7.4 to 7.6).

Voltages are at the DAC; the amplifier's gain follows. A signal that would leave the range of the DAC or of the stacks
is refused, never clipped."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy import fft

from checks.arrays import Array, Complex
from checks.signals.drive.shapes import AmplitudeShape, Flat
from specs.bench import DAC_V, STACK_V
from specs.errors import AcceptError

LINES = ("all", "odd")


@dataclass(frozen=True, eq=False)
class MultisinePeriod:
    """Period of a multisine. x (N,) one period, of rms one; lines (L,) its harmonics of 1/N."""

    x: Array
    lines: NDArray[np.intp]

    @property
    def crest(self) -> float:
        """Return the crest factor: peak over rms."""
        return float(np.max(np.abs(self.x)) / np.sqrt(np.mean(self.x**2)))


def harmonics(n: int, fs: float, band_Hz: tuple[float, float], lines: str) -> NDArray[np.intp]:
    """Return the lines of a period of n samples inside the band; "odd" leaves the even ones free to show even
    distortion ([PS12] 4.3). Raises ValueError if no line is left."""
    if lines not in LINES:
        raise ValueError(f"lines '{lines}' are not known (known: {', '.join(LINES)})")
    first, last = int(np.ceil(band_Hz[0] * n / fs - 1e-9)), int(np.floor(band_Hz[1] * n / fs + 1e-9))
    found = np.arange(max(first, 1), min(last, (n - 1) // 2) + 1)
    found = found[found % 2 == 1] if lines == "odd" else found
    if found.size == 0:
        raise ValueError(f"no {lines} line of {fs / n:.4g} Hz lies between {band_Hz[0]:g} and {band_Hz[1]:g} Hz")
    return found


def random_phase(n: int, fs: float, lines: NDArray[np.intp], shape: AmplitudeShape, rng: Generator) -> MultisinePeriod:
    """Return one period of n samples: amplitudes by the shape, phases uniform and independent, rms one."""
    amplitude = shape.gain(lines * fs / n)
    return _period(n, lines, amplitude * np.exp(2j * np.pi * rng.random(lines.size)))


def compress_crest(period: MultisinePeriod, iterations: int) -> MultisinePeriod:
    """Return the same amplitudes with phases of a lower crest factor, by clipping and taking back the amplitudes
    ([OSR88]). The best of all iterations; never worse than the start."""
    n, lines = period.x.size, period.lines
    amplitude = np.abs(fft.rfft(period.x)[lines])
    best = current = period
    for k in range(iterations):
        peak = np.max(np.abs(current.x))
        clipped = np.clip(current.x, *(np.array([-1, 1]) * peak * (0.75 + 0.2 * k / max(iterations - 1, 1))))
        phase = np.angle(fft.rfft(clipped)[lines])
        current = _period(n, lines, amplitude * np.exp(1j * phase))
        best = min(best, current, key=lambda p: p.crest)
    return best


def from_zero(period: MultisinePeriod) -> MultisinePeriod:
    """Return the same period from its gentlest rise through zero, so that it follows a constant without a step."""
    x, following = period.x, np.roll(period.x, -1)
    rising = np.flatnonzero((x <= 0) & (following > 0))
    cost = np.abs(x[rising]) + np.abs(following[rising] - x[rising])
    start = int(rising[np.argmin(cost)]) if rising.size else 0
    return MultisinePeriod(np.roll(x, -start), period.lines)


def _period(n: int, lines: NDArray[np.intp], amplitude: Complex) -> MultisinePeriod:
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[lines] = amplitude
    x = fft.irfft(spectrum, n)
    return MultisinePeriod(x / np.sqrt(np.mean(x**2)), lines)


_FAST, _SLOW, _REST = 0.2, 0.7, 0.9  # velocity is up at, falls from, and is zero again at these shares of the ramp
_AREA = 0.7  # under a trapezoid of height one


def trapezoid(s: Array) -> Array:
    """Return the share 0..1 of the way at the share s (N,) of the time: the integral of a trapezoid of velocity, which
    rises until 0.2, is constant until 0.7, falls until 0.9 and rests ([STB] 7.4). Value and velocity are continuous."""
    s = np.clip(s, 0.0, 1.0)
    rising = np.minimum(s, _FAST) ** 2 / (2 * _FAST)
    steady = np.clip(s - _FAST, 0.0, _SLOW - _FAST)
    left = np.clip(_REST - s, 0.0, _REST - _SLOW)
    falling = ((_REST - _SLOW) ** 2 - left**2) / (2 * (_REST - _SLOW))
    return np.asarray((rising + steady + falling) / _AREA)


def ramp(start: float, end: float, duration_s: float, fs: float) -> Array:
    """Return a ramp (N,) from start to end in duration_s [s] at fs [Hz]; the last sample is exactly the end."""
    n = round(duration_s * fs)
    if n < 2:
        return np.empty(0)
    share = trapezoid(np.arange(n) / (n - 1))
    return np.asarray(np.where(share >= 1.0, end, start + (end - start) * share))


def fade(n: int, samples: int) -> Array:
    """Return a window (n,): ones, with a half cosine from 0 over the first samples and back to 0 over the last."""
    if samples < 1:
        return np.ones(n)
    k = np.arange(n)
    edge = np.minimum(np.minimum(k, n - 1 - k) / samples, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * edge))


MAX_SAMPLES = 20_000_000  # half an hour at 10 kHz; 160 MB as doubles
MAX_CREST = 10_000  # iterations: after a few hundred the crest factor stands still


class ExcitationError(AcceptError, ValueError):
    """A signal that must not be played; the text names the wrong value, or the time at which it leaves its limits."""


@dataclass(frozen=True, eq=False)
class Excitation:
    """A signal to play: t (N,) [s] from 0, Va (N,) [V] at the DAC, fs [Hz].

    start, stop : samples of the excitation itself, without ramps and lead-in. period : samples of a period, where
    Va[start:stop] is a whole number of periods; else None."""

    t: Array
    Va: Array
    fs: float
    meaning: str
    mean_V: float
    start: int
    stop: int
    period: int | None = None
    notes: tuple[str, ...] = field(default_factory=tuple)

    @property
    def proper(self) -> Array:
        """Return the excitation itself about its mean (stop - start,) [V]."""
        return self.Va[self.start : self.stop] - self.mean_V


@dataclass(frozen=True)
class Rig:
    """Rig of the signal. The mean, 3.25 V at the DAC, is half way between -20 V and 150 V on the stacks."""

    fs: float = 10_000.0
    mean_V: float = 3.25
    ramp_s: float = 5.0
    gain: float = 20.0
    dac_V: tuple[float, float] = DAC_V
    stack_V: tuple[float, float] = STACK_V

    def sweep(
        self,
        f_start_Hz: float,
        f_end_Hz: float,
        duration_s: float,
        amplitude_V: float,
        law: str = "log",
        shape: AmplitudeShape | None = None,
        fade_s: float = 0.1,
    ) -> Excitation:
        """Return a swept sine of this amplitude [V at the DAC] times the shape at its frequency; law "log" or "lin".

        Phase: [STB] 7.4; it ends at any phase, so the amplitude is faded at both ends. Raises ExcitationError."""
        _positive(amplitude_V=amplitude_V, f_start_Hz=f_start_Hz, f_end_Hz=f_end_Hz)
        _check_rig(self, f_start_Hz, f_end_Hz)
        t = np.arange(_samples(self, duration_s) + 1) / self.fs
        phase, momentary = _sweep_phase(t, f_start_Hz, f_end_Hz, duration_s, law)
        core = amplitude_V * (shape or Flat()).gain(momentary) * np.sin(phase) * fade(t.size, round(fade_s * self.fs))
        meaning = f"{law} sweep {f_start_Hz:g} to {f_end_Hz:g} Hz in {duration_s:g} s, amplitude {amplitude_V:g} V"
        return _play(self, core, meaning, notes=(f"shape: {shape or Flat()}",))

    def noise(
        self,
        f_start_Hz: float,
        f_end_Hz: float,
        duration_s: float,
        rms_V: float,
        seed: int = 0,
        shape: AmplitudeShape | None = None,
        fade_s: float = 0.1,
    ) -> Excitation:
        """Return Gaussian noise between two frequencies (f_start_Hz = 0: low-passed), of exactly this rms [V at the
        DAC] before the fades at its ends.

        White in the band times the shape, zero outside: shaped in the frequency domain, because a filter's skirt would
        drive frequencies that the band excludes. Raises ExcitationError."""
        _positive(rms_V=rms_V, f_end_Hz=f_end_Hz)
        _check_rig(self, f_start_Hz, f_end_Hz)
        if not 0.0 <= f_start_Hz < f_end_Hz:
            raise ExcitationError(f"band {f_start_Hz:g} to {f_end_Hz:g} Hz: expected 0 <= start < end")
        n = _samples(self, duration_s)
        f = fft.rfftfreq(n, 1 / self.fs)
        spectrum = fft.rfft(_rng(seed).standard_normal(n))
        spectrum *= np.where((f >= f_start_Hz) & (f <= f_end_Hz) & (f > 0), (shape or Flat()).gain(f), 0.0)
        x = fft.irfft(spectrum, n)
        rms = float(np.sqrt(np.mean(x**2)))
        if rms == 0.0:
            raise ExcitationError(f"{duration_s:g} s hold no frequency between {f_start_Hz:g} and {f_end_Hz:g} Hz")
        core = x * (rms_V / rms) * fade(n, round(fade_s * self.fs))
        meaning = f"noise {f_start_Hz:g} to {f_end_Hz:g} Hz for {duration_s:g} s, rms {rms_V:g} V"
        return _play(self, core, meaning, notes=(f"seed {seed}", f"shape: {shape or Flat()}"))

    def sines(self, f_Hz: float, amplitudes_V: Sequence[float], cycles: int = 3) -> Excitation:
        """Return a sine whose amplitude grows after every `cycles` periods, for hysteresis loops ([STB] 3.1.6, 7.6).

        Raises ExcitationError unless the amplitudes [V at the DAC] are positive and grow."""
        _positive(f_Hz=f_Hz, cycles=cycles)
        _check_rig(self, f_Hz, f_Hz)
        amplitudes = np.asarray(amplitudes_V, dtype=float)
        if amplitudes.size == 0 or not (
            np.isfinite(amplitudes).all() and amplitudes[0] > 0 and (np.diff(amplitudes) > 0).all()
        ):
            raise ExcitationError(f"amplitudes {list(amplitudes_V)} V: expected positive values that grow")
        n = _samples(self, amplitudes.size * cycles / f_Hz)
        turns = np.arange(n + 1) * (f_Hz / self.fs)
        block = np.minimum((turns / cycles).astype(int), amplitudes.size - 1)
        core = amplitudes[block] * np.sin(2 * np.pi * turns)
        listed = ", ".join(f"{a:g}" for a in amplitudes)
        return _play(self, core, f"sines of {f_Hz:g} Hz, {cycles} periods each at {listed} V")

    def full_range(self, f_Hz: float, cycles: int = 2) -> Excitation:
        """Return slow cosines over the range of the stacks, from its lower end, for the stroke ([STB] 2.3)."""
        _positive(f_Hz=f_Hz, cycles=cycles)
        _check_rig(self, f_Hz)
        lo, hi = (V / self.gain for V in self.stack_V)
        n = _samples(self, cycles / f_Hz)
        core = 0.5 * (hi - lo) * (1.0 - np.cos(2 * np.pi * f_Hz * np.arange(n + 1) / self.fs))
        return _play(replace(self, mean_V=lo), core, f"{cycles} cycles of {f_Hz:g} Hz from {self.stack_V[0]:g} V")

    def multisine(
        self,
        f_start_Hz: float,
        f_end_Hz: float,
        resolution_Hz: float,
        rms_V: float,
        periods: int = 4,
        seed: int = 0,
        shape: AmplitudeShape | None = None,
        lines: str = "all",
        crest_iterations: int = 0,
        lead_in: bool = True,
    ) -> Excitation:
        """Return a random-phase multisine: a line at every multiple of the resolution in the band, this number of whole
        periods, one more before them for the transient (lead_in). rms_V [V at the DAC]; amplitude over frequency by the
        shape.

        The period has round(fs / resolution) samples, and every period is the same to the last bit: no leakage, and
        differences between periods are noise ([PS12] 4.3). Another seed is another realisation. Raises
        ExcitationError."""
        _positive(rms_V=rms_V, resolution_Hz=resolution_Hz, periods=periods)
        if not 0 <= crest_iterations <= MAX_CREST:
            raise ExcitationError(f"crest_iterations is {crest_iterations}, expected 0 to {MAX_CREST}")
        _check_rig(self, f_start_Hz, f_end_Hz)
        n = _samples(self, 1.0 / resolution_Hz)
        _samples(self, (periods + lead_in) / resolution_Hz)
        try:
            chosen = harmonics(n, self.fs, (f_start_Hz, f_end_Hz), lines)
        except ValueError as e:
            raise ExcitationError(str(e)) from e
        one = random_phase(n, self.fs, chosen, shape or Flat(), _rng(seed))
        one = from_zero(compress_crest(one, crest_iterations))
        core = np.tile(rms_V * one.x, periods + lead_in)
        meaning = (
            f"multisine {f_start_Hz:g} to {f_end_Hz:g} Hz, {chosen.size} {'odd ' if lines == 'odd' else ''}lines, "
            f"{periods} periods of {n / self.fs:g} s, rms {rms_V:g} V"
        )
        notes = (f"seed {seed}", f"shape: {shape or Flat()}", f"crest factor {one.crest:.2f}")
        played = _play(self, core, meaning, notes)
        return replace(played, start=played.start + (n if lead_in else 0), period=n)


def _sweep_phase(t: Array, f0: float, f1: float, duration: float, law: str) -> tuple[Array, Array]:
    """Return the phase [rad] and the momentary frequency [Hz], its derivative over 2 pi."""
    if law == "lin":
        rate = (f1 - f0) / duration
        return 2 * np.pi * (f0 + rate * t / 2) * t, f0 + rate * t
    if law != "log":
        raise ExcitationError(f"sweep law '{law}' is not known (known: log, lin)")
    ratio = np.log(f1 / f0)
    if ratio == 0.0:
        return 2 * np.pi * f0 * t, np.full_like(t, f0)
    growth = np.expm1(ratio * t / duration)
    return 2 * np.pi * f0 * duration / ratio * growth, f0 * (1.0 + growth)


def _play(rig: Rig, core: Array, meaning: str, notes: tuple[str, ...] = ()) -> Excitation:
    """Return ramp, excitation about the mean and ramp back. Raises ExcitationError beyond the limits."""
    up = ramp(0.0, rig.mean_V, rig.ramp_s, rig.fs)
    down = ramp(rig.mean_V, 0.0, rig.ramp_s, rig.fs)
    Va = np.concatenate([up, rig.mean_V + core, down])
    t = np.arange(Va.size) / rig.fs
    check_limits(t, Va, rig)
    return Excitation(t, Va, rig.fs, meaning, rig.mean_V, up.size, up.size + core.size, notes=notes)


def check_limits(t: Array, Va: Array, rig: Rig) -> None:
    """Raise ExcitationError at the first sample that leaves the range of the DAC, or that of the stacks behind the
    amplifier; t (N,) [s], Va (N,) [V at the DAC]."""
    if not np.isfinite(Va).all():
        k = int(np.flatnonzero(~np.isfinite(Va))[0])
        raise ExcitationError(f"the signal is {Va[k]} at t = {t[k]:.4f} s")
    for where, factor, (lo, hi) in (("the stack", rig.gain, rig.stack_V), ("the DAC", 1.0, rig.dac_V)):
        V = Va * factor
        # A mean at the very limit may round beyond it.
        slack = 1e-9 * max(abs(lo), abs(hi))
        outside = np.flatnonzero((V < lo - slack) | (V > hi + slack))
        if outside.size:
            k = int(outside[0])
            worst = int(np.argmax(np.maximum(V - hi, lo - V)))
            side = f"above {hi:g} V" if V[k] > hi else f"below {lo:g} V"
            raise ExcitationError(
                f"at t = {t[k]:.4f} s {where} would see {V[k]:.3f} V, {side}; {outside.size} of {V.size} samples leave "
                f"{lo:g}..{hi:g} V, the worst {V[worst]:.3f} V at t = {t[worst]:.4f} s. Lower the amplitude or move "
                "the mean"
            )


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ExcitationError(f"{name} is {value}, expected a positive number")


def _rng(seed: int) -> np.random.Generator:
    if seed < 0:
        raise ExcitationError(f"seed is {seed}, expected 0 or more")
    return np.random.default_rng(seed)


def _check_rig(rig: Rig, *f_Hz: float) -> None:
    _positive(sampling_Hz=rig.fs, gain=rig.gain)
    if not (np.isfinite([rig.mean_V, rig.ramp_s]).all() and rig.ramp_s >= 0):
        raise ExcitationError(f"mean {rig.mean_V} V, ramp {rig.ramp_s} s: expected finite values, no negative ramp")
    if not rig.ramp_s * rig.fs <= MAX_SAMPLES:
        n = rig.ramp_s * rig.fs
        raise ExcitationError(f"ramp {rig.ramp_s:g} s at {rig.fs:g} Hz: {n:.4g} samples, at most {MAX_SAMPLES}")
    for f in f_Hz:
        if not f < rig.fs / 2:
            raise ExcitationError(f"{f:g} Hz is not below half the sampling frequency, {rig.fs / 2:g} Hz")


def _samples(rig: Rig, duration_s: float) -> int:
    _positive(duration_s=duration_s)
    n = duration_s * rig.fs
    if not 2 <= n <= MAX_SAMPLES:
        raise ExcitationError(f"{duration_s:g} s at {rig.fs:g} Hz are {n:.4g} samples, expected 2..{MAX_SAMPLES}")
    return round(n)
