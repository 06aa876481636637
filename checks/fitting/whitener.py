"""Residuals made independent and of unit variance, for noise and for a model that is a little wrong.

A tolerance t: the model's response may be wrong by a factor 1 + d(f), |d| about t, in every channel by its own. Such an
error is smooth over some range of frequencies, so many bins do not average it away. The width of that range is unknown,
so there are three scales, each with the variance t^2 / 2 of an error that lies anywhere within |d| <= t:

    wide    4 octaves: gain errors
    middle  half an octave: a mode beyond the band, a static residual
    narrow  2 % of f, the width of a mode: a resonance with a slightly different frequency or damping

The first two are random smooth functions (cosine bumps on log f), marginalised exactly. The narrow one is as good as
independent for parameters that act over a mode's width or more, when each bin's variance is raised by the number of
bins that share one error. So the intervals hold for an error of any one scale that stays below t, and are wider than
they had to be for a model that is exact."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from checks.arrays import Array, Complex

SCALES_OCTAVES = (4.0, 0.5)
NARROW = 0.02  # of f
SHARE = 0.5  # of t^2: |d| <= t, anywhere in that disc


@dataclass(frozen=True, eq=False)
class Whitener:
    """Weights of residuals. inverse (F, C, C): inverse Cholesky factors of the covariance that is independent from bin
    to bin; U (2FC, m), shrink (m,): directions of the smooth error and by how much less they count."""

    inverse: Complex
    U: Array
    shrink: Array

    def __call__(self, residual: Complex) -> Array:
        """Whiten complex residuals (..., F, C) to real numbers (..., 2 F C), independent and of unit variance: channel
        by channel, real and imaginary part of each bin side by side."""
        white = _real(self._lower(residual))
        if self.U.size:
            white -= ((white @ self.U) * self.shrink) @ self.U.T
        return white

    def independent(self, residual: Complex) -> Array:
        """Whiten by each bin's noise and tolerance, without the smooth errors; residuals in the order of a call."""
        return _real(self._lower(residual))

    def normal(self, slopes: Complex, white: Array) -> tuple[Array, Array]:
        """Return the products (P, P) and (P,) of whitened slopes (P, F, C) with each other and with whitened residuals
        (2 F C,), in half the time that whitening the slopes takes."""
        rows = _real(self._lower(slopes))
        A, g = rows @ rows.T, rows @ white
        if self.U.size:
            smooth = rows @ self.U
            A -= (smooth * (self.shrink * (2.0 - self.shrink))) @ smooth.T
            g -= smooth @ (self.shrink * (white @ self.U))
        return A, g

    def by_bin(self, white: Array) -> Complex:
        """Return such numbers (..., 2 F C) as complex ones (..., F, C), each part of unit variance."""
        F, C, _ = self.inverse.shape
        return white.view(complex).reshape(*white.shape[:-1], C, F).swapaxes(-1, -2)

    def _lower(self, r: Complex) -> Complex:
        """Return the lower triangle (..., C, F) times residuals (..., F, C), by entry: faster than small products."""
        r = r.swapaxes(-1, -2)
        out = np.empty(r.shape, dtype=complex)
        for i, row in enumerate(self._rows):
            np.multiply(row[0], r[..., 0, :], out=out[..., i, :])
            for j in range(1, i + 1):
                out[..., i, :] += row[j] * r[..., j, :]
        return out

    @cached_property
    def _rows(self) -> Complex:
        """Return the factors as (C, C, F), in memory the bins of an entry in one piece."""
        return np.ascontiguousarray(np.moveaxis(self.inverse, 0, -1))


def whitener(f: Array, H: Complex, cov: Complex, nu: Array, tolerance: float | Array) -> Whitener:
    """Return the whitener of f (F,), H (F, C), cov (F, C, C) noise with nu (F,) complex degrees of freedom; tolerance:
    one number, or (F, C)."""
    C = H.shape[1]
    independent: Complex = cov * _covariance_factor(nu, C)[:, None, None]
    d = np.arange(C)
    size = tolerance * np.sqrt(SHARE) * fill_dips(f, np.abs(H))
    independent[:, d, d] += _bins_of_one_error(f)[:, None] * size**2
    inverse = np.asarray(np.linalg.inv(np.linalg.cholesky(independent)), dtype=np.complex128)
    if not np.any(tolerance):
        return Whitener(inverse, np.zeros((2 * H.size, 0)), np.zeros(0))
    B = _smooth_errors(f, tolerance * np.sqrt(SHARE) * H, inverse)
    s2, V = np.linalg.eigh(B.T @ B)
    counts = s2 > 1e-9  # smaller ones change nothing
    U = B @ (V[:, counts] / np.sqrt(s2[counts]))
    return Whitener(inverse, U, 1.0 - 1.0 / np.sqrt(1.0 + s2[counts]))


def _covariance_factor(nu: Array, C: int) -> Array:
    """Return the factor that unbiases the inverse of an estimated covariance, too large on average by nu / (nu - C)."""
    finite = np.where(np.isfinite(nu), nu, 1.0)
    return np.where(np.isfinite(nu), finite / np.maximum(finite - C, 1.0), 1.0)


def _bins_of_one_error(f: Array) -> Array:
    """Return the number of bins (F,) that lie within the width of one narrow error, at least one."""
    if f.size < 2:
        return np.ones(f.size)
    return np.maximum(1.0, NARROW * f / np.gradient(f))


def fill_dips(f: Array, size: Array) -> Array:
    """Return the size (F, C) with every dip narrower than a narrow error filled up to its lower shoulder. At a zero
    large motions cancel, so a small part of each motion is a large part of their sum."""
    below = np.searchsorted(f, f * (1.0 - NARROW))
    above = np.searchsorted(f, f * (1.0 + NARROW), side="right")
    out = size.copy()
    for k, (a, b) in enumerate(zip(below, above, strict=True)):
        out[k] = np.minimum(size[a : k + 1].max(axis=0), size[k:b].max(axis=0))
    return out


def _smooth_errors(f: Array, size: Complex, inverse: Complex) -> Array:
    """Return the whitened responses (2FC, m) to the coefficients of the smooth errors, each of unit variance."""
    F, C = size.shape
    columns = []
    for bump in _bumps(np.log2(f)):
        for c in range(C):
            z = (inverse[:, :, c] * (bump * size[:, c])[:, None]).T / np.sqrt(2.0)
            columns += [_real(z), _real(1j * z)]
    return np.array(columns).reshape(len(columns), 2 * F * C).T


def _bumps(x: Array) -> list[Array]:
    """Return cosine bumps on x whose squares add up to one on every scale."""
    out = []
    for width in SCALES_OCTAVES:
        place = (x - x[0]) / width
        for k in range(int(np.ceil(place[-1])) + 1):
            away = np.abs(place - k)
            if (away < 1.0).any():
                out.append(np.where(away < 1.0, np.cos(0.5 * np.pi * away), 0.0))
    return out


def _real(z: Complex) -> Array:
    """Return complex numbers (..., C, F) of unit total variance as real ones (..., 2 F C) of unit variance each."""
    parts: Array = (np.sqrt(2.0) * z).reshape(*z.shape[:-2], z.shape[-2] * z.shape[-1]).view(float)
    return parts
