"""Modes far above the band, whose part of a response is so smooth that a few frequencies determine it.

Below such a mode the real part of its response, and the imaginary part over w, are polynomials in w^2 but for an error
that falls with every Chebyshev point: for a pole at FAR of the band's end (in w^2) by 7.9 a point, the semi-axes' sum
of the ellipse through it. Of the 75 modes of a strut with uncertain ones 64 lie there."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex

FAR = 2.5  # of the band's end, in w^2
POINTS = 14  # 7.9^-14 = 3e-13, which is round-off beside a sum over modes
MANY = 3 * POINTS  # frequencies, below which nothing is saved
Basis = Callable[[NDArray[np.bool_], Array], Complex]  # which modes, frequencies (S,) -> (k, n, S)


def is_far(w2: Array, rate: Array, w: Array) -> NDArray[np.bool_]:
    """Return which of the modes (n,) 1 / (w2 + rate s + s^2) need few points of w (F,) [rad/s]. An overdamped one has a
    slow pole, whatever its w2."""
    if w.size < MANY or not w.max() > 0.0:
        return np.zeros(w2.size, dtype=bool)
    return np.asarray((w2 > FAR * w.max() ** 2) & (rate**2 < 4.0 * w2))


def sum_sections(A: Array, basis: Basis, swift: NDArray[np.bool_], w: Array) -> Complex:
    """Return the sums (m, S) at w (S,) [rad/s] of A (m, k, n) times k functions of each of n modes; the `swift` modes
    are summed at a few frequencies.

    One real product by whatever is complex in it, real and imaginary parts side by side."""
    rows = _flat(A[..., ~swift])
    sums = product(rows, basis(~swift, w).reshape(rows.shape[1], w.size))
    if swift.any():
        few, weights = _points(np.ascontiguousarray(w).tobytes())
        there = product(_flat(A[..., swift]), basis(swift, few).reshape(-1, few.size))
        sums.real += there.real @ weights
        sums.imag += (there.imag / few @ weights) * w
    return sums


def _flat(A: Array) -> Array:
    """Return A (m, k, n) with its last two axes as one (m, k n)."""
    return A.reshape(len(A), A.shape[1] * A.shape[2])


def product(A: Array, z: Complex) -> Complex:
    """Return the product of a (m, n) real and z (..., n, S) complex, each z in one piece."""
    return np.asarray((A @ z.view(float)).view(complex))


@lru_cache(maxsize=64)
def _points(band: bytes) -> tuple[Array, Array]:
    """Return Chebyshev points (K,) [rad/s] in w^2 of the band that ends with w (F,), given as its bytes, and their
    weights (K, F) at w. Cached, because a search asks for the same few bands all the time."""
    w = np.frombuffer(band)
    top, order = w.max() ** 2, np.arange(POINTS)
    angles = (order + 0.5) * np.pi / POINTS
    there = np.arccos(np.clip(2.0 * w * w / top - 1.0, -1.0, 1.0))
    share = np.where(order == 0, 1.0, 2.0) / POINTS
    weights = (np.cos(np.outer(angles, order)) * share) @ np.cos(np.outer(order, there))
    return np.sqrt(0.5 * top * (1.0 + np.cos(angles))), weights
