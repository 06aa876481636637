"""The residuals that a search of explanations descends on. The last fit of what is reported is `checks.fitting.fit.fit`
on all bins; this one only finds where it begins.

The scatter of an APA's modes is taken out of a search: it is small, so the responses are linear in it, and what is
linear with a Gaussian prior need not be searched. A fit then has twenty parameters instead of a hundred and fifty. With
whitened derivatives J (n, q) by the factors and their prior rows W (q, q), the residual [w - J d, W (m + d - 1)] is
least over d if it is orthogonal to [J; -W]; its value follows from one product with an orthonormal basis of these.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.fitting.fit import free_of
from checks.fitting.prior import prior_rows
from checks.gap.modelling.augmented import Augmented, Held
from checks.model.model import Model


@lru_cache(maxsize=32)
def with_tolerance(data: Dataset, tolerance: float) -> Dataset:
    """Return the data with a larger tolerance. Cached with its whitener, because every start of a search asks for the
    same ones."""
    return replace(data, tolerance=tolerance)


class SearchResiduals:
    """Whitened residuals of a response over x, its free parameters in units of their scale; the scatter of an APA's
    modes, if the response holds it, is at its optimum for every x."""

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


@dataclass(frozen=True, eq=False)
class HeldScatter:
    """Q (n + q, q) orthonormal, R (q, q) of [J; -W]; tail (q,): prior rows at the values held; n rows of data."""

    names: tuple[str, ...]
    values: Array
    Q: Array
    R: Array
    tail: Array

    def off(self, white: Array) -> Array:
        """Return whitened residuals (n,) extended to (n + q,), with the scatter at its optimum."""
        r = np.concatenate([white, self.tail])
        return np.asarray(r - self.Q @ (self.Q.T @ r))

    def turned(self, rows: Array) -> Array:
        """Return whitened derivatives (p, n) extended to (p, n + q), with the scatter following."""
        r = np.concatenate([rows, np.zeros((rows.shape[0], self.tail.size))], axis=1)
        r -= (r @ self.Q) @ self.Q.T
        return r

    def best(self, white: Array) -> dict[str, float]:
        """Return the factors that explain most of whitened residuals (n,)."""
        r = np.concatenate([white, self.tail])
        away = linalg.solve_triangular(self.R, self.Q.T @ r)
        return dict(zip(self.names, (float(v) for v in self.values + away), strict=True))


def scatter_of(response: Augmented, data: Dataset) -> HeldScatter:
    """Return the scatter that a response holds, on some data."""
    return _scatter(response.model, response.held, data)


@lru_cache(maxsize=24)
def _scatter(model: Model, held: Held, data: Dataset) -> HeldScatter:
    names, values = tuple(n for n, _ in held), np.array([v for _, v in held])
    free = free_of(model, names)
    W = prior_rows(free, model.joint)
    rows = data.whitener(model.jacobian(data.f, names, dict(held), data.channels))
    Q, R = np.linalg.qr(np.hstack([rows, -W.T]).T)
    return HeldScatter(names, values, Q, R, W @ (values - np.array([p.prior for p in free])))
