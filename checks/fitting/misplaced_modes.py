"""Starts of a fit in which a misplaced mode is moved to the largest residual.

Two modes at nearly the same frequency may be mistaken for each other: the strong one explains the response alone, and
the weak one is left where it does not disturb. Every path to the truth passes through the crossing of the two, where
the fit is worse, so no descent leads there. But the residual peaks where a mode is missing, and the shortest way of a
mode to there, in standard deviations of the priors with all other modes kept in place, is known from the modes'
derivatives."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.prior import prior_rows
from checks.model.model import Model

Values = Mapping[str, float]

CLOSE = 0.05  # of the frequency: how far from its place a mode may be
THERE = 0.001  # of it: nearer is the place
LIKELY = 8.0  # standard deviations, the longest way
PEAKS = 6  # of the residual that are tried
APART = 0.05  # of the frequency, between two of them
FIRM = 1e-3  # relative, of squared frequencies: how well the others stay
# At once, with the shapes that the modes have, so that one passes another as if they did not meet; or in steps, with
# the shapes that they take on the way.
STRIDES = (1, 4)


def misplaced_modes(
    model: Model,
    free: Sequence[Free],
    at: Values,
    peaks_Hz: Iterable[float],
    f_hi: float,
    own: Callable[[Values], Values] = dict,
) -> list[dict[str, float]]:
    """Return sets of values at which one mode below f_hi [Hz] lies at a peak of the residual, often none. free: the
    fitted parameters; own: selects the model's own values."""
    movable = [p for p in free if p.name in model.mechanical and np.isfinite(p.sd)]
    if not movable:
        return []
    modes = _Modes(model, movable, own, f_hi)
    found = []
    for peak in peaks_Hz:
        f = modes.at(at)[0]
        near = np.flatnonzero((np.abs(f / peak - 1.0) < CLOSE) & (np.abs(f / peak - 1.0) > THERE))
        ways = [modes.move_mode(at, int(k), peak, strides) for k in near for strides in STRIDES]
        found += [way for way in ways if way is not None]
    return found


def peaks(f: Array, energy: Array) -> list[float]:
    """Return the frequencies on f (F,) [Hz] of the largest separate peaks of an energy (F,), the largest first."""
    left, out = energy.copy(), []
    for _ in range(PEAKS):
        k = int(np.argmax(left))
        out.append(float(f[k]))
        left[np.abs(f - f[k]) < APART * f[k]] = 0.0
    return out


@dataclass(frozen=True, eq=False)
class _Modes:
    """The modes of a model below f_hi [Hz] and how its free parameters move them."""

    model: Model
    free: Sequence[Free]
    own: Callable[[Values], Values]
    f_hi: float

    def at(self, values: Values) -> tuple[Array, Array]:
        """Return the frequencies (n,) [Hz] and (n, p) derivatives of their squares, relative."""
        w2, slopes = self.model.square_slopes([p.name for p in self.free], self.own(values))
        n = int(np.sum(w2 < (2.0 * np.pi * self.f_hi) ** 2))
        return np.sqrt(w2[:n]) / (2.0 * np.pi), slopes[:, :n].T / w2[:n, None]

    def move_mode(self, at: Values, mode: int, to_Hz: float, strides: int) -> dict[str, float] | None:
        """Return values that move one mode to a frequency and others as little as possible, in several strides; None if
        they are unlikely or the strut is not held."""
        back = np.linalg.inv(prior_rows(self.free, self.model.joint))
        values, far = dict(at), 0.0
        try:
            for left in range(strides, 0, -1):
                f, logs = self.at(values)
                moves = np.zeros(f.size)
                moves[mode] = 2.0 * np.log(to_Hz / f[mode]) / left
                G = logs @ back
                y = G.T @ np.linalg.solve(G @ G.T + FIRM**2 * np.eye(f.size), moves)
                far += float(np.linalg.norm(y))
                steps = zip(self.free, back @ y, strict=True)
                values |= {p.name: float(np.clip(values[p.name] + d, p.lo, p.hi)) for p, d in steps}
        except (ModelError, IndexError):
            return None
        return values if far < LIKELY else None
