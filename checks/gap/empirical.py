"""Unidentified elements for the simulation: a rational element on a channel, fitted to the residual.

Poles and zeros go in by pairs, each where it explains most, all fitted anew; one is kept if it explains realisations
that were not fitted beyond chance. It does not indicate a cause.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from checks.arrays import Array, Complex
from checks.fitting.dataset import Dataset
from checks.model.unidentified import UnidentifiedElement

MOST = 4  # pairs
GRID, RATIOS = 40, (0.005, 0.03, 0.2, 0.7)  # places and damping ratios to begin from
STARTS = 3
WORTH = 12.5  # of log-likelihood on unseen records: what a name needs too
LO, HI = 1e-4, 0.95  # damping ratios of poles


@dataclass(frozen=True, eq=False)
class FittedElement:
    """covariance: of gain, then of every pair: pole's frequency, its damping, zero's frequency, its damping."""

    element: UnidentifiedElement
    covariance: Array


def fit_element(channel: str, modelled: Complex, A: Dataset, B: Dataset, modelled_B: Complex) -> FittedElement | None:
    """Return the element by which a channel of the model (F,) should be multiplied; A: to fit, B: to judge. None if no
    element explains more than chance."""
    best, x = None, np.array([0.0])
    rA, rB = _Residual(channel, modelled, A), _Residual(channel, modelled_B, B)
    least = rB.cost(x)
    for _ in range(MOST):
        tried = [
            least_squares(rA, start, bounds=rA.bounds(start), x_scale="jac", max_nfev=200) for start in rA.starts(x)
        ]
        if not tried:
            break
        found = min(tried, key=lambda r: r.cost)
        cost = rB.cost(found.x)
        if not cost < least - WORTH:
            break
        best, x, least = found, found.x, cost
    if best is None:
        return None
    slope = np.concatenate([[np.exp(x[0])], *([np.exp(f), 1.0, np.exp(g), 1.0] for f, _, g, _ in x[1:].reshape(-1, 4))])
    cov = np.linalg.pinv(best.jac.T @ best.jac, hermitian=True) * np.outer(slope, slope)
    return FittedElement(_element(channel, x), cov)


def _element(channel: str, x: Array) -> UnidentifiedElement:
    pairs = x[1:].reshape(-1, 4)
    poles = tuple((float(np.exp(f)), float(z)) for f, z, _, _ in pairs)
    zeros = tuple((float(np.exp(g)), float(z)) for _, _, g, z in pairs)
    return UnidentifiedElement(channel, float(np.exp(x[0])), poles, zeros)


class _Residual:
    """Whitened difference of one channel over x: log of the gain, then pairs of log frequency and damping ratio."""

    def __init__(self, channel: str, modelled: Complex, data: Dataset) -> None:
        c = data.channels.index(channel)
        self.channel, self.f, self.H, self.M = channel, data.f, data.H[:, c], modelled
        self.sigma = np.sqrt(0.5 * data.variance[:, c])

    def __call__(self, x: Array) -> Array:
        e = (self.H - self.M * _element(self.channel, x).factor(self.f)) / self.sigma
        return np.concatenate([e.real, e.imag])

    def cost(self, x: Array) -> float:
        r = self(x)
        return 0.5 * float(r @ r)

    def bounds(self, x: Array) -> tuple[Array, Array]:
        pairs = x.size // 4
        lo, hi = np.log(0.3 * self.f[0]), np.log(3.0 * self.f[-1])
        below = np.concatenate([[-5.0], *([lo, LO, lo, -2.0] for _ in range(pairs))])
        above = np.concatenate([[5.0], *([hi, HI, hi, 3.0] for _ in range(pairs))])
        return below, above

    def starts(self, x: Array) -> list[Array]:
        """Return x with one more pair of pole and zero, placed where it explains most of the residual to first
        order."""
        now = self.M * _element(self.channel, x).factor(self.f)
        left = (self.H - now) / self.sigma
        rated = []
        for f0 in np.geomspace(self.f[0], self.f[-1], GRID):
            for ratio in RATIOS:
                s = 1j * self.f / f0
                mode = 1.0 / (1.0 + 2.0 * ratio * s + s * s)
                J = np.array([now, now * mode, now * mode * s]).T / self.sigma[:, None]
                J2, r2 = np.vstack([J.real, J.imag]), np.concatenate([left.real, left.imag])
                (g, a, b), *_ = np.linalg.lstsq(J2, r2, rcond=None)
                rest = r2 - J2 @ np.array([g, a, b])
                up = 1.0 + a / (1.0 + g)
                if 1.0 + g > 0.0 and up > 0.05:
                    zero = (np.log(f0 * np.sqrt(up)), (2.0 * ratio + b / (1.0 + g)) / (2.0 * np.sqrt(up)))
                    new = np.concatenate([[x[0] + np.log((1.0 + g) * up)], x[1:], [np.log(f0), ratio, *zero]])
                    rated.append((float(rest @ rest), new))
        rated.sort(key=lambda each: each[0])
        return [
            np.clip(new, *(b + e for b, e in zip(self.bounds(new), (1e-9, -1e-9), strict=True)))
            for _, new in rated[:STARTS]
        ]
