"""Part of a record that the drive does not explain, block by block of the spectrum and in time.

In each block of neighbouring bins Y = G U + T with polynomials G and T of the frequency, as in the local polynomial
method ([PS12] 7.2), but blocks do not overlap: a projection instead of a fit about every bin."""

from dataclasses import dataclass

import numpy as np
import scipy.fft

from checks.arrays import Array, Complex
from checks.signals.spectral.transform import transform

BINS, ORDER = 24, 3  # of the spectrum at once, and of the polynomials for response and transient
LEAST_BLOCKS = 20  # of a record that is long enough
SHARE = BINS / (BINS - 2 * (ORDER + 1))  # of the power of a bin over its remainder after the projection


@dataclass(frozen=True, eq=False)
class DrivePart:
    """Part of a record that its drive explains. n: number of used samples, a length that transforms fast; Q (B, BINS, 2
    (ORDER + 1)): orthonormal basis of that part in each of B blocks."""

    n: int
    Q: Complex

    @classmethod
    def of(cls, drive: Array) -> "DrivePart | None":
        """Return the part that a drive (N,) explains; None if the record is too short."""
        n = scipy.fft.prev_fast_len(drive.size, real=True)
        U = blocks(beginning(drive, n))
        if len(U) < LEAST_BLOCKS:
            return None
        powers = np.vander(np.linspace(-1.0, 1.0, BINS), ORDER + 1)
        explaining = np.concatenate([U[..., None] * powers, np.broadcast_to(powers, (*U.shape, ORDER + 1))], axis=2)
        return cls(n, np.linalg.qr(explaining)[0])

    def off(self, X: Complex) -> Complex:
        """Return blocks X (B, BINS) without the part that the drive explains."""
        return X - (self.Q @ (np.conj(self.Q.transpose(0, 2, 1)) @ X[..., None]))[..., 0]

    def left(self, y: Array) -> Complex:
        """Return the blocks (B, BINS) of a channel (N,) without the part that the drive explains."""
        return self.off(blocks(beginning(y, self.n)))

    def in_time(self, E: Complex) -> Array:
        """Return blocks (B, BINS) as a series (n,)."""
        spectrum = np.zeros(self.n // 2 + 1, dtype=complex)
        spectrum[1 : E.size + 1] = E.ravel()
        return np.asarray(scipy.fft.irfft(spectrum, self.n))


def beginning(x: Array, n: int) -> Array:
    """Return the first samples of x, x itself if these are all."""
    return x if x.size == n else x[:n]


def blocks(x: Array) -> Complex:
    """Return the transform of x (N,) as blocks (B, BINS), from the first bin above 0 Hz on."""
    X = transform(x)[1:]
    whole = X.size // BINS * BINS
    return np.asarray(X[:whole].reshape(-1, BINS))


def power(E: Complex) -> Array:
    """Return the mean power (B,) of a bin of each block, corrected for the degrees of freedom of the projection."""
    return np.asarray(np.maximum(SHARE * np.mean(np.abs(E) ** 2, axis=1), 1e-300))
