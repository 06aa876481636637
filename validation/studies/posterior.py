"""Intervals of named values against the posterior that they approximate: a sampler on the likelihood and priors of the
last fit.

    python -m validation.studies.posterior [--units 3] [--steps 6000] [--sampler metropolis|emcee] [--seed N]

Intervals come from the curvature at the optimum. The sampler starts there and makes no such assumption: where the
posterior is skewed or has tails, its quantiles differ from the interval. `metropolis` is a random walk of the shape of
the fit's covariance ([ROBERTS97]). `emcee` is the affine-invariant ensemble ([GOODMAN10]) of the package of that name
([FOREMAN13]), which is installed apart (`pip install emcee`) and shares nothing with this project; its steps are
evaluations of the density over all walkers, so that both cost the same.
"""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from accept.gap.analyse_unit import analyse
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting import Fit
from checks.fitting.fit import FitPoint, finish
from checks.fitting.prior import prior_rows
from checks.gap import Result
from checks.gap.decision.result import EXPLAINED
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.thresholds import THRESHOLDS
from validation.model_files import write_model
from validation.sets import SETS, draw_set
from validation.shell import require_matrices
from validation.studies.arguments import parser_of

SEED = 20261210
STEPS = 6000
BURNT = 0.2  # of the steps, before the chain is at home
QUANTILES = (0.025, 0.975)
SET = replace(SETS["exact"], shares={"one": 1.0}, effects=("misalignment", "crosstalk", "joint_axial_compliance"))


def sample(lnp: Callable[[Array], float], start: Array, cov: Array, steps: int, rng: np.random.Generator) -> Array:
    """Return the states (steps, p) of a random walk with steps of the shape of a covariance."""
    L = np.linalg.cholesky(cov) * 2.38 / np.sqrt(start.size)
    x, now, out = start, lnp(start), np.empty((steps, start.size))
    for k in range(steps):
        new = x + L @ rng.standard_normal(start.size)
        there = lnp(new)
        if np.log(rng.random()) < there - now:
            x, now = new, there
        out[k] = x
    return out


def sample_ensemble(
    lnp: Callable[[Array], float], start: Array, cov: Array, steps: int, rng: np.random.Generator
) -> Array:
    """Return states (about steps, p) of an ensemble of walkers that begins as drawn from a covariance, its first part
    (`BURNT`) still in. Raises SystemExit if emcee is not installed."""
    try:
        import emcee
    except ImportError as e:
        raise SystemExit("--sampler emcee needs the package emcee: pip install emcee") from e
    walkers = 2 * (start.size + 1)
    at = start + 0.5 * rng.standard_normal((walkers, start.size)) @ np.linalg.cholesky(cov).T
    kept = [x if np.isfinite(lnp(x)) else start + 1e-3 * (x - start) for x in at]
    walk: Any = emcee.EnsembleSampler(walkers, start.size, lnp)
    walk.random_state = np.random.RandomState(int(rng.integers(2**31))).get_state()
    walk.run_mcmc(np.array(kept), max(steps // walkers, 2))
    return np.asarray(walk.get_chain().reshape(-1, start.size))


SAMPLERS = {"metropolis": sample, "emcee": sample_ensemble}


def density(response: Augmented, fit: Fit) -> Callable[[Array], float]:
    """Return the logarithm of the posterior density of a fit, but for a constant."""
    (data,) = fit.datasets
    W, prior = prior_rows(fit.free, fit.joint), np.array([p.prior for p in fit.free])
    lo, hi = (np.array([getattr(p, end) for p in fit.free]) for end in ("lo", "hi"))

    def lnp(x: Array) -> float:
        if (x < lo).any() or (x > hi).any():
            return -np.inf
        try:
            H = response.frf(data.f, dict(zip(fit.names, map(float, x), strict=True)), data.channels)
        except ModelError:  # the strut is not held there
            return -np.inf
        r, off = data.whitener(data.H - H), W @ (x - prior)
        return -0.5 * float(r @ r + off @ off)

    return lnp


def compared(
    result: Result, steps: int, rng: np.random.Generator, sampler: str = "metropolis"
) -> Mapping[str, tuple[float, ...]]:
    """Return parameter -> ends of the interval and of the sampled one, of every named effect. The fit is made once more
    on the bins of the search, for both alike."""
    response = result.after.response
    (data,) = result.fit.datasets
    free = tuple(response.free(result.fit.at))
    fit = finish(response, data.thinned(THRESHOLDS.search_bins), FitPoint(free, 0.0), joint=response.model.joint)
    states = SAMPLERS[sampler](density(response, fit), fit.values, fit.cov, steps, rng)
    states = states[int(BURNT * len(states)) :]
    names = [n for n in fit.names if n.partition(".")[0] in response.names]
    ends = {n: np.quantile(states[:, fit.names.index(n)], QUANTILES) for n in names}
    return {n: (*fit.interval(n), *map(float, ends[n])) for n in names}


def table(found: Sequence[tuple[float, float]], sampler: str) -> str:
    """Return a row of the widths of sampled intervals over the stated ones, and of their shifts in U."""
    ratio, shift = (np.array(x) for x in zip(*found, strict=True))
    low, median, high = np.quantile(ratio, (0.0, 0.5, 1.0))
    head = "| sampler | values | width over the stated one: median [least, most] | shift in U: RMS, largest |"
    sizes = f"{np.sqrt(np.mean(shift**2)):.3f}, {np.abs(shift).max():.3f}"
    row = f"| {sampler} | {ratio.size} | {median:.2f} [{low:.2f}, {high:.2f}] | {sizes} |"
    return "\n".join([head, "|---|---|---|---|", row])


def main() -> None:
    """Print interval and quantiles of every named value, then both over all of them."""
    parser = parser_of(__doc__, 3, SEED)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--sampler", choices=list(SAMPLERS), default="metropolis")
    a = parser.parse_args()
    require_matrices()
    found: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory(prefix="posterior-") as place:
        model = write_model(SET, Path(place) / "model")
        for batch in draw_set("exact", a.seed, a.units, of=SET):
            for case in batch.judge:
                result = analyse(case.write(Path(place)), model).result
                if result.verdict != EXPLAINED:
                    print(f"{case.serial}: {result.verdict}")
                    continue
                rng = np.random.default_rng(case.seed)
                for name, (lo, hi, q_lo, q_hi) in compared(result, a.steps, rng, a.sampler).items():
                    ratio = (q_hi - q_lo) / (hi - lo)
                    shift = ((q_lo + q_hi) - (lo + hi)) / (hi - lo)
                    found.append((ratio, shift))
                    print(
                        f"{case.serial} {name}: interval {lo:.5g} .. {hi:.5g}, sampled {q_lo:.5g} .. {q_hi:.5g}, "
                        f"width {ratio:.2f}, shifted by {shift:+.2f} of U",
                        flush=True,
                    )
    if found:
        print(table(found, a.sampler))


if __name__ == "__main__":
    main()
