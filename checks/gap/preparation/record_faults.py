"""Checks before any search: polarity, exchanged channels, and samples that one channel is off by.

They compare the measured responses with the model's at its prior values, coarsely: sign, size and phase slope over many
bins, which no plausible error of a parameter changes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset
from checks.model.model import Model

SIGN_HZ = 150.0  # below, delays turn no phase round and few of the strut's modes lie
OPPOSED = -0.5  # mean cosine of the phase against the model: zeros and poles elsewhere turn some bins, not most
DEAD = 30.0  # times too small: no scale and no filter of the library takes so much
AGREED = 0.6  # share of bins whose phases an offset must explain
FAR = 0.5  # of ln |H|: a mean distance by which a channel is not what its name says
BETTER = 0.4  # of the distance that is left when channels are exchanged
WHOLE = 0.2  # samples: how near to a whole number an offset is
MOST_SAMPLES = 20
CORNERS = 80  # of lags and resonances that turn the phase as a delay would: 6 % apart


@dataclass(frozen=True)
class RecordFault:
    """A fault of the records. effect: its name in gap.json; words: a sentence."""

    effect: str
    channels: tuple[str, ...]
    parameters: Mapping[str, float]
    words: str
    exchanges: bool = False  # two channels with each other


def find_exchanged(data: Dataset, model: Model) -> tuple[str, str] | None:
    """Return the two channels that fit the model much better when exchanged, or None."""
    H = model.frf(data.f, channels=data.channels)
    size = np.abs(_log_ratio(data.H[:, :, None], H[:, None, :]))  # (F, measured, modelled)
    d = np.minimum(size, 3.0).mean(axis=0)
    for a, b in combinations(range(len(data.channels)), 2):
        own, other = d[a, a] + d[b, b], d[a, b] + d[b, a]
        if own > 2 * FAR * 0.5 and other < BETTER * own:
            return data.channels[a], data.channels[b]
    return None


def find_inverted(data: Dataset, model: Model) -> tuple[str, ...]:
    """Return the channels whose phase is opposite to the model's in most bins that are not noise."""
    low = data.f < SIGN_HZ
    if low.sum() < 5:
        low = np.arange(data.f.size) < 20
    H = model.frf(data.f[low], channels=data.channels)
    measured, noise = data.H[low], data.noise[low]
    cosine = _direction(measured * H.conj()).real
    trust = np.abs(measured) ** 2 > 9.0 * noise
    mean = np.sum(cosine * trust, axis=0) / np.maximum(trust.sum(axis=0), 1)
    return tuple(c for c, m in zip(data.channels, mean, strict=True) if m < OPPOSED)


def find_dead(data: Dataset, model: Model) -> tuple[str, ...]:
    """Return the channels that respond to the drive far less than the model predicts in most bins."""
    H = model.frf(data.f, channels=data.channels)
    median = np.median(_log_ratio(data.H, H), axis=0)
    return tuple(c for c, m in zip(data.channels, median, strict=True) if m < -np.log(DEAD))


def correct(data: Dataset, fault: RecordFault) -> Dataset:
    """Return the data corrected for a fault of sign or of exchanged channels."""
    return (
        with_names(data, (fault.channels[0], fault.channels[1]))
        if fault.exchanges
        else with_signs(data, fault.channels)
    )


def find_offsets(data: Dataset, model: Model, fs: float) -> dict[str, int]:
    """Return by channel the whole samples of fs [Hz] by which it lags the others (which define zero).

    A channel is listed only if no other change of phase explains it as well: a lag of first order, or a resonance above
    which the channel changes sign."""
    H = model.frf(data.f, channels=data.channels)
    grid = np.arange(-MOST_SAMPLES, MOST_SAMPLES + 0.05, 0.05)
    delays = np.exp(-2j * np.pi * np.outer(grid, data.f / fs))
    late, only = [], []
    for c in range(len(data.channels)):
        trust = np.abs(data.H[:, c]) ** 2 > 9.0 * data.noise[:, c]
        unit = _direction(data.H[trust, c] / H[trust, c])
        score = (delays[:, trust].conj() @ unit).real
        others = (_direction(_turning(data.f[trust])).conj() @ unit).real
        late.append(float(grid[np.argmax(score)]))
        # Where other modes than the model's turn the phase, no delay explains it, and the best of many means nothing.
        only.append(bool(score.max() > max(others.max(), AGREED * trust.sum())))
    common = float(np.median(late))
    found = {}
    for channel, d, sure in zip(data.channels, late, only, strict=True):
        n = round(d - common)
        if n != 0 and abs(d - common - n) < WHOLE and sure:
            found[channel] = n
    return found


def _direction(z: Complex) -> Complex:
    return np.asarray(z / np.maximum(np.abs(z), 1e-300))


def _turning(f: Array) -> Complex:
    """Return n first-order lags (n, F), and resonances of 2 % damping, with corners from 100 Hz to 10 kHz."""
    x = 1j * f / np.geomspace(1e2, 1e4, CORNERS)[:, None]
    return np.concatenate([1.0 / (1.0 + x), 1.0 / (1.0 + 0.04 * x + x * x)])


def with_signs(data: Dataset, channels: tuple[str, ...]) -> Dataset:
    """Return the data with the sign of some channels changed."""
    sign = np.array([-1.0 if c in channels else 1.0 for c in data.channels])
    return replace(data, H=data.H * sign, cov=data.cov * sign[:, None] * sign)


def with_names(data: Dataset, pair: tuple[str, str]) -> Dataset:
    """Return the data with two channels exchanged."""
    other = dict(zip(pair, reversed(pair), strict=True))
    return replace(data.select(other.get(c, c) for c in data.channels), channels=data.channels)


def with_offsets(data: Dataset, samples: Mapping[str, int], fs: float) -> Dataset:
    """Return the data with channels moved back by whole samples."""
    late = np.array([samples.get(c, 0) for c in data.channels])
    factor = np.exp(2j * np.pi * np.outer(data.f / fs, late))
    return replace(data, H=data.H * factor, cov=data.cov * factor[:, :, None] * factor[:, None, :].conj())


def _log_ratio(a: Complex, b: Complex) -> Array:
    return np.asarray(np.log(np.maximum(np.abs(a), 1e-300)) - np.log(np.maximum(np.abs(b), 1e-300)))
