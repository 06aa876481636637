"""Steps followed by creep that grows with the logarithm of time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.signals.slow.regression import LinearFit, least_squares
from checks.signals.slow.steps import SignalStep

REFERENCE_S = 0.1  # the deflection is stated this long after the step
SETTLED_S = 0.3  # and creep compared with that from here on


@dataclass(frozen=True, eq=False)
class CreepFit:
    """Fit of y = d0 + drift t + sum over steps of D (1 + gamma log10((t - t_step)/0.1 s)) on the samples `used` (N,).

    deflections (S,) D 0.1 s after each step [unit of y]; gamma (S,) creep per decade of time; model (N,). per_moment
    (S, S): change of each deflection per second of error in the moment of each step; gamma_per_moment (S, S): the same
    of gamma [1/s]; later: gamma by the samples from 0.3 s after a step alone, NaN if they are too few: a load that
    settles is over by then."""

    deflections: Array
    gamma: Array
    model: Array
    used: NDArray[np.bool_]
    fit: LinearFit
    per_moment: Array
    gamma_per_moment: Array
    later: Array

    def u_of(self, weights: Sequence[float]) -> float:
        """Return the standard uncertainty of the weighted sum of the deflections from the scatter [unit of y]."""
        full = np.zeros(self.fit.x.size)
        full[2::2] = weights
        return self.fit.u(full)

    def u_moment(self, weights: Sequence[float], steps: Sequence[SignalStep]) -> float:
        """Return the standard uncertainty of the same sum from the moments of the steps."""
        return float(np.linalg.norm(np.asarray(weights) @ self.per_moment * [s.u_t for s in steps]))


def fit_creep(t: Array, y: Array, steps: Sequence[SignalStep]) -> CreepFit:
    """Fit all steps at once, so that the creep of one step continues under the next.

    Creep law (linear in log time, from 0.1 s on) and superposition of histories: Jung & Gweon, Rev. Sci. Instrum. 71
    (2000) 1896. Samples between a step and the quiet after it, and at least 0.1 s, are left out. Raises ValueError if
    too few samples are left to separate the parameters."""
    used = _usable_samples(t, steps, REFERENCE_S)
    columns = [np.ones_like(t), t - t.mean()]
    for s in steps:
        after = t - s.t
        columns += [
            (after > 0).astype(float),
            np.where(after > 0, np.log10(np.maximum(after, REFERENCE_S) / REFERENCE_S), 0.0),
        ]
    design = np.column_stack(columns)
    fit = least_squares(design[used], y[used])
    deflections = fit.x[2::2]
    # Moving a step changes its creep by -slope/(t - t_step); the response of the fit to that is the sensitivity.
    slopes = [
        np.where(t - s.t >= REFERENCE_S, -slope / np.log(10) / np.maximum(t - s.t, REFERENCE_S), 0.0)
        for s, slope in zip(steps, fit.x[3::2], strict=True)
    ]
    moved = np.linalg.lstsq(design[used], np.column_stack(slopes)[used], rcond=None)[0]
    gamma = fit.x[3::2] / deflections
    gamma_moved = (moved[3::2] - gamma[:, None] * moved[2::2]) / deflections[:, None]
    try:
        settled = _usable_samples(t, steps, SETTLED_S)
        x = least_squares(design[settled], y[settled]).x
        later = x[3::2] / x[2::2]
    except ValueError:
        later = np.full(len(steps), np.nan)
    return CreepFit(deflections, gamma, design @ fit.x, used, fit, moved[2::2], gamma_moved, later)


def _usable_samples(t: Array, steps: Sequence[SignalStep], after_s: float) -> NDArray[np.bool_]:
    """Return the mask (N,) of samples outside the passage of every step, and at least after_s [s] after it."""
    used = np.ones(t.size, dtype=bool)
    for s in steps:
        used &= (t <= s.quiet_to) | (t >= max(s.quiet_from, s.t + after_s))
    return used
