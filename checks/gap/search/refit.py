"""Many joint fits, quickly: few steps first for every start, the rest for the promising ones only.

The last fit of what is reported is `checks.fitting.fit.fit` on all bins; this one only finds where it begins.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import LinAlgWarning

from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.fitting.descent import descend
from checks.fitting.fit import work_of
from checks.fitting.prior import prior_rows
from checks.gap.modelling.augmented import Augmented
from checks.gap.search.held_scatter import scatter_of

# A sharp peak only pulls the model's peak once they overlap, so a fit first runs with a model that may be far off,
# where peaks are broad in proportion, and then with less and less (found on drawn struts: 16 of 16 instead of 10 of
# 16).
ANNEAL = (0.3, 0.1, 0.03)
ANNEAL_STEPS = 5


@dataclass(frozen=True, eq=False)
class Refit:
    """An unfinished fit: values by name, cost (half the squared whitened residuals and priors). settled: no step leads
    further down; work: what it took since it began (`work_of`)."""

    response: Augmented
    data: Dataset
    at: dict[str, float]
    cost: float
    settled: bool
    work: float = 0.0


def begin(response: Augmented, data: Dataset, start: Mapping[str, float]) -> Refit:
    """Return the state at a start: values by name, others at their priors. Raises ModelError if the model cannot take
    these values."""
    problem = _Problem(response, data, response.free(start))
    x = problem.begin()
    return Refit(response, data, problem.values(x), problem.cost(x), False)


def annealed(response: Augmented, data: Dataset, start: Mapping[str, float]) -> Refit:
    """Fit from far away, with tolerances that shrink towards the data's own. Raises ModelError."""
    at, work = dict(start), 0.0
    for tolerance in ANNEAL:
        if tolerance > data.tolerance:
            done = go_on(begin(response, blurred(data, tolerance), at), ANNEAL_STEPS)
            at, work = done.at, work + done.work
    return replace(begin(response, data, at), work=work)


@lru_cache(maxsize=32)
def blurred(data: Dataset, tolerance: float) -> Dataset:
    """Return the data with a larger tolerance. Cached with its whitener, because every start of a search asks for the
    same ones."""
    return replace(data, tolerance=tolerance)


def go_on(refit: Refit, steps: int) -> Refit:
    """Take at most so many damped steps (`checks.fitting.descent`), kept inside the physical bounds."""
    if refit.settled:
        return refit
    problem = _Problem(refit.response, refit.data, refit.response.free(refit.at))
    with warnings.catch_warnings():
        # An effect has no prior to measure it by: its column may be huge, which harms no positive definite solve.
        warnings.simplefilter("ignore", LinAlgWarning)
        found = descend(problem, problem.begin(), steps)
    work = refit.work + work_of(found.steps, len(problem.names), problem.data.H.size)
    return replace(refit, at=problem.values(found.x), cost=found.cost, settled=found.settled, work=work)


def released(refit: Refit) -> Refit:
    """Return a fit whose scatter was held, with the scatter free and at its optimum, or as near to it as the strut is
    held."""
    scatter = scatter_of(refit.response, refit.data)
    error = refit.data.H - refit.response.frf(refit.data.f, refit.at, refit.data.channels)
    best, held = scatter.best(refit.data.whitener(error)), dict(refit.response.held)
    response = replace(refit.response, held=())
    begun = refit
    for share in (1.0, 0.5, 0.0):
        at = {n: held[n] + share * (best[n] - held[n]) for n in held}
        begun = begin(response, refit.data, refit.at | at)
        if np.isfinite(begun.cost):
            break
    return replace(begun, work=refit.work)


class _Problem:
    """Whitened residuals over x, the parameters in units of their scale."""

    def __init__(self, response: Augmented, data: Dataset, free: list[Free]) -> None:
        self.response, self.data = response, data
        self.names = tuple(p.name for p in free)
        self.start = np.array([p.begin for p in free])
        self.unit = np.array([p.unit for p in free])
        self.prior = np.array([p.prior for p in free])
        self.weight = prior_rows(free, response.model.joint) * self.unit
        self.lo = np.array([p.lo for p in free])
        self.hi = np.array([p.hi for p in free])
        self.scatter = scatter_of(response, data) if response.held else None

    def begin(self) -> Array:
        x: Array = self.start / self.unit
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Return the bounds of x."""
        return self.lo / self.unit, self.hi / self.unit

    def inside(self, x: Array) -> Array:
        return np.asarray(np.clip(x * self.unit, self.lo, self.hi) / self.unit)

    def values(self, x: Array) -> dict[str, float]:
        return dict(zip(self.names, (float(v) for v in np.clip(x * self.unit, self.lo, self.hi)), strict=True))

    def residual(self, x: Array) -> Array:
        try:
            error = self.data.H - self.response.frf(self.data.f, self.values(x), self.data.channels)
        except ModelError:  # the strut is not held at these values: the search turns back
            return np.full(1, np.inf)
        white = self.data.whitener(error)
        if self.scatter is not None:
            white = self.scatter.off(white)
        return np.concatenate([white, self.weight @ (x - self.prior / self.unit)])

    def normal(self, x: Array, r: Array) -> tuple[Array, Array]:
        """Return J'J and J'r."""
        D = self.response.jacobian(self.data.f, self.names, self.values(x), self.data.channels)
        rest = r[r.size - len(self.weight) :]
        if self.scatter is None:
            A, g = self.data.whitener.normal(D, r[: r.size - len(self.weight)])
        else:
            rows = self.scatter.turned(self.data.whitener(D))
            A, g = rows @ rows.T, rows @ r[: rows.shape[1]]
        A = A * np.outer(self.unit, self.unit) + self.weight.T @ self.weight
        return A, self.weight.T @ rest - g * self.unit

    def cost(self, x: Array) -> float:
        r = self.residual(x)
        return 0.5 * float(r @ r)
