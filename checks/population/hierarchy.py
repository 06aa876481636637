"""A batch of units: the mean and the scatter of every uncertain parameter, learned from their fits.

theta_i = mu + u_i, with u_ij ~ t_nu(0, s_j). A unit's fit gives its likelihood as a quadratic (`information`: its prior
taken out again), so that a parameter that a unit does not determine adds nothing. Given scatter and weights, mu and all
units are jointly normal, in closed form; scatter and weights come by expectation and maximisation, mu integrated over.

The scatters of different parameters are taken as independent: five to ten units cannot determine the covariance of a
hundred parameters. The estimate of the mean keeps all its correlations.

Hierarchical updating: [BEHMANESH15]; weights of t tails: [LLT89]; prior of a variance: [GELMAN06]."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, linalg, optimize

from checks import distributions as stats
from checks.arrays import Array

STRENGTH = 3.0  # values
FEW = 3  # parameters of a kind that suffice to show how far a model is off
NU = 4.0  # of the tails: a unit ten scatters off moves the mean as one 0.5 off does
STEPS = 500
SETTLED = 1e-3  # of a scatter, relative, over one step: few units know theirs to a third
LEAST = 1e-6  # of a scatter, in units of the prior's
SAYS = 0.1  # share of the foretold variance that a unit's data must take away before they are compared with it


@dataclass(frozen=True, eq=False)
class Prior:
    """The prior of a batch. mean (p,); mean_sd (p,): how far mu may be off; scatter (p,): 1 sd from unit to unit; both
    count as much as `strength` observed values, or (p,). kinds (p,): parameters of one kind share one factor on their
    scatters and, three or more, one on their mean_sds, so that few units inform all; default: each its own. nu: degrees
    of freedom of the tails; infinite: normal."""

    mean: Array
    mean_sd: Array
    scatter: Array
    kinds: NDArray[np.int_] | None = None
    strength: float | Array = STRENGTH
    nu: float = NU


@dataclass(frozen=True, eq=False)
class Batch:
    """mean (p,) with its covariance mean_cov (p, p); scatter (p,): 1 sd from unit to unit; units (n, p), units_cov
    (n, p, p): every unit's parameters with the batch as their prior; weights (n, p): what each counted for, 1 an
    ordinary one."""

    mean: Array
    mean_cov: Array
    scatter: Array
    units: Array
    units_cov: Array
    weights: Array
    converged: bool

    @property
    def of_one_more(self) -> Array:
        """Return the covariance (p, p) of another unit of the batch: its scatter plus the uncertainty of the mean."""
        return np.asarray(self.mean_cov + np.diag(self.scatter**2))


@dataclass(frozen=True, eq=False)
class Belonging:
    """One unit compared with the batch learned without it. z (p,): the deviation of each parameter, in standard
    deviations of the prediction; not a number if this unit's data do not depend on it. p_all: chance of all deviations
    together, p_worst: of the largest |z| among so many."""

    z: Array
    p_all: float
    p_worst: float


def information(theta: Array, cov: Array, mean: Array, prior_cov: Array) -> tuple[Array, Array]:
    """Return every unit's likelihood from its fit: precision (n, p, p) and pull (n, p), precision times estimate.

    theta (n, p), cov (n, p, p): posterior of each fit, whose prior N(mean, prior_cov) is taken out. Directions that the
    data do not determine get zero precision, whatever rounding gave. Raises numpy.linalg.LinAlgError for a prior that
    is not positive definite."""
    half = np.linalg.cholesky(prior_cov)
    back = linalg.solve_triangular(half, np.eye(mean.size), lower=True)
    precision, pull = np.empty_like(cov), np.empty_like(theta)
    for i, (t, c) in enumerate(zip(theta, cov, strict=True)):
        white = back @ c @ back.T
        left, axes = np.linalg.eigh((white + white.T) / 2)
        left = np.clip(left, np.finfo(float).eps, None)
        ratio = np.where(left < 1.0, 1.0 / left - 1.0, 0.0)
        precision[i] = back.T @ ((axes * ratio) @ axes.T) @ back
        moved = np.where(left < 1.0, axes.T @ (back @ (t - mean)) / left, 0.0)
        pull[i] = back.T @ (axes @ moved) + precision[i] @ mean
    return precision, pull


def learn(precision: Array, pull: Array, prior: Prior) -> Batch:
    """Return the batch from its units' likelihoods: precision (n, p, p), pull (n, p).

    Works in units of the prior's scatter. Not converged: a size still moved after `STEPS` steps."""
    scale = prior.scatter
    both = np.outer(scale, scale)
    P, h = precision * both, (pull - precision @ prior.mean) * scale
    sizes, converged = _Sizes(prior), False
    weights = np.ones_like(h)
    for _ in range(STEPS):
        given = _Likelihoods(P, h, sizes.bias, weights / sizes.scatter**2)
        square = given.square()
        nu, distance = prior.nu, square / sizes.scatter**2  # expected, in scatters, squared
        weights = np.ones_like(distance) if np.isinf(nu) else (nu + 1.0) / (nu + distance)  # under t tails
        change = sizes.fit(weights * square, given)
        if change < SETTLED:
            converged = True
            break
    end = _Likelihoods(P, h, sizes.bias, weights / sizes.scatter**2)
    return Batch(
        mean=prior.mean + scale * end.mean,
        mean_cov=end.mean_cov * both,
        scatter=scale * sizes.scatter / sizes.core,
        units=prior.mean + scale * end.units(),
        units_cov=end.units_cov() * both,
        weights=weights,
        converged=converged,
    )


class _Sizes:
    """The scatters and the biases while they are learned, (p,) each, in units of the prior's scatter.

    A variance is the mean of the stated one, worth `strength` values, and of the squares that were found: the mean of
    its posterior under a scaled inverse chi-square prior whose mean is the stated one."""

    def __init__(self, prior: Prior) -> None:
        p = prior.mean.size
        self.strength, self.core = prior.strength, _core(prior.nu)
        _, self.kind = np.unique(np.arange(p) if prior.kinds is None else prior.kinds, return_inverse=True)
        self.members = np.bincount(self.kind)[self.kind]
        self.stated = prior.mean_sd / prior.scatter
        self.scatter = np.full(p, self.core)
        self.bias = self.stated

    def fit(self, squares: Array, given: "_Likelihoods") -> float:
        """Take a step from the weighted squares (n, p) of distances from the mean; return the largest change."""
        found = self._of_kind(squares.sum(axis=0)) + self.strength * self.core**2
        scatter = np.maximum(np.sqrt(found / (self.strength + len(squares) * self.members)), LEAST)
        off = self._of_kind((given.mean**2 + np.diag(given.mean_cov)) / self.stated**2) + self.strength
        bias = self.stated * np.where(self.members >= FEW, np.sqrt(off / (self.strength + self.members)), 1.0)
        change = max(np.max(np.abs(scatter / self.scatter - 1.0)), np.max(np.abs(bias / self.bias - 1.0)))
        self.scatter, self.bias = scatter, bias
        return float(change)

    def _of_kind(self, each: Array) -> Array:
        """Return the sums (p,) over all parameters of the same kind."""
        return np.asarray(np.bincount(self.kind, each)[self.kind])


class _Likelihoods:
    """Posterior of the mean and every unit, scatter and weights given, in units of the prior's scatter, from its mean.

    P (n, p, p), h (n, p): likelihoods; bias (p,): 1 sd of the mean's prior; tight (n, p): each unit's precision."""

    def __init__(self, P: Array, h: Array, bias: Array, tight: Array) -> None:
        diagonal = np.arange(h.shape[1])
        inner = P.copy()
        inner[:, diagonal, diagonal] += tight
        self.alone = _inverses(inner)  # (n, p, p) covariance of each unit, were the mean known
        self.own = np.einsum("ijk,ik->ij", self.alone, h)
        self.follows = self.alone * tight[:, None, :]  # (n, p, p) how a unit goes with the mean
        curvature = -np.einsum("ij,ijk->jk", tight, self.follows)
        curvature[diagonal, diagonal] += tight.sum(axis=0) + 1.0 / bias**2
        self.mean_cov = _inverses(curvature[None])[0]
        self.mean = self.mean_cov @ np.sum(tight * self.own, axis=0)

    def square(self) -> Array:
        """Return the expected square (n, p) of every unit's distance from the mean."""
        away = self.follows - np.eye(self.mean.size)
        spread = np.sum((away @ self.mean_cov) * away, axis=2)
        return np.asarray((self.own + away @ self.mean) ** 2 + np.diagonal(self.alone, axis1=1, axis2=2) + spread)

    def units(self) -> Array:
        """Return the values (n, p) of the units, given the batch."""
        return np.asarray(self.own + self.follows @ self.mean)

    def units_cov(self) -> Array:
        """Return the covariances (n, p, p) of the units' values, given the batch."""
        return np.asarray(self.alone + self.follows @ self.mean_cov @ self.follows.transpose(0, 2, 1))


def _inverses(stack: Array) -> Array:
    """Return the inverses (n, p, p) of symmetric positive definite matrices, scaled to a unit diagonal first."""
    size = 1.0 / np.sqrt(np.diagonal(stack, axis1=1, axis2=2))
    both = size[:, :, None] * size[:, None, :]
    inverse = np.linalg.inv(stack * both) * both
    return np.asarray((inverse + inverse.transpose(0, 2, 1)) / 2)


@cache
def _core(nu: float) -> float:
    """Return the scale of the t that fits a normal of sd 1 best, so that ordinary units keep their sd."""
    if np.isinf(nu):
        return 1.0

    def score(c: float) -> float:
        def weighted(x: float) -> float:
            return float((nu + 1.0) * (x / c) ** 2 / (nu + (x / c) ** 2) * stats.norm.pdf(x))

        return float(integrate.quad(weighted, -12.0, 12.0)[0]) - 1.0

    return float(optimize.brentq(score, 0.3, 1.0))


def learn_without_each(precision: Array, pull: Array, prior: Prior) -> list[Batch]:
    """Return for every unit the batch learned without it. Raises ValueError for a single unit."""
    n = len(pull)
    if n < 2:
        raise ValueError(f"{n} unit: leaving one out leaves none")
    others = [np.delete(np.arange(n), i) for i in range(n)]
    return [learn(precision[o], pull[o], prior) for o in others]


def compare(precision: Array, pull: Array, batch: Batch) -> Belonging:
    """Compare one unit's likelihood, precision (p, p) and pull (p,), with a batch of other units.

    The unit's data move the expected values. Under the batch these moves have the covariance Q - V: Q the covariance
    before the data, V after."""
    scale = np.sqrt(np.diag(batch.of_one_more))
    both = np.outer(scale, scale)
    Q = batch.of_one_more / both
    V = _inverses((np.linalg.inv(Q) + precision * both)[None])[0]
    moved = V @ ((pull - precision @ batch.mean) * scale)
    values, axes = np.linalg.eigh(Q - V)
    use = values > SAYS * np.max(np.diag(Q))
    d2 = float(np.sum((axes.T @ moved)[use] ** 2 / values[use]))
    share = np.clip(np.diag(Q - V), 0.0, None)
    informed = share > SAYS * np.diag(Q)
    z = np.where(informed, moved / np.sqrt(np.where(informed, share, 1.0)), np.nan)
    worst = float(np.nanmax(np.abs(z))) if informed.any() else 0.0
    count = max(int(informed.sum()), 1)
    p_worst = -np.expm1(count * np.log1p(-2.0 * stats.norm.sf(worst))) if worst > 0.0 else 1.0
    return Belonging(z, float(stats.chi2.sf(d2, int(use.sum()))) if use.any() else 1.0, float(p_worst))


def count_covered(belongings: Sequence[Belonging], level: float = 0.95) -> tuple[int, int]:
    """Return how many parameters of all units lie within the prediction from the others, and how many were compared."""
    z = np.concatenate([np.zeros(0), *(b.z[np.isfinite(b.z)] for b in belongings)])
    return int(np.sum(np.abs(z) <= stats.norm.ppf(0.5 + level / 2))), int(z.size)


def determined_parameters(
    batch: Batch, prior: Prior, correlated: float = 0.9
) -> tuple[Array, tuple[tuple[int, int, float], ...]]:
    """Return the share (p,) of the prior's standard deviation of each mean that the batch leaves (1: nothing was
    learned), and the pairs that it determines only together, with their correlation: those that correlate beyond
    `correlated` although their priors do not."""
    sd, before = np.sqrt(np.diag(batch.mean_cov)), prior.mean_sd
    rho = batch.mean_cov / np.outer(sd, sd)
    i, j = np.triu_indices(sd.size, 1)
    tied = np.abs(rho[i, j]) > correlated
    pairs = [(int(a), int(b), float(rho[a, b])) for a, b in zip(i[tied], j[tied], strict=True)]
    return sd / before, tuple(sorted(pairs, key=lambda pair: -abs(pair[2])))
