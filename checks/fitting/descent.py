"""Least squares by Levenberg's damped Gauss-Newton steps, on normal equations, inside bounds.

x counts in prior standard deviations, so a damping of one acts like another prior: it holds parameters that the data
hardly determine and hardly affects the others. Such problems are sloppy, their valleys long and bent, and damping in
proportion to the curvature (Marquardt) lets steps run far along them ([TRANSTRUM12]). Damping by Nielsen's rule
([MADSEN04] 3.2). The priors keep the normal matrix well conditioned, so a step costs a small factor and not the
decomposition of the Jacobian."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import linalg

from checks.arrays import Array

FIRST = 1e-3  # damping, beside priors of one
ROUNDING = 1e-13
MOST = 1e8  # no step is as short
LONGEST = 10.0  # of a step, if the last one showed that it was too short
STRAIGHT = 0.25  # of the expected fall: less is a valley that bends, along which the cost has no information


@dataclass(frozen=True)
class Precision:
    """How far down a search goes, in half a squared standard deviation. near: it has settled if no step promises more;
    end: it ends there if it arrives without a detour."""

    near: float
    end: float


LOOSE = Precision(0.1, 0.01)  # where one place only leads to the next
CLOSE = Precision(0.01, 1e-3)  # known to a seventh of its uncertainty: where places are compared
EXACT = Precision(0.01, 1e-6)  # known to a thousandth: where a value is stated


class Residuals(Protocol):
    """residual (n,) at x (p,), within bounds lo, hi (p,), and J'J (p, p) and J'r (p,) of its Jacobian J (n, p) there. A
    residual that is not finite marks an impossible x."""

    def residual(self, x: Array) -> Array: ...

    def normal(self, x: Array, r: Array) -> tuple[Array, Array]: ...

    def bounds(self) -> tuple[Array, Array]: ...


@dataclass(frozen=True, eq=False)
class Descent:
    """x (p,), cost (half the sum of squares). settled: no step leads further down. known: the normal matrix at x, if
    computed."""

    problem: Residuals
    x: Array
    cost: float
    settled: bool
    steps: int
    known: Array | None = None

    @property
    def normal(self) -> Array:
        """Return J'J (p, p) at x; only computed when a search has ended."""
        if self.known is not None:
            return self.known
        return self.problem.normal(self.x, self.problem.residual(self.x))[0]


def descend(problem: Residuals, x: Array, steps: int, to: Precision = CLOSE) -> Descent:
    """Descend from x by at most so many steps, until the precision is reached."""
    lo, hi = problem.bounds()
    x = np.clip(x, lo, hi)
    r = problem.residual(x)
    cost, damping, growth, stretch = 0.5 * float(r @ r), FIRST, 2.0, 1.0
    settled, moved = False, True
    for taken in range(steps):
        if moved:
            A, g = problem.normal(x, r)
        new, expected = _step(A, g, x, damping, lo, hi)
        settled = settled or (expected if damping == FIRST else _step(A, g, x, FIRST, lo, hi)[1]) < to.near
        if stretch * expected < to.end:
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
    """Return the factor by which the next step should be longer than a Gauss-Newton step, judged by the last one: where
    residuals curve away, J'J overstates the curvature, and step after step would stop at a part of the way."""
    curvature = 2.0 * (taken * slope - fall) / taken**2
    return LONGEST if curvature * LONGEST <= slope else max(slope / curvature, 1.0)


def _step(A: Array, g: Array, x: Array, damping: float, lo: Array, hi: Array) -> tuple[Array, float]:
    """Return the next x, inside the bounds, and the predicted fall of the cost. A parameter stays on a bound that it
    would leave."""
    free = ~(((x <= lo) & (g > 0.0)) | ((x >= hi) & (g < 0.0)))
    part = A[np.ix_(free, free)]
    held = part + np.diag(damping + ROUNDING * np.diag(part))
    move = np.zeros_like(x)
    # `linalg.solve` would warn that it is nearly singular, which the next, more damped step mends.
    move[free] = linalg.cho_solve(linalg.cho_factor(held, check_finite=False), -g[free], check_finite=False)
    new = np.clip(x + move, lo, hi)
    moved = new - x
    return new, -float(g @ moved + 0.5 * moved @ A @ moved)
