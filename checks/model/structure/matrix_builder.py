"""Puts springs, dampers and masses into matrices, and turns rigid directions into one coordinate less."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from checks.arrays import Array


@dataclass(frozen=True, eq=False)
class System:
    """M q'' + C q' + K q = force u, y = outputs q. M, C, K (n, n); force (n,); outputs (c, n), one row per channel;
    coordinates (a, n): rows that read those of the builder, in which all was put together; None: the same ones."""

    M: Array
    C: Array
    K: Array
    force: Array
    outputs: Array
    channels: tuple[str, ...]
    coordinates: Array | None = None


class Builder:
    """Matrices in the making. A place is a (6, n) array of rows that read the motion ux uy uz rx ry rz of a point."""

    def __init__(self, size: int) -> None:
        self.M, self.C, self.K = (np.zeros((size, size)) for _ in range(3))
        self._rigid: list[Array] = []

    def mass(self, place: Array, m: float, inertia: Array | float = 0.0) -> None:
        """A rigid body at its centre of mass: m [kg], inertia (3,) [kg m2] about x y z."""
        weights = np.empty(6)
        weights[:3], weights[3:] = m, inertia
        self.M += place.T @ (weights[:, None] * place)

    def spring(self, relative: Array, k: Array, c: Array) -> None:
        """Springs k (r,) and dampers c (r,) stretched by the rows `relative` (r, n); an infinite k ties its row."""
        tied = np.isinf(k)
        if tied.any():
            self._rigid.append(relative[tied])
            relative, k, c = relative[~tied], k[~tied], c[~tied]
        if k.any():
            self.K += relative.T @ (k[:, None] * relative)
        if c.any():
            self.C += relative.T @ (c[:, None] * relative)

    def finish(self, force: Array, outputs: Array, channels: tuple[str, ...]) -> System:
        """The system in coordinates that keep every rigid direction rigid."""
        if not self._rigid:
            return System(self.M, self.C, self.K, force, outputs, channels)
        T = linalg.null_space(np.vstack(self._rigid))
        return System(T.T @ self.M @ T, T.T @ self.C @ T, T.T @ self.K @ T, T.T @ force, outputs @ T, channels, T)
