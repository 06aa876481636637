"""Control charts of single values: individuals and moving range with Nelson's rules, and EWMA.

Limits from the moving range, not from the standard deviation of all: a drift would widen the limits that are to show it
([Montgomery] 6.4; [Nelson]; EWMA: [Montgomery] 9.2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array

D2, D4 = 1.128379167095513, 3.2665  # of ranges of two normal values: mean range / sigma (2 / sqrt(pi)), upper limit
SIGMAS = 3.0  # Shewhart's limits: one false alarm in 370 points
EWMA_WEIGHT, EWMA_SIGMAS = 0.2, 2.962  # in-control run length 500 ([Montgomery] table 9.11)
ROUTINE = (1, 2, 3, 4)  # the others ring early and often: hints, no alarms ([Nelson])
LEAST = 8  # values below which limits are not worth drawing
RULES = {
    1: "one value beyond 3 sigma",
    2: "nine in a row on one side of the mean",
    3: "six in a row rising or falling",
    4: "fourteen in a row alternating",
    5: "two of three beyond 2 sigma on one side",
    6: "four of five beyond 1 sigma on one side",
    7: "fifteen in a row within 1 sigma",
    8: "eight in a row beyond 1 sigma on both sides",
}


@dataclass(frozen=True, eq=False)
class Chart:
    """mean, sigma: of the process, from `of` values. values (N,); moving_range (N - 1,), range_limit its upper limit;
    ewma (N,) with its limits ewma_lo, ewma_hi (N,); alarms: rule number -> indices (k,) of the values that end one."""

    values: Array
    mean: float
    sigma: float
    moving_range: Array
    range_limit: float
    ewma: Array
    ewma_lo: Array
    ewma_hi: Array
    alarms: dict[int, NDArray[np.intp]]

    @property
    def ewma_alarms(self) -> NDArray[np.intp]:
        """Indices where the weighted mean has left its limits: a small, lasting shift."""
        return np.flatnonzero((self.ewma < self.ewma_lo) | (self.ewma > self.ewma_hi))

    @property
    def lower(self) -> float:
        return self.mean - SIGMAS * self.sigma

    @property
    def upper(self) -> float:
        return self.mean + SIGMAS * self.sigma


def chart(values: Array) -> Chart:
    """Chart of values (N,) in the order in which they were measured.

    Raises ValueError for fewer than `LEAST` values or one that is not finite.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or x.size < LEAST or not np.isfinite(x).all():
        raise ValueError(f"{x.size} values, expected {LEAST} or more, all finite")
    ranges = np.abs(np.diff(x))
    mean, sigma = float(x.mean()), float(ranges.mean()) / D2
    smooth, half = _ewma(x, mean, sigma)
    z = (x - mean) / sigma if sigma > 0 else np.zeros_like(x)
    limit = D4 * float(ranges.mean())
    return Chart(x, mean, sigma, ranges, limit, smooth, mean - half, mean + half, nelson(z))


def _ewma(x: Array, mean: float, sigma: float) -> tuple[Array, Array]:
    out, last = np.empty_like(x), mean
    for i, value in enumerate(x):
        last = EWMA_WEIGHT * value + (1.0 - EWMA_WEIGHT) * last
        out[i] = last
    grown = 1.0 - (1.0 - EWMA_WEIGHT) ** (2.0 * np.arange(1, x.size + 1))
    return out, EWMA_SIGMAS * sigma * np.sqrt(EWMA_WEIGHT / (2.0 - EWMA_WEIGHT) * grown)


def nelson(z: Array) -> dict[int, NDArray[np.intp]]:
    """Rule -> indices of the values that complete its pattern. z (N,): distance from the mean in sigmas."""
    step = np.sign(np.diff(z))
    turning = step[1:] * step[:-1] < 0
    found = {
        1: np.abs(z) > 3.0,
        2: _run(z > 0, 9, 9) | _run(z < 0, 9, 9),
        3: _shifted(_run(step > 0, 5, 5) | _run(step < 0, 5, 5), 1, z.size),
        4: _shifted(_run(turning, 12, 12), 2, z.size),
        5: _run(z > 2.0, 2, 3) | _run(z < -2.0, 2, 3),
        6: _run(z > 1.0, 4, 5) | _run(z < -1.0, 4, 5),
        7: _run(np.abs(z) < 1.0, 15, 15),
        8: _run(np.abs(z) > 1.0, 8, 8) & ~(_run(z > 1.0, 8, 8) | _run(z < -1.0, 8, 8)),
    }
    return {rule: at for rule, hit in found.items() if (at := np.flatnonzero(hit)).size}


def _run(hit: NDArray[np.bool_], wanted: int, window: int) -> NDArray[np.bool_]:
    """(N,) where a window that ends here, with a hit at its end, holds at least `wanted` hits."""
    counts = np.convolve(hit.astype(int), np.ones(window, dtype=int))[: hit.size] if hit.size else hit.astype(int)
    return np.asarray(hit & (counts >= wanted))


def _shifted(hit: NDArray[np.bool_], by: int, size: int) -> NDArray[np.bool_]:
    """A pattern of differences is complete at the value behind the last of them."""
    out = np.zeros(size, dtype=bool)
    out[by : by + hit.size] = hit
    return out
