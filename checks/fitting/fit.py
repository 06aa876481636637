"""Parameters of a model fitted to measured responses: maximum a posteriori, with an honest covariance."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from checks import distributions as stats
from checks.arrays import Array, Complex
from checks.errors import ModelError, NotHeld
from checks.fitting.coordinates import Coordinates, Free
from checks.fitting.dataset import Dataset
from checks.fitting.descent import EXACT, LOOSE, Descent, descend
from checks.fitting.goodness import Gap, gaps
from checks.fitting.misplaced_modes import PEAKS, peaks
from checks.fitting.prior import prior_rows
from checks.fitting.response import Response
from checks.model.joint_prior import JointPrior
from checks.model.model import Model
from checks.model.parameters import is_mode_factor, rule
from checks.rounding import with_U

COARSE_BINS = 250
ROUGH = 0.3  # of the logarithms in the very first search: an e-fold is three standard deviations
# Tolerances on the way: with little noise the cost is a narrow, winding valley, and a sharp peak of the model feels
# that of the data only once they overlap.
TOLERANCES = (0.1, 0.03, 0.01, 0.003)
STEPS, FEW_STEPS = 60, 15  # of the last search and of those that only lead to it
BEYOND_DOUBT = 4.6  # of log likelihood: a ratio of 100
SPREAD = 1.0  # of further starts, in prior standard deviations
HELD = 1e-4  # of its standard deviation: the prior of a parameter that is held
AS_BEFORE = 0.9  # of its prior's standard deviation: a factor on a mode that is left with more was not determined
AT_BOUND = 1e-3  # of the standard deviation
BESIDE = 30  # parameters: the cost of a step besides derivatives, mainly the modes of a strut
CONTRADICTION = (
    "no values of the model come near these responses; check that the time base of every record is right (was one "
    "resampled?), that low and high were taken from the same unit, and that no channels are exchanged"
)


SHOWN = 4  # values of a fit in its short form
Move = Callable[[Mapping[str, float], Sequence[float]], Sequence[Mapping[str, float]]]


@dataclass(frozen=True, eq=False)
class Fit:
    """names (p,), values (p,), cov (p, p) of the posterior, in the names' units, never rescaled by the residual.

    response: the fitted one, with its fixed parts besides the model. cost: half the sum of squared whitened residuals
    plus prior_cost, half that of the priors. residuals: (F, C) of every dataset, data minus model. starts: cost of
    every start. at_bound: names whose value lies on a bound."""

    response: Response
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
    joint: JointPrior | None = None

    def __repr__(self) -> str:
        found = ", ".join(f"{n} = {with_U(v, 2.0 * self.sds[n])}" for n, v in list(self.at.items())[:SHOWN])
        more = f", and {len(self.names) - SHOWN} more" if len(self.names) > SHOWN else ""
        state = "" if self.converged else f"; did not converge: {self.message}"
        return f"Fit({found}{more}; U with k = 2{state})"

    @property
    def at(self) -> dict[str, float]:
        """Return the fitted values by name."""
        return dict(zip(self.names, (float(v) for v in self.values), strict=True))

    @property
    def sds(self) -> dict[str, float]:
        """Return the standard uncertainties by name."""
        return dict(zip(self.names, (float(s) for s in np.sqrt(np.diag(self.cov))), strict=True))

    @property
    def determined(self) -> list[Free]:
        """Return the free parameters without the factors on modes of which the data say nothing."""
        return [p for p in self.free if not (is_mode_factor(p.name) and self.sds[p.name] > AS_BEFORE * p.sd)]

    def interval(self, name: str, p: float = 0.95) -> tuple[float, float]:
        """Return the interval that holds the truth with probability p."""
        half = float(stats.norm.ppf(0.5 + 0.5 * p)) * self.sds[name]
        return self.at[name] - half, self.at[name] + half

    @property
    def gaps(self) -> dict[str, Gap]:
        """Return G of every channel, all datasets together."""
        return gaps(self.datasets, self.residuals, self.effective_parameters)

    def gaps_at(self, tolerance: float) -> dict[str, Gap]:
        """Return the same with another tolerance: that of the model's file, if the fit went below it."""
        return gaps([replace(s, tolerance=tolerance) for s in self.datasets], self.residuals, self.effective_parameters)

    @property
    def effective_parameters(self) -> float:
        """Return the number of parameters that the data determined; one with a prior counts by the data's share."""
        W = prior_rows(self.free, self.joint)
        return len(self.names) - float(np.einsum("rp,pq,rq->", W, self.cov, W))


def free_of(model: Model, names: Iterable[str] | None = None) -> list[Free]:
    """Return the model's uncertain parameters with their priors and physical bounds; names: only these. The joint prior
    of several parameters is the model's `joint`. Raises ModelError for an unknown name."""
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
    joint: JointPrior | None = None,
    starts: int = 1,
    seed: int = 0,
) -> Fit:
    """Return the maximum a posteriori by damped Gauss-Newton steps on whitened complex residuals and priors; joint:
    prior of several parameters together.

    If the search reaches values at which the strut is not held, the ModelError names the likely fault of the records.

    starts: their number, the first at the priors, the others drawn about it; each runs on `COARSE_BINS` bins at most,
    the best goes on with all. Raises ModelError if nothing is free or no start can be evaluated."""
    points = coarse_fits(response, datasets, free, joint=joint, starts=starts, seed=seed)
    return finish(response, datasets, points[0], joint=joint, tried=points)


@dataclass(frozen=True, eq=False)
class FitPoint:
    """The end of a search on few bins: the free parameters, starting there, the cost, and the work (`work_of`)."""

    free: tuple[Free, ...]
    cost: float
    work: float = 0.0

    @property
    def at(self) -> dict[str, float]:
        return {p.name: p.begin for p in self.free}


def coarse_fits(
    response: Response,
    datasets: Dataset | Sequence[Dataset],
    free: Sequence[Free],
    *,
    joint: JointPrior | None = None,
    starts: int = 1,
    seed: int = 0,
    drawn: bool = False,
    close: bool = False,
    move: Move | None = None,
    also: Sequence[Mapping[str, float]] = (),
) -> list[FitPoint]:
    """Return the ends of searches on few bins with shrinking tolerances, the best first. drawn: start only from draws
    about the start; close: use only the narrowest tolerance, because the wide ones would lead a nearly right start back
    to the nominal values; move: returns the values at which a mode lies at one of some frequencies [Hz], the others
    where they are, to try where the ratio of data to model leaves one out; also: values of some parameters to begin at
    too: the first of the searches, which is on ratios, decides which goes on. Raises ModelError as `fit` does."""
    sets, free = _sets(datasets), tuple(free)
    if not free or not sets:
        raise ModelError(f"{len(free)} free parameters and {len(sets)} datasets; a fit needs one of each")
    few, wider = _on_few_bins(sets)
    problems = [_FitProblem(response, s, free, joint) for s in wider]
    ways = problems[-1:] if close else [_LogRatioProblem(response, few, free, joint), *problems]
    draws = SPREAD * np.random.default_rng(seed).standard_normal((max(starts + drawn - 1, 0), len(free)))
    with _explaining_not_held(response, sets, free):
        others = [ways[0].coordinates.x(np.array([at.get(p.name, p.begin) for p in free])) for at in also]
        ends = [_descend_through(ways, [x, *others], move) for x in [np.zeros(len(free)), *draws][int(drawn) :]]
    size = sum(s.H.size for s in few)
    points = []
    for end in sorted(ends, key=lambda end: end.cost):
        values = ways[-1].coordinates.values(end.x)
        at = tuple(replace(p, start=float(v)) for p, v in zip(free, values, strict=True))
        points.append(FitPoint(at, end.cost, work_of(end.steps, len(free), size)))
    return points


def work_of(steps: int, parameters: int, values: int) -> float:
    """Return the work of so many steps, in derivatives of responses (values: bins times channels)."""
    return float(steps * (parameters + BESIDE) * values)


def finish(
    response: Response,
    datasets: Dataset | Sequence[Dataset],
    point: FitPoint,
    *,
    joint: JointPrior | None = None,
    tried: Sequence[FitPoint] = (),
) -> Fit:
    """Return the fit on all bins, started from the end of a search on few. Raises ModelError."""
    sets = _sets(datasets)
    with _explaining_not_held(response, sets, point.free):
        final = tuple(s.around(response.frf(s.f, point.at, s.channels)) for s in sets)
        problem = _FitProblem(response, final, point.free, joint)
        x = problem.coordinates.x(np.array([p.begin for p in point.free]))
        return _result(problem, descend(problem, x, STEPS, EXACT), tuple(d.cost for d in tried or (point,)))


@contextmanager
def _explaining_not_held(response: Response, sets: Sequence[Dataset], free: Sequence[Free]) -> Iterator[None]:
    """Raise ModelError naming the records' likely fault if a search reaches values at which the strut is not held."""
    try:
        yield
    except NotHeld as e:
        response.frf(sets[0].f, {p.name: p.prior for p in free}, sets[0].channels)  # raises if the start is not held
        raise ModelError(f"{', '.join(s.name for s in sets)}: {CONTRADICTION}; {e}") from e


def _sets(datasets: Dataset | Sequence[Dataset]) -> tuple[Dataset, ...]:
    return (datasets,) if isinstance(datasets, Dataset) else tuple(datasets)


@lru_cache(maxsize=8)
def _on_few_bins(sets: tuple[Dataset, ...]) -> tuple[tuple[Dataset, ...], tuple[tuple[Dataset, ...], ...]]:
    """Return few bins of the datasets, and these at tolerances that shrink towards their own. Cached with their
    whiteners, because every start of a search asks for the same ones."""
    few = tuple(s.thinned(COARSE_BINS) for s in sets)
    own = max(s.tolerance for s in sets)
    wider = [t for t in TOLERANCES if t > own] or [own]
    return few, tuple(tuple(replace(s, tolerance=max(s.tolerance, t)) for s in few) for t in wider)


def _descend_through(ways: "Sequence[_FitProblem]", begun: Sequence[Array], move: Move | None) -> Descent:
    first = [descend(ways[0], x, FEW_STEPS, LOOSE) for x in begun]
    end = min(first, key=lambda e: e.cost)
    steps = sum(e.steps for e in first) - end.steps
    if move is not None and isinstance(ways[0], _LogRatioProblem):
        end = _with_modes_in_place(ways[0], end, move)
    for problem in ways[1:]:
        steps += end.steps
        end = descend(problem, end.x, FEW_STEPS, LOOSE)
    return replace(end, steps=steps + end.steps)


def _with_modes_in_place(problem: "_LogRatioProblem", end: Descent, move: Move) -> Descent:
    """Return the lowest end of a search on ratios that moving one mode after the other leads to.

    On ratios all else finds its place around a mode that is missed, because a peak counts by its height in decades. On
    differences it does not: a peak of the model where the data have none outweighs all bins, and gains fall to hide
    it. So a misplaced mode is moved before, and stays if that is a lower minimum of the same cost."""
    for _ in range(PEAKS):
        ways = move(problem.values(end.x), problem.lacks(end.x))
        starts = (problem.coordinates.x(np.array([way[n] for n in problem.names])) for way in ways)
        ends = [descend(problem, x, FEW_STEPS, LOOSE) for x in starts]
        best = min(ends, key=lambda e: e.cost, default=end)
        steps = end.steps + sum(e.steps for e in ends)
        if not best.cost < end.cost - LOOSE.near:
            return replace(end, steps=steps)
        end = replace(best, steps=steps)
    return end


def resume(response: Response, found: Fit, datasets: Sequence[Dataset]) -> Fit:
    """Return a fit that goes on from another's values, with the same free parameters: on other data, at another
    tolerance, or of a response that differs a little. Raises ModelError."""
    values = found.at
    sets = tuple(s.around(response.frf(s.f, values, s.channels)) for s in datasets)
    problem = _FitProblem(response, sets, found.free, found.joint)
    end = descend(problem, problem.coordinates.x(found.values), STEPS, EXACT)
    return _result(problem, end, found.starts)


def cost_with(found: Fit, name: str, value: float) -> float:
    """Return the least cost of a fit with one parameter held at a value and all others fitted again, on the same bins
    with the same weights: minus the profile of ln L, but for a constant ([PAWITAN01] 3.4). Raises ModelError."""
    k = found.names.index(name)
    own = found.free[k]
    held = replace(own, prior=value, sd=HELD * found.sds[name], start=value)
    free = (*found.free[:k], held, *found.free[k + 1 :])
    near = found.values + found.cov[:, k] / found.cov[k, k] * (value - found.values[k])  # where the others lie then
    near[k] = value
    problem = _FitProblem(found.response, found.datasets, free, found.joint)
    end = descend(problem, np.clip(problem.coordinates.x(near), *problem.bounds()), STEPS, EXACT)
    return end.cost + (0.5 * ((value - own.prior) / own.sd) ** 2 if np.isfinite(own.sd) else 0.0)


def start_as_fit(response: Response, datasets: Dataset | Sequence[Dataset], found: Fit, message: str) -> Fit:
    """Return the start of a fit as a fit of the same free parameters, for a search that ended no better."""
    at = {p.name: p.prior for p in found.free}
    sets = tuple(s.around(response.frf(s.f, at, s.channels)) for s in _sets(datasets))
    problem = _FitProblem(response, sets, tuple(replace(p, start=None) for p in found.free), found.joint)
    x = np.zeros(len(found.free))
    r = problem.residual(x)
    return _result(problem, Descent(problem, x, 0.5 * float(r @ r), False, 0), found.starts, message)


def own_cost(found: Fit) -> float:
    """Return the cost of a fit with the tolerance as a fraction of its own response, to compare ends of searches: as a
    fraction of another response the tolerance may have any size."""
    sets = tuple(s.around(s.H - r) for s, r in zip(found.datasets, found.residuals, strict=True))
    white = [s.whitener(r) for s, r in zip(sets, found.residuals, strict=True)]
    return found.prior_cost + 0.5 * sum(float(w @ w) for w in white)


class _FitProblem:
    """Whitened residuals and their derivatives over the coordinates x of the free parameters."""

    def __init__(
        self, response: Response, sets: tuple[Dataset, ...], free: tuple[Free, ...], joint: JointPrior | None = None
    ) -> None:
        self.response, self.sets, self.free = response, sets, free
        self.names = tuple(p.name for p in free)
        self.coordinates = Coordinates.of(free)
        self.prior = np.array([p.prior for p in free])
        self.joint = joint
        self.weight = prior_rows(free, joint)

    def values(self, x: Array) -> dict[str, float]:
        return dict(zip(self.names, (float(v) for v in self.coordinates.values(x)), strict=True))

    def modelled(self, x: Array) -> tuple[Complex, ...]:
        """Return the response (F, C) for every dataset; zero if none can be built at x, so that a search turns back."""
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
        """Return the distances (p,) from the priors in standard deviations."""
        off: Array = self.weight @ (self.coordinates.values(x) - self.prior)
        return off

    def normal(self, x: Array, r: Array) -> tuple[Array, Array]:
        """Return J'J and J'r of the residuals' derivatives J by x."""
        values, slope = self.values(x), -self.coordinates.slope(x)
        A, g = self.weight.T @ self.weight, -self.weight.T @ r[r.size - len(self.weight) :]
        end = 0
        for s in self.sets:
            begin, end = end, end + 2 * s.H.size
            D = self.response.jacobian(s.f, self.names, values, s.channels)
            of_set = s.whitener.normal(D, r[begin:end])
            A, g = A + of_set[0], g + of_set[1]
        return A * np.outer(slope, slope), g * slope

    def bounds(self) -> tuple[Array, Array]:
        return self.coordinates.bounds()


class _LogRatioProblem(_FitProblem):
    """A fit problem on ratios, not differences: a misplaced peak attracts from far away, by its height in decades."""

    def residual(self, x: Array) -> Array:
        parts = []
        for s, H in zip(self.sets, self.modelled(x), strict=True):
            ratio = np.log(_not_zero(s.H) / _not_zero(H)) * self._log_weights(s)
            parts += [ratio.real.ravel(), ratio.imag.ravel()]
        return np.concatenate([*parts, self.off_prior(x)])

    def normal(self, x: Array, r: Array) -> tuple[Array, Array]:
        """Return J'J and J'r; the derivative of ln(data / model) is that of the model over the model."""
        values, slope = self.values(x), self.coordinates.slope(x)
        blocks = []
        for s, H in zip(self.sets, self.modelled(x), strict=True):
            D = self.response.jacobian(s.f, self.names, values, s.channels)
            D = D * (-self._log_weights(s) / _not_zero(H)) * slope[:, None, None]
            blocks += [D.real.reshape(len(slope), H.size), D.imag.reshape(len(slope), H.size)]
        rows = np.hstack([*blocks, (self.weight * slope).T])
        return rows @ rows.T, rows @ r

    def lacks(self, x: Array) -> list[float]:
        """Return the frequencies [Hz] at which the data are farthest above the model, the worst first."""
        s, H = self.sets[0], self.modelled(x)[0]
        above = np.log(np.abs(_not_zero(s.H) / _not_zero(H))).max(axis=1)
        return peaks(s.f, np.maximum(above, 0.0) ** 2)

    @staticmethod
    def _log_weights(s: Dataset) -> Array:
        """Return the weight (F, C) of each logarithm."""
        return 1.0 / np.hypot(ROUGH, np.sqrt(s.noise) / np.abs(_not_zero(s.H)))


def _not_zero(H: Complex) -> Complex:
    return np.where(H == 0.0, 1e-300, H)


def _result(problem: _FitProblem, found: Descent, starts: tuple[float, ...], message: str = "") -> Fit:
    at = problem.coordinates
    values, slope = at.values(found.x), at.slope(found.x)
    cov = np.linalg.pinv(found.normal, hermitian=True) * np.outer(slope, slope)
    near = AT_BOUND * np.sqrt(np.diag(cov))
    bound = (values - at.lo < near) | (at.hi - values < near)
    return Fit(
        response=problem.response,
        names=problem.names,
        values=values,
        cov=cov,
        free=problem.free,
        cost=found.cost,
        prior_cost=0.5 * float(np.sum(problem.off_prior(found.x) ** 2)),
        converged=found.settled,
        message=message if message or found.settled else f"the search still moved after {found.steps} steps",
        at_bound=tuple(n for n, b in zip(problem.names, bound, strict=True) if b),
        starts=starts,
        datasets=problem.sets,
        residuals=problem.errors(found.x),
        joint=problem.joint,
    )
