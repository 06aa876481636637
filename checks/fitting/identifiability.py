"""How well the data determine a fitted value beside all others: Fisher information at the optimum, priors included, and
the profile of the likelihood, which needs no optimum that looks like a parabola."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.fit import Fit, cost_with

REACH, POINTS = 3.0, 7  # of a profile: standard uncertainties to either side, and values looked at
TWO_SIDED = 1.959964  # standard deviations of a normal that hold 95 %


@dataclass(frozen=True)
class Identifiability:
    """How well the data determine a parameter. sd: standard uncertainty with every other parameter free; sd_alone: if
    all others were known; rival: the parameter most correlated with this one; correlation: with it, -1..1."""

    sd: float
    sd_alone: float
    rival: str
    correlation: float

    @staticmethod
    def of_effects(fit: Fit, effects: Iterable[str]) -> "dict[str, Identifiability]":
        """Return the identifiability of each fitted value of some effects, by `effect.parameter`. Parameters found
        without a fit (signs, slow sines) have no entry."""
        wanted = set(effects)
        return {n: identifiability(fit, n) for n in fit.names if n.partition(".")[0] in wanted}

    @property
    def inflation(self) -> float:
        """Return the factor by which other parameters widen the uncertainty: 1 if the value is determined alone, large
        if others can take its place."""
        return self.sd / self.sd_alone


def identifiability(fit: Fit, name: str) -> Identifiability:
    """Return the identifiability of a fitted parameter. Raises ModelError for a name that was not fitted."""
    if name not in fit.names:
        raise ModelError(f"'{name}' was not fitted (fitted: {', '.join(fit.names)})")
    k, sds = fit.names.index(name), np.sqrt(np.diag(fit.cov))
    correlation = fit.cov / np.outer(sds, sds)
    others = np.abs(correlation[k])
    others[k] = -1.0
    rival = int(np.argmax(others)) if len(fit.names) > 1 else k
    information = np.linalg.pinv(correlation, hermitian=True)[k, k]
    alone = float(sds[k] / np.sqrt(max(information, 1.0)))
    return Identifiability(float(sds[k]), alone, fit.names[rival], float(correlation[k, rival]))


@dataclass(frozen=True, eq=False)
class LikelihoodProfile:
    """values (n,) of a parameter, in its own unit, and fall (n,) of ln L from its maximum with all others fitted again
    at each; ci95: the values at which it has fallen by 1.92, infinite beyond those that were tried."""

    name: str
    values: Array
    fall: Array
    ci95: tuple[float, float]

    @classmethod
    def of(cls, found: Fit, name: str, reach: float = REACH, points: int = POINTS) -> "LikelihoodProfile":
        """Return the profile of the likelihood of a fitted parameter over `reach` standard uncertainties to either side
        ([PAWITAN01] 3.4; [RAUE09]): a fit for each value. Its interval needs no Fisher information: a profile that
        stays low, or rises on one side only, is of a value that the data do not determine. Raises ModelError."""
        if name not in found.names:
            raise ModelError(f"'{name}' was not fitted (fitted: {', '.join(found.names)})")
        free, at, sd = found.free[found.names.index(name)], found.at[name], found.sds[name]
        values = np.unique(np.clip(at + reach * sd * np.linspace(-1.0, 1.0, points), free.lo, free.hi))
        cost = np.array([cost_with(found, name, float(v)) for v in values])
        fall = np.maximum(cost - min(found.cost, float(cost.min())), 0.0)
        z = np.sqrt(2.0 * fall) * np.sign(values - at)  # a normal's is straight: its ends are those of Fisher
        rising = np.maximum.accumulate(z)
        lo = float(np.interp(-TWO_SIDED, rising, values, left=-np.inf)) if z[0] <= -TWO_SIDED else -np.inf
        hi = float(np.interp(TWO_SIDED, rising, values, right=np.inf)) if z[-1] >= TWO_SIDED else np.inf
        return cls(name, values, fall, (lo, hi))
