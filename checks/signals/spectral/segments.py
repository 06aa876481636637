"""Averaged cross-spectra of all channels in one pass (Welch), fed whole or chunk by chunk."""

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


class Segments:
    """Accumulator of the spectra of `channels` records sampled together at fs [Hz].

    Periodic Hann window of `nperseg` samples, the mean of each segment removed, half of the samples shared, which are
    the defaults of scipy.signal.welch. Memory does not grow with the length of the record."""

    def __init__(self, channels: int, fs: float, nperseg: int) -> None:
        if nperseg < 4:
            raise ValueError(f"segments of {nperseg} samples: need 4 or more")
        if not (np.isfinite(fs) and fs > 0):
            raise ValueError(f"sampling frequency is {fs} Hz; expected a positive number")
        self.fs, self.nperseg, self.hop = fs, nperseg, nperseg - nperseg // 2
        self.count = self.samples = 0
        self._window, self._correlation = _window(nperseg)
        self._batch = max(1, BATCH_SAMPLES // (channels * nperseg))
        bins = nperseg // 2 + 1
        self._sum = np.zeros((channels, channels, bins), dtype=complex)  # see `_hermitian`
        self._frames, self._transforms, self._product = _work_space(channels, self._batch, nperseg)
        self._tail = np.empty((channels, 0))

    def feed(self, columns: Sequence[Array]) -> None:
        """Add the next samples: one (n,) array per channel, any n."""
        sizes = {np.shape(c) for c in columns}
        if len(columns) != len(self._sum) or len(sizes) != 1 or len(next(iter(sizes))) != 1:
            raise ValueError(f"expected {len(self._sum)} arrays of one equal length, got shapes {sorted(sizes)}")
        self.samples += len(columns[0])
        if self._tail.shape[1]:
            columns = [np.concatenate(pair) for pair in zip(self._tail, columns, strict=True)]
        used = self._add_all(columns)
        self._tail = np.array([c[used:] for c in columns], dtype=float)

    def _add_all(self, columns: Sequence[Array]) -> int:
        """Add every whole segment; return the number of samples that no later segment needs."""
        whole = max(0, (len(columns[0]) - self.nperseg) // self.hop + 1)
        if whole:
            frames = [sliding_window_view(c, self.nperseg)[:: self.hop] for c in columns]
            with np.errstate(invalid="ignore"):  # NaN and inf come through to `spectra`, which names their channel
                for first in range(0, whole, self._batch):
                    self._add([f[first : first + self._batch] for f in frames])
        self.count += whole
        return whole * self.hop

    def _add(self, frames: Sequence[Array]) -> None:
        n = len(frames[0])
        windowed, X, product = self._frames[:, :n], self._transforms[:, :n], self._product[:n]
        for out, frame in zip(windowed, frames, strict=True):
            mean = self._means(frame)
            np.subtract(frame, mean[:, None], out=out)
            out *= self._window
        np.fft.rfft(windowed, out=X)
        parts, ones, sums = product.view(float), np.ones(n), self._sum.view(float)
        for j in range(len(X)):
            np.square(X[j].view(float), out=parts)
            np.add(sums[j, j], np.dot(ones, parts), out=sums[j, j])
            conjugate = np.conjugate(X[j], out=X[j])  # X[j] itself is not needed after its turn
            for i in range(j + 1, len(X)):
                np.multiply(X[i], conjugate, out=product)
                np.add(sums[i, j], np.dot(ones, parts), out=sums[i, j])

    def _means(self, frame: Array) -> Array:
        """Return the means (K,) of segments (K, nperseg). If half is shared, each sample is summed once, not twice."""
        hop = self.hop
        if 2 * hop != self.nperseg:
            return np.asarray(np.einsum("kn->k", frame) / self.nperseg)
        halves = np.append(np.einsum("kn->k", frame[:, :hop]), frame[-1, hop:].sum())
        return np.asarray((halves[:-1] + halves[1:]) / self.nperseg)

    def spectra(self) -> Spectra:
        """Return the spectra of the samples so far. Raises ValueError for fewer than two segments, NaN and inf."""
        if self.count < 2:
            raise ValueError(
                f"{self.samples} samples hold {self.count} segment(s) of {self.nperseg} samples every {self.hop}; "
                "an average with a variance needs two or more"
            )
        sums = self._hermitian()
        bad = ~np.isfinite(np.einsum("fmm->m", sums))
        if bad.any():
            raise ValueError(f"channel(s) {np.flatnonzero(bad).tolist()} hold NaN or inf (counted from 0, the input)")
        sums *= 2.0 / (self.count * self.fs * np.sum(self._window**2))
        sums[0] /= 2.0
        if self.nperseg % 2 == 0:
            sums[-1] /= 2.0
        f = np.arange(len(sums), dtype=float) * (self.fs / self.nperseg)
        return Spectra(f, sums, self.count, self.effective, self._correlation)

    def _hermitian(self) -> Complex:
        """Return the (F, M, M) sums of X_i conj(X_j), in memory channel by channel as they are worked with.

        Below the diagonal they are as summed; on it are the sums of the squared real and imaginary parts."""
        sums = self._sum.copy()
        diagonal = np.arange(len(sums))
        sums[diagonal, diagonal] = self._sum[diagonal, diagonal].real + self._sum[diagonal, diagonal].imag
        for i, j in zip(*np.tril_indices(len(sums), -1), strict=True):
            np.conjugate(sums[i, j], out=sums[j, i])
        return sums.transpose(2, 0, 1)

    @property
    def effective(self) -> float:
        """Return the effective number of segments n = K / (1 + 2 sum rho_m^2 (K - m)/K): overlapping segments share
        information (Welch 1967, eq. 17).

        rho_m : correlation of the window with itself m hops later; 1/6 for Hann at half overlap."""
        K, w = self.count, self._window
        shifts = range(1, min(K - 1, (self.nperseg - 1) // self.hop) + 1)
        rho = [float(w[m * self.hop :] @ w[: -m * self.hop] / (w @ w)) for m in shifts]
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
