"""The scatter of an APA's modes, taken out of a search: it is small, so the responses are linear in it, and what is
linear with a Gaussian prior need not be searched. A fit then has twenty parameters instead of a hundred and fifty.

With whitened derivatives J (n, q) by the factors and their prior rows W (q, q), r = [w - J d, W (m + d - 1)] is least
over d if it is normal to [J; -W]: what is left of w is found by one product with an orthonormal basis.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.fitting.dataset import Dataset
from checks.fitting.fit import free_of
from checks.fitting.prior import prior_rows
from checks.gap.modelling.augmented import Augmented, Held
from checks.model.model import Model


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
