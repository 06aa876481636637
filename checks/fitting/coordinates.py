"""Coordinates in which a search is short: logarithms for parameters of fixed sign, units of the prior for the others.

Mass, stiffness and force can grow together and leave every response as it is. In logarithms that valley is straight and
a Gauss-Newton step runs along it; in the values themselves it bends, and hundreds of small steps follow the bend."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array

FAR_FROM_ZERO = 3.0  # prior standard deviations
REACH = 30.0  # prior standard deviations from the start


@dataclass(frozen=True)
class Free:
    """A parameter that is fitted. prior and sd: Gaussian prior (sd infinite: none); lo, hi: physical bounds, included.
    start, scale: where to begin and how far other starts lie from it (default: prior and sd)."""

    name: str
    prior: float
    sd: float = np.inf
    lo: float = -np.inf
    hi: float = np.inf
    start: float | None = None
    scale: float | None = None

    @property
    def begin(self) -> float:
        return float(np.clip(self.prior if self.start is None else self.start, self.lo, self.hi))

    @property
    def unit(self) -> float:
        """Return the size of a natural step of the search, in the parameter's unit."""
        if self.scale is not None:
            return self.scale
        return self.sd if np.isfinite(self.sd) else max(abs(self.begin) * 0.1, 1e-12)

    @property
    def logarithmic(self) -> bool:
        """Return whether the search uses its logarithm: not from almost zero, where the logarithm has no slope."""
        far = np.isfinite(self.sd) and abs(self.prior) > FAR_FROM_ZERO * self.sd
        return bool(far and self.begin * np.sign(self.prior) > self.sd)


@dataclass(frozen=True, eq=False)
class Coordinates:
    """x (p,) <-> values (p,); x is 0 at the start and grows by 1 for the first `unit` of a value."""

    origin: Array
    unit: Array
    log: NDArray[np.bool_]
    lo: Array
    hi: Array
    reach: Array

    @classmethod
    def of(cls, free: Sequence[Free]) -> "Coordinates":
        origin, unit, lo, hi = (np.array([getattr(p, k) for p in free]) for k in ("begin", "unit", "lo", "hi"))
        reach = np.array([REACH * max(p.sd / p.unit, 1.0) for p in free])
        return cls(origin, unit, np.array([p.logarithmic for p in free]), lo, hi, reach)

    def values(self, x: Array) -> Array:
        grown = self._origin * np.exp(np.clip(x * self.unit / self._origin, -50.0, 50.0))
        return np.clip(np.where(self.log, grown, self.origin + self.unit * x), self.lo, self.hi)

    def x(self, values: Array) -> Array:
        """Return the x of a value; infinite for a value on the other side of zero."""
        ratio = values / self._origin
        logs = np.log(np.where(ratio > 0.0, ratio, 1.0)) * self._origin / self.unit
        beyond = np.where(self._origin > 0.0, -np.inf, np.inf)
        return np.where(self.log, np.where(ratio > 0.0, logs, beyond), (values - self.origin) / self.unit)

    def slope(self, x: Array) -> Array:
        """Return the derivative (p,) of each value by its x."""
        return np.where(self.log, self.values(x) / self._origin, 1.0) * self.unit

    def bounds(self) -> tuple[Array, Array]:
        """Return the bounds (p,) of the search: the physical ones, narrowed to likely values for parameters with a
        prior."""
        return np.maximum(self.x(self.lo), -self.reach), np.minimum(self.x(self.hi), self.reach)

    @property
    def _origin(self) -> Array:
        return np.where(self.log, self.origin, 1.0)
