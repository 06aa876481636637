"""Clocks that run apart: a channel that was sampled by another clock than the drive comes later and later, or earlier
and earlier. The response of each part of the record to the drive then has the phase of a lag that grows in proportion
to time, at all frequencies; a mode that moves turns it about its own frequency only."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from checks.arrays import Array, Complex
from checks.signals.spectral.segments import hann

PARTS = 8  # of the record, whose lags are compared
SEGMENT = 4096  # samples of a transform
DRIVEN = 1e-3  # of the largest cross power: less is not driven
FINE = 16  # places within a sample at which the lag is looked for
SURE = 8.0  # standard deviations of the mean step between two parts
STEADY = 0.25  # of a step: how far the lags may lie off a straight line
LEAST_PARTS_PER_MILLION = 2.0
ALONG = 0.6  # share of the driven bins' phases that a lag has to explain


def clock_drifts(drive: Array, channels: Mapping[str, Array]) -> dict[str, float]:
    """Return by which part each channel (N,) is sampled by a faster clock than the drive (N,): its lag grows by so much
    of the time. A channel whose lag does not grow steadily is left out; all are if the record is too short."""
    size = drive.size // PARTS
    if size < 2 * SEGMENT:
        return {}
    spectra: dict[str, list[Complex]] = {c: [] for c in channels}
    for begin in range(0, PARTS * size, size):  # the product of two names, in one order: its last bit depends on that
        before = _transforms(drive[begin : begin + size]).conj()
        for c, y in channels.items():
            spectra[c].append(np.multiply(before, _transforms(y[begin : begin + size])).sum(axis=0))
    return {c: drift for c, parts in spectra.items() if (drift := _drift(parts, size)) is not None}


def _transforms(x: Array) -> Complex:
    """Return the transforms of segments of which neighbours share half, each without its mean."""
    segments = sliding_window_view(x, SEGMENT)[:: SEGMENT // 2]
    return np.asarray(np.fft.rfft(hann(SEGMENT) * (segments - segments.mean(axis=1, keepdims=True))))


def _drift(spectra: Sequence[Complex], size: int) -> float | None:
    """Return the drift between parts of so many samples with these cross spectra, None if it is not steady."""
    steps = [_lag(b * np.conj(a)) for a, b in pairwise(spectra)]
    known = np.array([s for s in steps if s is not None])
    if known.size < len(steps):
        return None
    lags = np.concatenate([[0.0], np.cumsum(known)])
    k = np.arange(PARTS) - (PARTS - 1) / 2
    step = float(k @ lags / (k @ k))
    off = lags - lags.mean() - step * k
    sd = float(np.sqrt(off @ off / (PARTS - 2) / (k @ k)))
    steady = float(np.abs(off).max()) < STEADY * abs(step) * (PARTS - 1)
    drift = step / size
    return drift if steady and abs(step) > SURE * sd and abs(drift) > 1e-6 * LEAST_PARTS_PER_MILLION else None


def _lag(product: Complex) -> float | None:
    """Return by how many samples the later of two parts lags more, from the product of its cross spectrum with the
    other's conjugate; None if no lag explains the phases."""
    size = np.abs(product)
    at = np.flatnonzero(size > DRIVEN**2 * size.max())
    at = at[at > 1]
    if at.size < 20:
        return None
    phases = product[at] / size[at]
    along = np.fft.irfft(np.bincount(at, phases.real, product.size) + 1j * np.bincount(at, phases.imag, product.size))
    coarse = int(np.argmax(along))
    lag = -float(coarse if coarse <= along.size // 2 else coarse - along.size)
    turn = 2.0 * np.pi * at / SEGMENT
    turned = np.empty((2 * FINE + 1, at.size), dtype=complex)  # by a sixteenth of a sample more in each row
    turned[0], turned[1:] = phases * np.exp(1j * turn * (lag - 1.0)), np.exp(1j * turn / FINE)
    lag += int(np.argmax(np.cumprod(turned, axis=0).real.sum(axis=1))) / FINE - 1.0
    for _ in range(5):
        left = np.angle(phases * np.exp(1j * turn * lag))
        weight = 1.0 / (1.0 + (left / 0.1) ** 2)  # a zero or a resonance that noise turns counts little
        lag -= float(np.sum(weight * turn * left) / np.sum(weight * turn * turn))
    return lag if float(np.mean(np.abs(left) < 0.3)) > ALONG else None
