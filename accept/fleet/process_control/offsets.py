"""A lasting difference between benches, meters or people, of units of the same day and lot.

A meter that always reads 0.3 % more shifts nothing in a chart and widens it a little. Each value is compared with those
that others measured beside it, so that neither a drift of the process nor a lot is a difference between meters.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from accept.fleet.process_control.control_chart import GROSS_SIGMAS, LEAST
from accept.fleet.process_control.equal_runs import Labels, Place
from accept.fleet.process_control.spread import robust_sigma
from checks.arrays import Array

OF = ("instrument", "bench", "operator")


@dataclass(frozen=True, eq=False)
class MeterOffset:
    """Values at (n,) of a place read more by size than those of others beside them; error: its standard deviation;
    chance: of such a difference, of any of the places that were compared, without a cause."""

    at: NDArray[np.intp]
    place: Place
    size: float
    error: float
    chance: float


def largest_offset(values: Array, places: Mapping[str, Labels], blocks: NDArray[np.intp]) -> MeterOffset | None:
    """Return the least likely offset of values (N,) that vary about a level; None if no two places measured beside each
    other.

    blocks (N,): number of what values have in common that are compared, a day and a lot."""
    kept = np.flatnonzero(np.abs(values - np.median(values)) <= GROSS_SIGMAS * robust_sigma(values))
    tests, found = 0, list[MeterOffset]()
    for column, names in _partitions(places).items():
        labels = places[column][kept]
        compared = [_of_place(values[kept], labels == name, blocks[kept]) for name in names]
        known = [(name, one) for name, one in zip(names, compared, strict=True) if one is not None]
        tests += len(known) if len(names) > 2 else min(len(known), 1)  # of two, both are one comparison
        found += [
            MeterOffset(np.flatnonzero(places[column] == name), (column, name), size, error, chance)
            for name, (size, error, chance) in known
        ]
    # Of two that differ it is not known which is wrong: the last one by name reads more or less than the first.
    best = min(reversed(found), key=lambda each: each.chance, default=None)
    return best and replace(best, chance=min(1.0, tests * best.chance))


def _partitions(places: Mapping[str, Labels]) -> dict[str, list[str]]:
    """Return column -> its labels of `LEAST` values, of the columns that part the values differently."""
    chosen = dict[str, list[str]]()
    seen = set[bytes]()
    for column in OF:
        if column not in places:
            continue
        names, codes = np.unique(places[column].astype(str), return_inverse=True)
        firsts = np.unique(codes, return_index=True)[1]
        key = np.argsort(np.argsort(firsts))[codes].tobytes()
        several = [str(n) for n, count in zip(names, np.bincount(codes), strict=True) if n and count >= LEAST]
        if len(several) > 1 and key not in seen:
            chosen[column] = several
        seen.add(key)
    return chosen


def _of_place(x: Array, of: NDArray[np.bool_], blocks: NDArray[np.intp]) -> tuple[float, float, float] | None:
    """Return by how much the values of a place lie above those of others in the same blocks, the standard deviation of
    that and its chance by Student's t; None if they share no blocks or leave no degrees of freedom."""
    cells = 2 * np.unique(blocks, return_inverse=True)[1] + of
    counts = np.bincount(cells, minlength=2 * (cells.max() // 2 + 1))
    means = np.bincount(cells, weights=x, minlength=counts.size) / np.maximum(counts, 1)
    (others, here), (other, mean) = counts.reshape(-1, 2).T, means.reshape(-1, 2).T
    weights = others * here / np.maximum(others + here, 1)
    degrees = x.size - int((counts > 0).sum())
    if not weights.any() or degrees < LEAST:
        return None
    size = float(weights @ (mean - other) / weights.sum())
    error = float(np.sqrt(((x - means[cells]) ** 2).sum() / degrees / weights.sum()))
    return (size, error, 2.0 * float(stdtr(degrees, -abs(size) / error))) if error > 0.0 else None
