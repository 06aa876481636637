"""Averaged cross-spectra of all channels in one pass (Welch)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from checks.arrays import Array, Complex

BATCH_SAMPLES = 320_000  # samples of all channels transformed at once: more leave the core, fewer cost in calls


@dataclass(frozen=True, eq=False)
class Spectra:
    """Averaged one-sided spectral densities of M channels over K segments.

    f : (F,) [Hz]. S : (F, M, M), S[:, i, j] = mean of X_i conj(X_j) [unit_i unit_j / Hz], Hermitian; as
    `scipy.signal.csd(x_j, x_i)`, which conjugates its first operand.
    effective : number of independent segments that carry the same information.
    correlation : |rho|^2 of neighbouring bins at 1, 2, ... bins, 0 beyond."""

    f: Array
    S: Complex
    segments: int
    effective: float
    correlation: tuple[float, ...]


def spectra(columns: Sequence[Array], fs: float, nperseg: int) -> Spectra:
    """Return the spectra of channels (N,) that were sampled together at fs [Hz].

    Periodic Hann window of `nperseg` samples, the mean of each segment removed, half of the samples shared, which are
    the defaults of scipy.signal.welch. Raises ValueError for fewer than two segments, unequal lengths, NaN and inf."""
    if nperseg < 4:
        raise ValueError(f"segments of {nperseg} samples: need 4 or more")
    if not (np.isfinite(fs) and fs > 0):
        raise ValueError(f"sampling frequency is {fs} Hz; expected a positive number")
    sizes = {np.shape(c) for c in columns}
    if len(sizes) != 1 or len(next(iter(sizes))) != 1:
        raise ValueError(f"expected {len(columns)} arrays of one equal length, got shapes {sorted(sizes)}")
    n, hop = len(columns[0]), nperseg - nperseg // 2
    count = max(0, (n - nperseg) // hop + 1)
    if count < 2:
        raise ValueError(
            f"{n} samples hold {count} segment(s) of {nperseg} samples every {hop}; "
            "an average with a variance needs two or more"
        )
    window, correlation = _window(nperseg)
    sums = _sums([sliding_window_view(c, nperseg)[::hop] for c in columns], window)
    bad = ~np.isfinite(np.einsum("fmm->m", sums))
    if bad.any():
        raise ValueError(f"channel(s) {np.flatnonzero(bad).tolist()} hold NaN or inf (counted from 0, the input)")
    sums *= 2.0 / (count * fs * np.sum(window**2))
    sums[0] /= 2.0
    if nperseg % 2 == 0:
        sums[-1] /= 2.0
    f = np.arange(len(sums), dtype=float) * (fs / nperseg)
    return Spectra(f, sums, count, _effective(count, window, hop), correlation)


def _sums(frames: Sequence[Array], window: Array) -> Complex:
    """Return the (F, M, M) sums of X_i conj(X_j) over segments (K, nperseg) of each channel, in memory channel by
    channel as they are worked with."""
    channels, (count, nperseg) = len(frames), frames[0].shape
    batch = max(1, BATCH_SAMPLES // (channels * nperseg))
    work = _work_space(channels, batch, nperseg)
    sums = np.zeros((channels, channels, nperseg // 2 + 1), dtype=complex)
    with np.errstate(invalid="ignore"):  # NaN and inf come through to `spectra`, which names their channel
        for first in range(0, count, batch):
            _add([f[first : first + batch] for f in frames], window, work, sums)
    diagonal = np.arange(channels)  # on it are the sums of the squared real and imaginary parts
    sums[diagonal, diagonal] = sums[diagonal, diagonal].real + sums[diagonal, diagonal].imag
    for i, j in zip(*np.tril_indices(channels, -1), strict=True):
        np.conjugate(sums[i, j], out=sums[j, i])
    return sums.transpose(2, 0, 1)


def _add(frames: Sequence[Array], window: Array, work: tuple[Array, Complex, Complex], total: Complex) -> None:
    """Add the products of a batch of segments to the sums (M, M, F), on their diagonal and below."""
    n = len(frames[0])
    windowed, X, product = work[0][:, :n], work[1][:, :n], work[2][:n]
    for out, frame in zip(windowed, frames, strict=True):
        np.subtract(frame, _means(frame)[:, None], out=out)
        out *= window
    np.fft.rfft(windowed, out=X)
    parts, ones, sums = product.view(float), np.ones(n), total.view(float)
    for j in range(len(X)):
        np.square(X[j].view(float), out=parts)
        np.add(sums[j, j], np.dot(ones, parts), out=sums[j, j])
        conjugate = np.conjugate(X[j], out=X[j])  # X[j] itself is not needed after its turn
        for i in range(j + 1, len(X)):
            np.multiply(X[i], conjugate, out=product)
            np.add(sums[i, j], np.dot(ones, parts), out=sums[i, j])


def _means(frame: Array) -> Array:
    """Return the means (K,) of segments (K, nperseg). If half is shared, each sample is summed once, not twice."""
    nperseg = frame.shape[1]
    hop = nperseg - nperseg // 2
    if 2 * hop != nperseg:
        return np.asarray(np.einsum("kn->k", frame) / nperseg)
    halves = np.append(np.einsum("kn->k", frame[:, :hop]), frame[-1, hop:].sum())
    return np.asarray((halves[:-1] + halves[1:]) / nperseg)


def _effective(K: int, w: Array, hop: int) -> float:
    """Return the effective number of segments n = K / (1 + 2 sum rho_m^2 (K - m)/K): overlapping segments share
    information (Welch 1967, eq. 17).

    rho_m : correlation of the window with itself m hops later; 1/6 for Hann at half overlap."""
    shifts = range(1, min(K - 1, (w.size - 1) // hop) + 1)
    rho = [float(w[m * hop :] @ w[: -m * hop] / (w @ w)) for m in shifts]
    return K / (1.0 + 2.0 * sum(r * r * (K - m) / K for m, r in zip(shifts, rho, strict=True)))


@lru_cache(maxsize=8)
def _window(n: int) -> tuple[Array, tuple[float, ...]]:
    """Return the Hann window (n,) and its `bin_correlation`. Cached: a unit's records have one or two lengths."""
    window = hann(n)
    window.setflags(write=False)
    return window, bin_correlation(window)


def hann(n: int) -> Array:
    """Return the periodic Hann window (n,) of `scipy.signal.get_window`, without its second of loading."""
    return np.asarray(0.5 + 0.5 * np.cos(np.linspace(-np.pi, np.pi, n + 1))[:-1])


def _work_space(channels: int, batch: int, nperseg: int) -> tuple[Array, Complex, Complex]:
    """Return arrays for the windowed segments (M, K, nperseg), their transforms (M, K, F) and a product of two (K, F).

    All from one block: many small arrays come as small fresh pages, which cost as much time as the transforms. Products
    are taken pair by pair: small matrices of all pairs, bin by bin, would need the transforms in another order, and
    bringing them into it costs more than all products."""
    bins = nperseg // 2 + 1
    shapes = ((channels, batch, (nperseg + 1) // 2), (channels, batch, bins), (batch, bins))
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    pieces = np.split(np.empty(ends[-1], dtype=complex), ends[:-1])
    frames, transforms, product = (p.reshape(shape) for p, shape in zip(pieces, shapes, strict=True))
    return frames.view(float)[..., :nperseg], transforms, product


def bin_correlation(window: Array) -> tuple[float, ...]:
    """Return |rho|^2 between transforms of windowed noise 1, 2, ... bins apart, while above 0: 4/9, 1/36 for Hann."""
    power = np.abs(np.fft.fft(window**2)) ** 2
    rho2 = power[1:16] / power[0]
    last = int(np.flatnonzero(rho2 > 1e-6)[-1]) + 1 if (rho2 > 1e-6).any() else 0
    return tuple(float(r) for r in rho2[:last])
