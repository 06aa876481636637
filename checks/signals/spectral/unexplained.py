"""Part of a record that the drive does not explain, block by block of the spectrum and in time.

In each block of neighbouring bins Y = G U + T with polynomials G and T of the frequency, as in the local polynomial
method ([PS12] 7.2), but blocks do not overlap: a projection instead of a fit about every bin. The transient is the same
for all blocks: a block is told by its parts across all polynomials T, and the drive explains some of these."""

from dataclasses import dataclass

import numpy as np
import scipy.fft

from checks.arrays import Array, Complex
from checks.signals.spectral.transform import fast_length, transform

BINS, ORDER = 24, 3  # of the spectrum at once, and of the polynomials for response and transient
LEAST_BLOCKS = 20  # of a record that is long enough
SHARE = BINS / (BINS - 2 * (ORDER + 1))  # of the power of a bin over its remainder after the projection
_POWERS = np.vander(np.linspace(-1.0, 1.0, BINS), ORDER + 1)
_ACROSS = np.linalg.qr(_POWERS, mode="complete")[0][:, ORDER + 1 :]  # (BINS, BINS - ORDER - 1), orthonormal


@dataclass(frozen=True, eq=False)
class DrivePart:
    """Part of a record that its drive explains. n: number of used samples, a length that transforms fast; Q (B, BINS -
    ORDER - 1, ORDER + 1): orthonormal basis of that part across all transients, in each of B blocks."""

    n: int
    Q: Complex

    @classmethod
    def of(cls, drive: Array) -> "DrivePart | None":
        """Return the part that a drive (N,) explains; None if the record is too short."""
        n = fast_length(drive)
        U = blocks(drive, n)
        if len(U) < LEAST_BLOCKS:
            return None
        driven = _across((U[:, None] * _POWERS.T).reshape(-1, BINS)).reshape(len(U), ORDER + 1, -1)
        return cls(n, np.linalg.qr(driven.transpose(0, 2, 1))[0])

    def off(self, X: Complex) -> Complex:
        """Return blocks X (B, BINS) without the part that the drive explains."""
        rest = _across(X)
        rest -= (self.Q @ (np.conj(self.Q.transpose(0, 2, 1)) @ rest[..., None]))[..., 0]
        return np.asarray(rest.real @ _ACROSS.T + 1j * (rest.imag @ _ACROSS.T))

    def left(self, y: Array) -> Complex:
        """Return the blocks (B, BINS) of a channel (N,) without the part that the drive explains."""
        return self.off(blocks(y, self.n))

    def in_time(self, E: Complex) -> Array:
        """Return blocks (B, BINS) as a series (n,)."""
        spectrum = np.zeros(self.n // 2 + 1, dtype=complex)
        spectrum[1 : E.size + 1] = E.ravel()
        return np.asarray(scipy.fft.irfft(spectrum, self.n))


def _across(X: Complex) -> Complex:
    """Return the parts (B, BINS - ORDER - 1) of blocks X (B, BINS) across all polynomials."""
    return np.asarray(X.real @ _ACROSS + 1j * (X.imag @ _ACROSS))


def blocks(x: Array, n: int | None = None) -> Complex:
    """Return the transform of x (N,), or of its first n samples, as blocks (B, BINS), from the first bin above 0 Hz
    on."""
    X = transform(x, n)[1:]
    whole = X.size // BINS * BINS
    return np.asarray(X[:whole].reshape(-1, BINS))


def power(E: Complex) -> Array:
    """Return the mean power (B,) of a bin of each block, corrected for the degrees of freedom of the projection."""
    return np.asarray(np.maximum(SHARE * np.mean(np.abs(E) ** 2, axis=1), 1e-300))
