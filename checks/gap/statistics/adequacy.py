"""Is anything missing, and where? Tests of a projected residual against chance.

Every bin's energy becomes -2 ln p, chi-square with two degrees of freedom whatever the spread of its estimated noise;
sums over windows of every width and channel are compared with chi-square, corrected for how many were looked at.
"""

from dataclasses import dataclass

import numpy as np

from checks import distributions as stats
from checks.arrays import Array
from checks.gap.statistics.projected_residual import Projected

WIDTHS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)
ALIKE = 6.0  # ratio of mean energies of windows that make one band
OVERLAP = 2.0  # windows that lie half over each other: tests that are not independent, counted as if they were


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
