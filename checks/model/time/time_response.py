"""The response of a modelled unit in time to volts at the converter: the whole linear path, amplifier, wires, delay.
Two methods, one for each interpretation of a converter's output. Both start from rest."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy import fft

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.model.channel_paths import LATENCIES
from checks.model.electrical import electrical_of
from checks.model.model import F_MAX, Model
from checks.model.time.partial_fractions import Fractions, paths

SETTLED = 14.0  # decay times: 1e-6 of the ringing at the record's end is left when it could wrap round to the start
LONGEST_S = 60.0
TAIL = 512  # samples
AT_A_TIME = 8192  # frequencies: keeps the work space small
NO_FILTER: Mapping[str, Fractions] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class SpectrumSimulation:
    """Answers to drives of up to `room` samples at fs [Hz], interpolated without images, as from a converter with a
    perfect filter. So the measured response is the model's own at every frequency below fs / 2, as in the recorded
    units of the bench. H (F, C) at the transform's frequencies."""

    H: Complex
    channels: tuple[str, ...]
    fs: float
    room: int
    size: int

    def __call__(self, Va: Array) -> dict[str, Array]:
        """Return the response (N,) of every channel to Va (N,) [V], N <= room. Raises ModelError."""
        if not 0 < Va.size <= self.room:
            raise ModelError(f"a drive of {Va.size} samples, expected 1 to {self.room}")
        spectrum = fft.rfft(np.concatenate([Va, _decaying_tail(Va)]), self.size)
        return {c: fft.irfft(self.H[:, i] * spectrum, self.size)[: Va.size] for i, c in enumerate(self.channels)}


def _decaying_tail(Va: Array) -> Array:
    """Return a drive with a short tail down to zero: cut at its last sample it would ring back into the record."""
    n = min(TAIL, Va.size - 1)
    k = np.arange(1, n + 1)
    return np.asarray((2.0 * Va[-1] - Va[-1 - k]) * (0.5 + 0.5 * np.cos(np.pi * k / (n + 1))))


@dataclass(frozen=True, eq=False)
class HoldSimulation:
    """Exact answers to drives at fs [Hz] with each sample held until the next, state by state, as from a converter
    without a filter. The measured response then lags by half a sample ([STB] 6.1.2 adds a whole one)."""

    paths: dict[str, Fractions]
    fs: float
    late: dict[str, float]

    def __call__(self, Va: Array) -> dict[str, Array]:
        return {c: path.held(Va, self.fs, self.late[c]) for c, path in self.paths.items()}


def time_simulation(
    model: Model,
    samples: int,
    fs: float,
    hold: bool = False,
    channels: Iterable[str] | None = None,
    filters: Mapping[str, Fractions] = NO_FILTER,
) -> SpectrumSimulation | HoldSimulation:
    """Return the simulation of the model's responses to drives of up to so many samples at fs [Hz]; hold: see `Held`;
    filters: further filters of a channel, in series with the model.

    Raises ModelError for a sampling frequency beyond 0..10 kHz, and if `hold` meets a negative delay."""
    if not 0.0 < fs <= 2.0 * F_MAX or samples < 1:
        raise ModelError(f"{samples} samples at {fs:g} Hz; expected one or more at up to {2 * F_MAX:g} Hz")
    wanted = model.channels if channels is None else tuple(channels)
    if not hold:
        return _spectrum_simulation(model, samples, fs, wanted, filters)
    common = electrical_of(model.values).tau
    late = {c: common + 1e-6 * model.values[LATENCIES[c]] for c in wanted}
    for c, seconds in late.items():
        if seconds < 0.0:
            raise ModelError(f"{c} comes {-1e6 * seconds:g} us early: what is held cannot come before its cause")
    every = paths(model)
    return HoldSimulation({c: every[c].times(filters[c]) if c in filters else every[c] for c in wanted}, fs, late)


def _spectrum_simulation(
    model: Model, samples: int, fs: float, channels: tuple[str, ...], filters: Mapping[str, Fractions]
) -> SpectrumSimulation:
    size = fft.next_fast_len(samples + TAIL + int(np.ceil(settling_s(model) * fs)), real=True)
    f = np.minimum(fft.rfftfreq(size, 1.0 / fs), F_MAX)  # the last one may round beyond
    parts = [model.frf(part, channels=channels) for part in np.array_split(f, -(-f.size // AT_A_TIME))]
    H = np.concatenate(parts)
    for i, channel in enumerate(channels):
        if channel in filters:
            H[:, i] *= filters[channel].at(2j * np.pi * f)
    return SpectrumSimulation(H, channels, fs, samples, size)


def settling_s(model: Model) -> float:
    """Return the time [s] after which free vibrations have died away, at most a minute."""
    rates = [float(rate) for rate in -model.poles().real if rate > 0.0]
    e = electrical_of(model.values)
    rates += [2.0 * np.pi * e.highpass_Hz] if e.highpass_Hz else []
    return min(SETTLED / min(rates, default=1e-9) + abs(e.tau), LONGEST_S)
