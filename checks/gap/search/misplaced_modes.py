"""Places to begin from, at which a mode that a search has left in the wrong place is where the residual is largest.

Two modes that lie nearly at one frequency may be taken for each other: what the strong one should share with the weak
one it has alone, and the weak one hides where it does no harm. Every step towards the truth passes through where the
two meet, and there the fit is worse, so no search leads out of that. But the residual peaks where a mode is missing,
and the shortest way of a mode to there, in standard deviations of the priors and with every other mode where it is, is
known from the modes' derivatives.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.prior import prior_rows
from checks.gap.modelling.augmented import Augmented, Values

CLOSE = 0.05  # of the frequency: how far from its place a mode may be
THERE = 0.001  # of it: nearer is the place
LIKELY = 8.0  # standard deviations, the longest way
FIRM = 1e-3  # relative, of squared frequencies: how well the others stay
# At once, with the shapes that the modes have, so that one passes another as if they did not meet; or in steps, with
# the shapes that they take on the way.
STRIDES = (1, 4)


def misplaced_modes(response: Augmented, at: Values, peaks_Hz: Iterable[float], f_hi: float) -> list[dict[str, float]]:
    """Values at which one mode below f_hi [Hz] lies at a peak of the residual; few, or none."""
    free = [p for p in response.free(at) if p.name in response.model.mechanical and np.isfinite(p.sd)]
    if not free:
        return []
    found = []
    for peak in peaks_Hz:
        f = _modes(response, at, free, f_hi)[0]
        near = np.flatnonzero((np.abs(f / peak - 1.0) < CLOSE) & (np.abs(f / peak - 1.0) > THERE))
        ways = [_moved(response, at, free, int(k), peak, strides, f_hi) for k in near for strides in STRIDES]
        found += [way for way in ways if way is not None]
    return found


def _modes(response: Augmented, at: Values, free: Sequence[Free], f_hi: float) -> tuple[Array, Array]:
    """(n,) frequencies [Hz] of the modes below f_hi, and (n, p) derivatives of their squares, relative."""
    w2, slopes = response.model.square_slopes([p.name for p in free], response.changes(at))
    n = int(np.sum(w2 < (2.0 * np.pi * f_hi) ** 2))
    return np.sqrt(w2[:n]) / (2.0 * np.pi), slopes[:, :n].T / w2[:n, None]


def _moved(
    response: Augmented, at: Values, free: Sequence[Free], mode: int, to_Hz: float, strides: int, f_hi: float
) -> dict[str, float] | None:
    """Values at which a mode has moved, the others as far as they can where they were. None where that is unlikely or
    nothing stands."""
    back = np.linalg.inv(prior_rows(free, response.model.joint))
    values, far = dict(at), 0.0
    try:
        for left in range(strides, 0, -1):
            f, logs = _modes(response, values, free, f_hi)
            moves = np.zeros(f.size)
            moves[mode] = 2.0 * np.log(to_Hz / f[mode]) / left
            G = logs @ back
            y = G.T @ np.linalg.solve(G @ G.T + FIRM**2 * np.eye(f.size), moves)
            far += float(np.linalg.norm(y))
            values |= {
                p.name: float(np.clip(values[p.name] + d, p.lo, p.hi)) for p, d in zip(free, back @ y, strict=True)
            }
    except (ModelError, IndexError):
        return None
    return values if far < LIKELY else None
