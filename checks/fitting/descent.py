"""Least squares by Levenberg's damped Gauss-Newton steps, on normal equations, inside bounds.

x counts in prior standard deviations, so a damping of one is what another prior would do: it holds what the data hardly
tell and leaves alone what they tell well. Such problems are sloppy, their valleys long and bent, and damping in
proportion to the curvature (Marquardt) lets steps run far along them ([TRANSTRUM12]). Damping
by Nielsen's rule ([MADSEN04] 3.2). The priors
keep the normal matrix well conditioned, so a step costs a small factor and not the decomposition of the Jacobian.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import linalg

from checks.arrays import Array

FIRST = 1e-3  # damping, beside priors of one
ROUNDING = 1e-13
MOST = 1e8  # no step is as short
NEAR = 0.01  # of half a squared standard deviation: the place is known to a seventh of its uncertainty
SETTLED = 1e-4  # of that: a thousandth of the uncertainty
LONGEST = 10.0  # of a step, where the last one showed that it was too short
STRAIGHT = 0.25  # of the expected fall: less is a valley that bends, along which the cost tells nothing any more


class Residuals(Protocol):
    """residual (n,) and jacobian (n, p) at x (p,), within bounds lo, hi (p,). A residual that is not finite says that x
    cannot be."""

    def residual(self, x: Array) -> Array: ...

    def jacobian(self, x: Array) -> Array: ...

    def bounds(self) -> tuple[Array, Array]: ...


@dataclass(frozen=True, eq=False)
class Descent:
    """x (p,), cost (half the sum of squares). settled: no step leads further down. known: the normal matrix at x, where
    the search has taken it already."""

    problem: Residuals
    x: Array
    cost: float
    settled: bool
    steps: int
    known: Array | None = None

    @property
    def normal(self) -> Array:
        """(p, p) J'J at x: asked for only where a search ends for good."""
        if self.known is not None:
            return self.known
        J = self.problem.jacobian(self.x)
        return np.asarray(J.T @ J)


def descend(problem: Residuals, x: Array, steps: int, near: float = NEAR) -> Descent:
    """At most so many steps from x to where the cost would fall by less than `near`, and as far beyond as it goes
    without a detour."""
    lo, hi = problem.bounds()
    x = np.clip(x, lo, hi)
    r = problem.residual(x)
    cost, damping, growth, stretch = 0.5 * float(r @ r), FIRST, 2.0, 1.0
    settled, moved = False, True
    for taken in range(steps):
        if moved:
            A, g = _normal(problem, x, r)
        new, expected = _step(A, g, x, damping, lo, hi)
        settled = settled or (expected if damping == FIRST else _step(A, g, x, FIRST, lo, hi)[1]) < near
        if stretch * expected < SETTLED * near:
            return Descent(problem, x, cost, settled, taken, A)
        slope = -float(g @ (new - x))
        new = np.clip(x + stretch * (new - x), lo, hi)
        trial = problem.residual(new)
        lower = 0.5 * float(trial @ trial)
        gain = (cost - lower) / expected if np.isfinite(lower) else -1.0
        moved = gain > 0.0
        stretch = _stretch(slope, stretch, cost - lower) if moved else 1.0
        if moved:
            x, r, cost = new, trial, lower
            damping, growth = damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
        else:
            damping, growth = damping * growth, 2.0 * growth
        if (settled and gain < STRAIGHT) or damping > MOST:
            return Descent(problem, x, cost, settled, taken + 1)
    return Descent(problem, x, cost, settled, steps)


def _stretch(slope: float, taken: float, fall: float) -> float:
    """By how much the next step should be longer than that of Gauss and Newton, as the last one shows: where residuals
    curve away, J'J overstates the curvature, and step after step would stop at a part of the way."""
    curvature = 2.0 * (taken * slope - fall) / taken**2
    return LONGEST if curvature * LONGEST <= slope else max(slope / curvature, 1.0)


def _normal(problem: Residuals, x: Array, r: Array) -> tuple[Array, Array]:
    J = problem.jacobian(x)
    return J.T @ J, J.T @ r


def _step(A: Array, g: Array, x: Array, damping: float, lo: Array, hi: Array) -> tuple[Array, float]:
    """The next x, inside the bounds, and by how much the cost should fall on the way. What lies on a bound and would
    leave it stays there."""
    free = ~(((x <= lo) & (g > 0.0)) | ((x >= hi) & (g < 0.0)))
    part = A[np.ix_(free, free)]
    held = part + np.diag(damping + ROUNDING * np.diag(part))
    move = np.zeros_like(x)
    move[free] = linalg.solve(held, -g[free], assume_a="pos", check_finite=False)
    new = np.clip(x + move, lo, hi)
    moved = new - x
    return new, -float(g @ moved + 0.5 * moved @ A @ moved)
