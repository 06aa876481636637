"""Parameters of a model fitted to measured responses: maximum a posteriori, with an honest covariance."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, stats

from checks.arrays import Array, Complex
from checks.errors import ModelError, NotHeld
from checks.fitting.coordinates import Coordinates, Free
from checks.fitting.dataset import Dataset
from checks.fitting.goodness import Gap, gaps
from checks.fitting.response import Response
from checks.model.model import Model
from checks.model.parameters import rule

COARSE_BINS = 250
ROUGH = 0.3  # of the logarithms in the very first search: an e-fold is three standard deviations
BLUR = 0.1  # tolerance of the first search: with little noise the cost is a narrow, winding valley
STEPS, FEW_STEPS = 60, 25  # of the last search and of those that only lead to it
SPREAD = 1.0  # of further starts, in prior standard deviations
BEYOND_DOUBT = 4.6  # of log likelihood: a ratio of 100
AT_BOUND = 1e-3  # of the standard deviation
CONTRADICTION = (
    "no values of the model come near these responses; check that the time base of every record is right (was one "
    "resampled?), that low and high were taken from the same unit, and that no channels are exchanged"
)


@dataclass(frozen=True, eq=False)
class Fit:
    """names (p,), values (p,), cov (p, p) of the posterior, in the names' units, never rescaled by the residual.

    cost: half the sum of squared whitened residuals plus prior_cost, half that of the priors. residuals: (F, C) of
    every dataset, data minus model. starts: cost of every start. at_bound: names whose value lies on a bound."""

    names: tuple[str, ...]
    values: Array
    cov: Array
    free: tuple[Free, ...]
    cost: float
    prior_cost: float
    converged: bool
    message: str
    at_bound: tuple[str, ...]
    starts: tuple[float, ...]
    datasets: tuple[Dataset, ...]
    residuals: tuple[Complex, ...]

    @property
    def at(self) -> dict[str, float]:
        """Name -> fitted value."""
        return dict(zip(self.names, (float(v) for v in self.values), strict=True))

    @property
    def sds(self) -> dict[str, float]:
        """Name -> standard uncertainty."""
        return dict(zip(self.names, (float(s) for s in np.sqrt(np.diag(self.cov))), strict=True))

    def interval(self, name: str, p: float = 0.95) -> tuple[float, float]:
        """Interval that holds the truth with probability p."""
        half = float(stats.norm.ppf(0.5 + 0.5 * p)) * self.sds[name]
        return self.at[name] - half, self.at[name] + half

    @property
    def gaps(self) -> dict[str, Gap]:
        """G of every channel, all datasets together."""
        return gaps(self.datasets, self.residuals, len(self.names))


def free_of(model: Model, names: Iterable[str] | None = None) -> list[Free]:
    """The model's uncertain parameters with their priors and physical bounds; names: only these, priors where they have
    one. Raises ModelError for an unknown name."""
    wanted = tuple(model.sds) if names is None else tuple(names)
    out = []
    for name in wanted:
        if name not in model.values:
            raise ModelError(f"no parameter '{name}' (has: {', '.join(sorted(model.values))})")
        r = rule(name)
        lo = np.nextafter(r.lo, np.inf) if r.open else r.lo
        out.append(Free(name, model.values[name], model.sds.get(name, np.inf), float(lo), r.hi))
    return out


def fit(
    response: Response,
    datasets: Dataset | Sequence[Dataset],
    free: Sequence[Free],
    *,
    starts: int = 1,
    seed: int = 0,
    coarse_bins: int = COARSE_BINS,
) -> Fit:
    """Maximum a posteriori by a trust-region Gauss-Newton on whitened complex residuals and priors.

    Where the search is led to values with which nothing stands, the ModelError says what to look for in the records.

    starts: how many, the first at the priors, the others drawn about it; each runs on at most coarse_bins bins, the
    best goes on with all. Raises ModelError when nothing is free or no start can be evaluated."""
    sets = (datasets,) if isinstance(datasets, Dataset) else tuple(datasets)
    free = tuple(free)
    if not free or not sets:
        raise ModelError(f"{len(free)} free parameters and {len(sets)} datasets; a fit needs one of each")
    try:
        return _fit(response, sets, free, starts, seed, coarse_bins)
    except NotHeld as e:
        response.frf(sets[0].f, {p.name: p.prior for p in free}, sets[0].channels)  # raises where the start falls over
        raise ModelError(f"{', '.join(s.name for s in sets)}: {CONTRADICTION}; {e}") from e


def _fit(
    response: Response, sets: tuple[Dataset, ...], free: tuple[Free, ...], starts: int, seed: int, coarse_bins: int
) -> Fit:
    few = tuple(replace(s.thinned(coarse_bins), tolerance=max(s.tolerance, BLUR)) for s in sets)
    rough, coarse = _Rough(response, few, free), _FitProblem(response, few, free)
    tried = [coarse.solve(rough.solve(x, FEW_STEPS).x, FEW_STEPS) for x in _starts(free, starts, seed)]
    best = min(tried, key=lambda r: r.cost)
    values = coarse.values(best.x)
    problem = _FitProblem(response, tuple(s.around(response.frf(s.f, values, s.channels)) for s in sets), free)
    return _result(problem, problem.solve(best.x), tuple(float(r.cost) for r in tried))


def calibrate(
    model: Model, datasets: Dataset | Sequence[Dataset], free: Sequence[Free] | None = None, *, starts: int = 1
) -> tuple[Model, Fit]:
    """The model's uncertain parameters fitted, and the form of damping that the data ask for: the model's own, or the
    other one where its likelihood is beyond doubt the larger. Raises ModelError as `fit` does."""
    free = free_of(model) if free is None else free
    own = fit(model, datasets, free, starts=starts)
    other = replace(model, damping="full" if model.damping == "modal" else "modal")
    try:
        other.modal()
    except ModelError:  # a 2-DoF APA has coordinates without mass, so no modal damping
        return model, own
    changed = fit(other, datasets, free, starts=starts)
    # One whitener for both: the tolerance's part of it depends on the model's response.
    as_own = _FitProblem(other, own.datasets, own.free)
    cost = 0.5 * float(np.sum(as_own.residual(as_own.coordinates.x(changed.values)) ** 2))
    return (other, changed) if own.cost - cost > BEYOND_DOUBT else (model, own)


class _FitProblem:
    """Whitened residuals and their derivatives over the coordinates x of the free parameters."""

    def __init__(self, response: Response, sets: tuple[Dataset, ...], free: tuple[Free, ...]) -> None:
        self.response, self.sets, self.free = response, sets, free
        self.names = tuple(p.name for p in free)
        self.coordinates = Coordinates.of(free)
        self.prior = np.array([p.prior for p in free])
        self.weight = np.array([1.0 / p.sd for p in free])

    def values(self, x: Array) -> dict[str, float]:
        return dict(zip(self.names, (float(v) for v in self.coordinates.values(x)), strict=True))

    def modelled(self, x: Array) -> tuple[Complex, ...]:
        """(F, C) of every dataset; zero where the model cannot be built at x, so that the search turns back."""
        values = self.values(x)
        try:
            return tuple(self.response.frf(s.f, values, s.channels) for s in self.sets)
        except ModelError:
            if not x.any():
                raise  # the start itself
            return tuple(np.zeros_like(s.H) for s in self.sets)

    def errors(self, x: Array) -> tuple[Complex, ...]:
        return tuple(s.H - H for s, H in zip(self.sets, self.modelled(x), strict=True))

    def residual(self, x: Array) -> Array:
        white = [s.whitener(e) for s, e in zip(self.sets, self.errors(x), strict=True)]
        return np.concatenate([*white, self.off_prior(x)])

    def off_prior(self, x: Array) -> Array:
        """(p,) standard deviations from the priors."""
        off: Array = (self.coordinates.values(x) - self.prior) * self.weight
        return off

    def jacobian(self, x: Array) -> Array:
        values, slope = self.values(x), self.coordinates.slope(x)
        blocks = []
        for s in self.sets:
            D = self.response.jacobian(s.f, self.names, values, s.channels)
            blocks.append(-s.whitener(D * slope[:, None, None]).T)
        return np.vstack([*blocks, np.diag(slope * self.weight)])

    def solve(self, x: Array, steps: int = STEPS) -> optimize.OptimizeResult:
        lo, hi = self.coordinates.bounds()
        inside = np.clip(x, lo + 1e-9, hi - 1e-9)
        return optimize.least_squares(
            self.residual, inside, self.jacobian, bounds=(lo, hi), xtol=1e-7, ftol=1e-8, gtol=1e-6, max_nfev=steps
        )


class _Rough(_FitProblem):
    """Ratios instead of differences: a peak that is not where it should be then pulls from afar, and misses by what its
    height is in decades, not by its height."""

    def residual(self, x: Array) -> Array:
        parts = []
        for s, H in zip(self.sets, self.modelled(x), strict=True):
            ratio = np.log(_not_zero(s.H) / _not_zero(H)) * self._known(s)
            parts += [ratio.real.ravel(), ratio.imag.ravel()]
        return np.concatenate([*parts, self.off_prior(x)])

    def jacobian(self, x: Array) -> Array:
        values, slope = self.values(x), self.coordinates.slope(x)
        blocks = []
        for s, H in zip(self.sets, self.modelled(x), strict=True):
            D = self.response.jacobian(s.f, self.names, values, s.channels) * slope[:, None, None]
            D = -D * self._known(s) / _not_zero(H)
            blocks += [D.real.reshape(len(slope), -1).T, D.imag.reshape(len(slope), -1).T]
        return np.vstack([*blocks, np.diag(slope * self.weight)])

    @staticmethod
    def _known(s: Dataset) -> Array:
        """(F, C) weight of each logarithm."""
        return 1.0 / np.hypot(ROUGH, np.sqrt(s.noise) / np.abs(_not_zero(s.H)))


def _not_zero(H: Complex) -> Complex:
    return np.where(H == 0.0, 1e-300, H)


def _starts(free: Sequence[Free], starts: int, seed: int) -> list[Array]:
    rng = np.random.default_rng(seed)
    return [np.zeros(len(free)), *(SPREAD * rng.standard_normal((max(starts - 1, 0), len(free))))]


def _result(problem: _FitProblem, found: optimize.OptimizeResult, starts: tuple[float, ...]) -> Fit:
    J, at = found.jac, problem.coordinates
    values, slope = at.values(found.x), at.slope(found.x)
    cov = np.linalg.pinv(J.T @ J, hermitian=True) * np.outer(slope, slope)
    near = AT_BOUND * np.sqrt(np.diag(cov))
    bound = (values - at.lo < near) | (at.hi - values < near)
    return Fit(
        names=problem.names,
        values=values,
        cov=cov,
        free=problem.free,
        cost=float(found.cost),
        prior_cost=0.5 * float(np.sum(problem.off_prior(found.x) ** 2)),
        converged=bool(found.status > 0),
        message=str(found.message),
        at_bound=tuple(n for n, b in zip(problem.names, bound, strict=True) if b),
        starts=starts,
        datasets=problem.sets,
        residuals=problem.errors(found.x),
    )
