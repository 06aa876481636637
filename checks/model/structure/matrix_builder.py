"""Puts springs, dampers and masses into matrices."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, between_zeros


@dataclass(frozen=True, eq=False)
class Parts:
    """A system as its parts: an APA by its free modes, and the bodies fastened to it at a few motions.

    w2 [rad2/s2], rate [rad/s] (k,) of the free modes, whose amplitudes are the system's first coordinates; motions (m,
    n): rows that read the motions; M, C, K (m, m), drive (m,), outputs (c, m) in terms of the motions. own: the motions
    that are the system's other coordinates, of the payload and hanging elements."""

    w2: Array
    rate: Array
    motions: Array
    M: Array
    C: Array
    K: Array
    drive: Array
    outputs: Array
    own: list[int]


@dataclass(frozen=True, eq=False)
class System:
    """M q'' + C q' + K q = force u, y = outputs q. M, C, K (n, n); force (n,); outputs (c, n), one row per channel;
    motions (m, n): rows that read the few motions at which parts are fastened to each other; coordinates (a, n): rows
    that read those in which all was put together; None: the same ones. parts: if the APA is given by its modes and
    nothing ties coordinates to each other."""

    M: Array
    C: Array
    K: Array
    force: Array
    outputs: Array
    channels: tuple[str, ...]
    motions: Array | None = None
    coordinates: Array | None = None
    parts: Parts | None = None


class Builder:
    """Matrices of a system under construction. A place is (6, n): rows that read ux uy uz rx ry rz of a point."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._springs: list[tuple[Array, Array, Array]] = [(np.zeros((0, size)), np.zeros(0), np.zeros(0))]
        self._masses: list[tuple[Array, Array]] = [(np.zeros((0, size)), np.zeros(0))]

    def wide(self, rows: Array) -> Array:
        """Return rows (..., n) over all coordinates, with zeros for the last ones, which they lack."""
        return between_zeros(rows, 0, self._size - rows.shape[1])

    def mass(self, place: Array, m: float, inertia: Array | float = 0.0) -> None:
        """Add a rigid body at its centre of mass: m [kg], inertia (3,) [kg m2] about x y z."""
        weights = np.empty(6)
        weights[:3], weights[3:] = m, inertia
        self._masses.append((self.wide(place), weights))

    def along(self, rows: Array, m: float) -> None:
        """Add a mass [kg] or inertia [kg m2] that moves along rows (r, n) only."""
        self._masses.append((self.wide(rows), np.full(len(rows), m)))

    def spring(self, relative: Array, k: Array, c: Array) -> None:
        """Add springs k (r,) and dampers c (r,) stretched by the rows `relative` (r, n); an infinite k ties its row."""
        self._springs.append((self.wide(relative), k, c))

    def matrices(self) -> tuple[Array, Array, Array, Array]:
        """Return M, C, K (n, n) and the tied rows (r, n)."""
        place, weights = map(np.concatenate, zip(*self._masses, strict=True))
        rows, k, c = map(np.concatenate, zip(*self._springs, strict=True))
        tied = np.isinf(k)
        free = rows[~tied]
        M, C, K = ((r.T * w) @ r for r, w in ((place, weights), (free, c[~tied]), (free, k[~tied])))
        return M, C, K, rows[tied]
