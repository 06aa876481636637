"""Periodic excitation: no leakage, and the noise from the differences between periods ([PS12] 2.4)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.fft

from checks.arrays import Array, Complex
from checks.signals.spectral.frf import Frf, guarded_covariance, named

TOLERANCE = 1e-3  # rms difference of neighbouring periods over the rms of the signal
LINE_POWER = 1e-6  # a line is excited if it has this share of the strongest line's power


@dataclass(frozen=True)
class PeriodicPart:
    """The periodic part of a signal: `count` whole periods of `samples` samples from sample `start` on."""

    samples: int
    start: int
    count: int
    deviation: float  # rms difference of neighbouring periods over the rms of the signal


def detect(u: Array, tolerance: float = TOLERANCE) -> PeriodicPart | None:
    """Return the period of an input u (N,), or None if it does not repeat itself over at least two whole periods.

    Periodic means: an exact number of samples later the signal is the same, but for a difference of rms `tolerance` of
    its own rms. Ramps before and after are left out: the period is searched in the whole, then in the middle of the
    record, and extended to its ends."""
    n = len(u)
    for cut in (0, n // 8, n // 4):
        samples = _shortest_period(u[cut : n - cut], tolerance)
        if samples:
            return _extent(u, samples, tolerance)
    return None


def _shortest_period(u: Array, tolerance: float) -> int:
    """Return the lag of the first deep dip of the squared difference of u and its shifted self; 0 without one."""
    x = u - np.mean(u)
    n = x.size
    energy = np.concatenate([[0.0], np.cumsum(x * x)])
    if n < 8 or not energy[-1] > 0.0:
        return 0
    lags = np.arange(1, n // 2 + 1)
    size = scipy.fft.next_fast_len(2 * n, real=True)
    correlation = scipy.fft.irfft(np.abs(scipy.fft.rfft(x, size)) ** 2, size)[lags]
    both = energy[n - lags] + energy[n] - energy[lags]  # of the two parts that overlap
    difference = (both - 2.0 * correlation) / np.where(both > 0.0, both, 1.0)  # 0 same, 1 unrelated, 2 opposite
    apart = np.maximum.accumulate(difference) > 0.1  # a slow signal is like itself one sample on: that is not a period
    deep = apart & (difference < max(tolerance**2, 1e-11) / 2.0) & (both > 1e-3 * energy[-1])
    if not deep.any():
        return 0
    first = int(np.argmax(deep))
    run = int(np.argmin(np.append(deep[first:], False)))
    return int(lags[first + np.argmin(difference[first : first + run])])


def _extent(u: Array, samples: int, tolerance: float) -> PeriodicPart | None:
    """Return the periodic part, extended from the middle of u until the signal stops repeating."""
    jump = u[samples:] - u[:-samples]
    middle = u[u.size // 4 : -(u.size // 4)]
    rms = float(np.std(middle))
    broken = np.flatnonzero(np.abs(jump) > 10.0 * tolerance * rms)
    at = jump.size // 2
    start = int(broken[broken < at].max(initial=-1)) + 1
    stop = int(broken[broken >= at].min(initial=jump.size)) + samples
    count = (stop - start) // samples
    if count < 2:
        return None
    whole = u[start : start + count * samples].reshape(count, samples)
    deviation = float(np.sqrt(np.mean((whole[1:] - whole[:-1]) ** 2))) / rms
    # A period that is not a whole number of samples matches the next one, but the first does not match the last.
    drift = float(np.sqrt(np.mean((whole[-1] - whole[0]) ** 2))) / rms
    return PeriodicPart(samples, start, count, deviation) if max(deviation, drift / 2.0) <= tolerance else None


def periodic_frf(
    u: Array, y: Array | Mapping[str, Array], fs: float, period: PeriodicPart, skip: int = 1, *, input: str = "u"
) -> Frf:
    """Return the responses at the excited lines, with the variance over periods; no window, no leakage.

    u : (N,), y : (N,), (N, C) or name -> (N,), sampled at fs [Hz]. skip : first periods left to the transient.
    nu = periods - 1. Lines with less than 1e-6 of the strongest line's power are not excited and left out.
    Raises ValueError if fewer than two periods remain, for unequal lengths, NaN or inf."""
    outputs = named(y)
    count = period.count - skip
    if count < 2 or skip < 0:
        raise ValueError(f"{period.count} period(s) less {skip} leave {count}; a variance needs two or more")
    U, *Y = (_lines(name, x, len(u), period, skip) for name, x in ((input, u), *outputs.items()))
    power = np.abs(U.mean(axis=0)) ** 2
    lines = np.flatnonzero(power > LINE_POWER * power[1:].max())
    lines = lines[lines > 0]
    Um, Ym = U[:, lines], np.stack([x[:, lines] for x in Y], axis=2)  # (periods, F), (periods, F, C)
    H = Ym.mean(axis=0) / Um.mean(axis=0)[:, None]
    E = Ym - H * Um[:, :, None]  # noise on the input counts as well
    scatter = np.einsum("pfc,pfd->fcd", E, E.conj()) / (count * (count - 1))
    cov = np.divide(scatter, power[lines][:, None, None], dtype=complex)
    signal = np.abs(H) ** 2 * power[lines][:, None]
    total = signal + count * np.einsum("fcc->fc", scatter).real
    return Frf(
        f=lines.astype(float) * (fs / period.samples),
        H=H,
        channels=tuple(outputs),
        input=input,
        coherence=signal / np.where(total > 0.0, total, 1.0),
        cov=guarded_covariance(cov, np.ones(lines.size, dtype=bool)),
        nu=np.full(lines.size, count - 1.0),
        correlation=(),
        estimator="periodic",
        segments=count,
        notes=(f"{count} periods of {period.samples} samples, {lines.size} excited lines",),
    )


def _lines(name: str, x: Array, n: int, period: PeriodicPart, skip: int) -> Complex:
    """Return the (periods, samples // 2 + 1) transforms of the periods that are used."""
    if np.shape(x) != (n,):
        raise ValueError(f"channel '{name}' has shape {np.shape(x)}; the input has ({n},)")
    first, last = period.start + skip * period.samples, period.start + period.count * period.samples
    if not np.isfinite(x[first:last]).all():
        raise ValueError(f"channel '{name}' holds NaN or inf between samples {first} and {last}")
    return np.asarray(scipy.fft.rfft(x[first:last].reshape(-1, period.samples), axis=1))
