"""Residuals of a calibrated model made independent, with all that its calibrated parameters can explain taken out.

Whitened residuals and the priors' rows form one vector r (n,); J (n, p) are its derivatives by the calibrated
parameters. What is left by J, r - Q Q' r with Q R = J, does not change with any small error of the calibration, so it
is standard normal if noise, tolerance and priors are those of the model: no refit is needed to know its null.

Is anything missing, and where? Every bin's energy becomes -2 ln p, chi-square with two degrees of freedom whatever the
spread of its estimated noise; sums over windows of every width and channel are compared with chi-square, corrected for
how many were looked at.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset
from checks.fitting.prior import off_priors, prior_rows
from checks.gap.modelling.augmented import Augmented, Values

TOLD = 1.0 / (1.0 + 5.0**2)  # room of a parameter that the data alone tell to five standard deviations of its prior
WIDTHS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)
ALIKE = 6.0  # ratio of mean energies of windows that make one band
OVERLAP = 2.0  # windows that lie half over each other: tests that are not independent, counted as if they were


@dataclass(frozen=True, eq=False)
class Projected:
    """The residual without the free parameters. r (n,): 2 F C rows of the data, then one for every parameter with a
    prior; Q (n, p) orthonormal."""

    data: Dataset
    response: Augmented
    at: Values
    r: Array
    Q: Array
    names: tuple[str, ...]
    pulled: tuple[str, ...]

    @cached_property
    def modelled(self) -> Complex:
        """Return the response (F, C) at the values."""
        return self.response.frf(self.data.f, self.at, self.data.channels)

    @cached_property
    def left(self) -> Array:
        """Return the part (n,) of the residual that the calibrated parameters cannot explain."""
        return self.off(self.r)

    def off(self, x: Array) -> Array:
        """Return the rows (..., n) without their part along the parameters."""
        return x - (x @ self.Q) @ self.Q.T

    def rows(self, dH: Complex) -> Array:
        """Return the whitened and projected rows (..., n) of changes of the response (..., F, C)."""
        white = self.data.whitener(dH)
        zeros = np.zeros((*white.shape[:-1], len(self.pulled)))
        return self.off(np.concatenate([white, zeros], axis=-1))

    def by_bin(self, x: Array) -> Complex:
        """Return the data's rows of x (n,) as complex numbers (F, C): each of unit variance per real and imaginary
        part."""
        return self.data.whitener.by_bin(x[: 2 * self.data.H.size])

    @property
    def pulls(self) -> dict[str, float]:
        """Return the pulls, standard normal under the null: how far a calibrated value is pulled off its prior by data
        that it can explain no other way. A parameter that the data alone hardly tell has none: they would place it many
        standard deviations away, where no derivative holds."""
        last = len(self.pulled)
        room = 1.0 - np.sum(self.Q[-last:] ** 2, axis=1) if last else np.zeros(0)
        rest = self.left[-last:] if last else np.zeros(0)
        return {n: float(v / np.sqrt(g)) for n, v, g in zip(self.pulled, rest, room, strict=True) if g > TOLD}

    @property
    def cost(self) -> float:
        """Return half the squared residuals, before projection."""
        return 0.5 * float(self.r @ self.r)


def project(response: Augmented, data: Dataset, at: Values) -> Projected:
    """Return the projected residual at values of all free parameters. A parameter on its bound counts as free."""
    free = response.free()
    names = tuple(p.name for p in free)
    priors = [p for p in free if np.isfinite(p.sd)]
    unit = np.array([p.unit for p in free])
    rows = prior_rows(free, response.model.joint)[[names.index(p.name) for p in priors]] * unit
    white = data.whitener(response.jacobian(data.f, names, at, data.channels)) * unit[:, None]
    known = at_known(response, data, at)
    return replace(known, Q=_basis(np.hstack([white, -rows.T])), names=names)


def _basis(rows: Array) -> Array:
    """Return an orthonormal basis (n, q) of rows (p, n), without directions that differ from the others by rounding
    only."""
    J = rows.T / np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
    Q, R = np.linalg.qr(J)
    U, s, _ = np.linalg.svd(R)
    told = s > 1e-9 * s.max(initial=0.0)
    return Q if told.all() else Q @ U[:, told]


def at_known(response: Augmented, data: Dataset, at: Values) -> Projected:
    """Return the residual at values that were fitted elsewhere, without projection. If a channel holds something that
    the response lacks, taking out what the parameters could explain of it would spread it over all channels."""
    priors = [p for p in response.free() if np.isfinite(p.sd)]
    known = off_priors(priors, at, response.model.joint)
    residual = data.H - response.frf(data.f, at, data.channels)
    r = np.concatenate([data.whitener(residual), known])
    return Projected(data, response, at, r, np.zeros((r.size, 0)), (), tuple(p.name for p in priors))


@dataclass(frozen=True)
class ExcessBand:
    """Bins first..last (included) of one channel; p after correction for all windows looked at; excess: mean energy of
    a bin over what chance gives."""

    channel: str
    first: int
    last: int
    f_lo_Hz: float
    f_hi_Hz: float
    p: float
    excess: float

    @property
    def excess_dB(self) -> float:
        return 10.0 * float(np.log10(max(self.excess, 1e-12)))


@dataclass(frozen=True)
class Adequacy:
    """Whether an explanation leaves no more than chance does. p: p-value of the worst window or pull, corrected for
    multiple tests; windows: the significant ones, by rising p, without overlap; pulls: offset of each calibrated
    parameter from its prior, standard normal under the null."""

    p: float
    windows: tuple[ExcessBand, ...]
    pulls: dict[str, float]

    def adequate(self, p: float) -> bool:
        return self.p > p


def energies(projected: Projected) -> Array:
    """Return -2 ln p (F, C) of every bin, which includes the spread of the estimated noise: chi-square of two degrees
    of freedom under the null."""
    data = projected.data
    z = projected.by_bin(projected.left)
    x = 0.5 * np.abs(z) ** 2
    C = data.H.shape[1]
    share = data.noise / np.maximum(data.variance, 1e-300)
    nu = data.nu[:, None] - np.arange(C)
    finite = np.isfinite(nu)
    nu = np.where(finite, np.maximum(nu, 2.0), 1e9)
    kappa = 1.0 + share * np.where(finite, C / np.maximum(data.nu[:, None] - C, 1.0), 0.0)
    effective = nu / np.maximum(share, 1e-3) ** 2
    return np.asarray(2.0 * effective * np.log1p(x * kappa / effective))


def judge(projected: Projected, p_window: float) -> Adequacy:
    """Judge whether chance explains the residual, and list the windows with p below p_window."""
    e = energies(projected)
    channels = projected.data.channels
    found = [w for c, name in enumerate(channels) for w in _scan(e[:, c], projected.data.f, name, len(channels))]
    pulls = projected.pulls
    p_pulls = [min(1.0, 2.0 * len(pulls) * float(stats.norm.sf(abs(z)))) for z in pulls.values()]
    p_windows = min((w.p for w in found), default=1.0)
    p = min(1.0, 2.0 * min(p_windows, min(p_pulls, default=1.0)))
    return Adequacy(p, _apart([w for w in found if w.p < p_window]), pulls)


def _scan(e: Array, f: Array, channel: str, channels: int) -> list[ExcessBand]:
    """Return the windows of one channel with p < 0.05 and at least the best."""
    total = np.concatenate([[0.0], np.cumsum(e)])
    looked = channels * sum(OVERLAP * max(1, f.size // w) for w in WIDTHS if w <= f.size)
    out = []
    for width in (*[w for w in WIDTHS if w < f.size], f.size):
        first = np.arange(0, f.size - width + 1, max(1, width // 2))
        sums = total[first + width] - total[first]
        log_p = stats.chi2.logsf(sums, 2 * width) + np.log(looked)
        best = int(np.argmin(log_p))
        for k in np.flatnonzero((log_p < np.log(0.05)) | (np.arange(first.size) == best)):
            a, b = int(first[k]), int(first[k]) + width - 1
            p = float(np.exp(min(0.0, max(log_p[k], -690.0))))
            out.append(ExcessBand(channel, a, b, float(f[a]), float(f[b]), p, float(sums[k]) / (2 * width)))
    return out


def _apart(windows: list[ExcessBand]) -> tuple[ExcessBand, ...]:
    """Return windows that do not overlap, by rising p. Those whose p is too small to be compared are ordered by the
    mean energy times the root of the width, their distance from chance."""
    kept: list[ExcessBand] = []
    for w in sorted(windows, key=lambda w: (w.p, -w.excess * np.sqrt(w.last - w.first + 1))):
        if all(w.channel != k.channel or w.last < k.first or w.first > k.last for k in kept):
            kept.append(w)
    return _joined(kept)


def _joined(windows: list[ExcessBand]) -> tuple[ExcessBand, ...]:
    """Join adjacent windows of about equal excess to bands, by rising p, then by falling excess."""
    bands: list[ExcessBand] = []
    for w in sorted(windows, key=lambda w: (w.channel, w.first)):
        last = bands[-1] if bands else None
        if last is not None and last.channel == w.channel and w.first == last.last + 1 and _alike(last, w):
            bands[-1] = _both(last, w)
        else:
            bands.append(w)
    return tuple(sorted(bands, key=lambda w: (w.p, -w.excess)))


def _alike(a: ExcessBand, b: ExcessBand) -> bool:
    return max(a.excess, b.excess) <= ALIKE * min(a.excess, b.excess)


def _both(a: ExcessBand, b: ExcessBand) -> ExcessBand:
    n, m = a.last - a.first + 1, b.last - b.first + 1
    excess = (n * a.excess + m * b.excess) / (n + m)
    return ExcessBand(a.channel, a.first, b.last, a.f_lo_Hz, b.f_hi_Hz, min(a.p, b.p), excess)
