"""Priors of free parameters, independent or joint."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import linalg

from checks.arrays import Array
from checks.fitting.coordinates import Free
from checks.model.joint_prior import JointPrior


def prior_rows(free: Sequence[Free], joint: JointPrior | None = None) -> Array:
    """Return W (p, p): W (values - priors) is standard normal before any data; zero rows without a prior."""
    W = np.diag([1.0 / p.sd for p in free])
    joint_rows = [] if joint is None else [i for i, p in enumerate(free) if p.name in joint.names and np.isfinite(p.sd)]
    if joint is None or not joint_rows:
        return W
    at = [joint.names.index(free[i].name) for i in joint_rows]
    L = linalg.cholesky(joint.covariance[np.ix_(at, at)], lower=True)
    W[np.ix_(joint_rows, joint_rows)] = linalg.solve_triangular(L, np.eye(len(at)), lower=True)
    return W


def off_priors(free: Sequence[Free], at: Mapping[str, float], joint: JointPrior | None = None) -> Array:
    """Return the distances (p,) of values from their priors, standard normal before any data; zero without a prior."""
    off: Array = prior_rows(free, joint) @ np.array([at[p.name] - p.prior for p in free])
    return off
