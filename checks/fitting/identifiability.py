"""How well the data determine a fitted value beside all others: Fisher information at the optimum, priors included."""

from dataclasses import dataclass

import numpy as np

from checks.fitting.fit import Fit


@dataclass(frozen=True)
class Identifiability:
    """sd: standard uncertainty with every other parameter free; sd_alone: if all others were known; rival: the other
    parameter whose estimate is most correlated with this one, and correlation: with it, -1..1."""

    sd: float
    sd_alone: float
    rival: str
    correlation: float

    @property
    def inflation(self) -> float:
        """Return by how much the other parameters widen the uncertainty: 1 if the value is determined by itself; a
        large number if others can take its place."""
        return self.sd / self.sd_alone


def identifiability(fit: Fit, name: str) -> Identifiability:
    """Return the identifiability of a fitted parameter. Raises KeyError for a name that was not fitted."""
    if name not in fit.names:
        raise KeyError(f"'{name}' was not fitted (fitted: {', '.join(fit.names)})")
    k, sds = fit.names.index(name), np.sqrt(np.diag(fit.cov))
    correlation = fit.cov / np.outer(sds, sds)
    others = np.abs(correlation[k])
    others[k] = -1.0
    rival = int(np.argmax(others)) if len(fit.names) > 1 else k
    information = np.linalg.pinv(correlation, hermitian=True)[k, k]
    alone = float(sds[k] / np.sqrt(max(information, 1.0)))
    return Identifiability(float(sds[k]), alone, fit.names[rival], float(correlation[k, rival]))
