"""The joint prior of several of a model's uncertain parameters."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.errors import ModelError

COMMON = 0.5  # of the variance that a file states of a part: taken for what the units of a batch have in common


@dataclass(frozen=True, eq=False)
class JointPrior:
    """mean (p,) and covariance (p, p) of named parameters, in the names' units: from a batch, whose units determine
    combinations of parameters far better than single ones."""

    names: tuple[str, ...]
    mean: Array
    covariance: Array

    def __post_init__(self) -> None:
        """Raise ModelError if the covariance is not symmetric and positive definite."""
        p = len(self.names)
        if self.mean.shape != (p,) or self.covariance.shape != (p, p):
            raise ModelError(
                f"joint prior of {p} parameters has a mean of {self.mean.shape}, a covariance of "
                f"{self.covariance.shape}; expected ({p},) and ({p}, {p})"
            )
        try:
            linalg.cholesky(self.covariance)
        except (linalg.LinAlgError, ValueError) as e:
            raise ModelError(f"joint prior: its covariance is not positive definite: {e}") from e

    @property
    def values(self) -> dict[str, float]:
        return dict(zip(self.names, (float(v) for v in self.mean), strict=True))

    @property
    def sds(self) -> dict[str, float]:
        """Return the standard deviations by name."""
        return dict(zip(self.names, (float(v) for v in np.sqrt(np.diag(self.covariance))), strict=True))
