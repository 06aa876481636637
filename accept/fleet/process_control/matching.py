"""Which units fit together: sets of n whose quantities lie closest, by mixed-integer programming.

The cost of a set is the sum over quantities of its width (largest less smallest value) in units of that quantity's
uncertainty, so a quantity that is known badly does not decide. The optimum is exact: HiGHS proves it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, milp

from checks.arrays import Array

TIME_LIMIT_S = 60.0  # a person waits so long; what is then not proven best is said to be so


@dataclass(frozen=True)
class MatchedSets:
    """Units chosen for sets that are alike. sets: indices of the units of each; cost: of each set, width over U summed
    over quantities; proven: whether no better choice exists, else the time was up and bound is the least cost that
    could still exist."""

    sets: tuple[tuple[int, ...], ...]
    costs: tuple[float, ...]
    proven: bool
    bound: float


def match(values: Array, U: Array, size: int, sets: int = 1, time_limit_s: float = TIME_LIMIT_S) -> MatchedSets:
    """Return the disjoint sets of `size` units with the least sum of costs. values (N, Q); U (Q,) positive.

    Raises ValueError if there are too few units, a value is not finite, or U is not positive.
    """
    x = np.asarray(values, dtype=float)
    widths = np.asarray(U, dtype=float)
    if x.ndim != 2 or not np.isfinite(x).all() or not (np.isfinite(widths) & (widths > 0)).all():
        raise ValueError("values must be finite (units, quantities), each quantity with a positive uncertainty")
    if size < 2 or sets < 1 or x.shape[0] < size * sets:
        raise ValueError(f"{x.shape[0]} units are too few for {sets} set(s) of {size}")
    scaled = (x - x.mean(axis=0)) / widths
    answer = _solve(scaled, size, sets, time_limit_s)
    members = [tuple(int(i) for i in np.flatnonzero(row)) for row in answer[0]]
    chosen = tuple(sorted(members, key=lambda s: cost(scaled, s)))
    return MatchedSets(chosen, tuple(cost(scaled, s) for s in chosen), answer[1], answer[2])


def cost(scaled: Array, members: Sequence[int]) -> float:
    """Return the sum over quantities of the width of a set. scaled (N, Q): values in units of U."""
    part = scaled[list(members)]
    return float((part.max(axis=0) - part.min(axis=0)).sum())


def ideal_replacement(values: Array, U: Array, members: Sequence[int]) -> tuple[int, float, Array, Array]:
    """Return the member that a better unit should replace: its index, the resulting cost, and the interval (Q,), (Q,)
    in which the values of such a unit must lie."""
    scaled = np.asarray(values) / np.asarray(U)
    without = {m: cost(scaled, [k for k in members if k != m]) for m in members}
    worst = min(without, key=lambda m: without[m])
    rest = np.asarray(values)[[k for k in members if k != worst]]
    return worst, without[worst], rest.min(axis=0), rest.max(axis=0)


def _solve(scaled: Array, size: int, sets: int, time_limit_s: float) -> tuple[list[Array], bool, float]:
    """Solve the mixed-integer programme. Variables: x (sets, N) chosen, top, bottom (sets, Q); cost: top - bottom."""
    n, q = scaled.shape
    lo, hi = scaled.min(axis=0), scaled.max(axis=0)
    binaries, edges = sets * n, sets * q
    c = np.concatenate([np.zeros(binaries), np.ones(edges), -np.ones(edges)])
    rows, lower, upper = _constraints(scaled, size, sets, lo, hi)
    bounds = Bounds(
        np.concatenate([np.zeros(binaries), np.tile(lo, sets), np.tile(lo, sets)]),
        np.concatenate([np.ones(binaries), np.tile(hi, sets), np.tile(hi, sets)]),
    )
    integral = np.concatenate([np.ones(binaries), np.zeros(2 * edges)])
    limit = {"time_limit": time_limit_s, "mip_rel_gap": 0.0}
    answer = milp(
        c, integrality=integral, bounds=bounds, constraints=LinearConstraint(rows, lower, upper), options=limit
    )
    if answer.x is None:
        raise ValueError(f"no choice was found within {time_limit_s:g} s; ask for fewer sets or quantities")
    chosen = np.round(answer.x[:binaries]).reshape(sets, n)
    return list(chosen), bool(answer.status == 0), float(answer.mip_dual_bound)


def _constraints(scaled: Array, size: int, sets: int, lo: Array, hi: Array) -> tuple[sparse.csr_array, Array, Array]:
    n, q = scaled.shape
    width = sets * (n + 2 * q)
    entries: list[tuple[list[int], list[float], float, float]] = []
    for s in range(sets):
        mine = [s * n + i for i in range(n)]
        entries.append((mine, [1.0] * n, size, size))
        for k in range(q):
            top, bottom = sets * n + s * q + k, sets * (n + q) + s * q + k
            for i in range(n):
                v = scaled[i, k]  # top >= v where chosen, else >= the least value; bottom alike
                entries.append(([top, mine[i]], [1.0, -(v - lo[k])], lo[k], np.inf))
                entries.append(([bottom, mine[i]], [1.0, hi[k] - v], -np.inf, hi[k]))
    for i in range(n):
        if sets > 1:
            entries.append(([s * n + i for s in range(sets)], [1.0] * sets, 0.0, 1.0))
    at = np.concatenate([np.full(len(columns), row) for row, (columns, _, _, _) in enumerate(entries)])
    columns = np.concatenate([e[0] for e in entries])
    data = np.concatenate([e[1] for e in entries])
    matrix = sparse.csr_array((data, (at, columns)), shape=(len(entries), width))
    return matrix, np.array([e[2] for e in entries]), np.array([e[3] for e in entries])
