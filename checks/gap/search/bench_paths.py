"""A bench that no file describes: its lags and gains are fitted beside every explanation, within what a bench may add.

Each channel comes some microseconds late, behind filters and converters of its own. Without them no explanation is
complete, or an effect would have to be found as the fourth or fifth of one. With `unmodelled_modes.bench_paths` in the
model, whose priors limit what a bench may add, it is the first.
"""

from dataclasses import replace
from itertools import combinations

import numpy as np

from checks.gap.modelling.effect import Effect
from checks.gap.modelling.unmodelled_modes import bench_paths, is_path
from checks.gap.search.candidate import Candidate
from checks.gap.search.candidates import MANY, POLISH, Search
from checks.gap.search.forward import SearchResult, explain
from checks.gap.search.screen import screen
from checks.gap.statistics.projected_residual import project

BEYOND_ONE = 50.0  # of log-likelihood: four times what a name needs, because a screen is linear
NEARLY = 10.0  # G up to which one more effect may be what is left of an explanation
USUAL = 3.0  # sd of a bench's lags, filters and gains
SAME_LAG_US = 4.0  # lags this near may be one: as well as records tell a lag from a filter
TWO_NAMES = 2  # effects by which lags of three channels are still told by their names


def with_bench_paths(search: Search, base: Candidate) -> Candidate:
    """Return a calibrated candidate with the paths of a bench in it, fitted from its values."""
    response = replace(base.response, members=(*base.response.members, *bench_paths(search.A.channels)))
    held = search.advance(search.begin(response.holding_scatter(base.at), base.at), MANY)
    return search.advance(search.free_scatter(held), POLISH)


def is_usual(bench: Candidate) -> bool:
    """Return whether the paths of a bench leave little of the gap and none of them is larger than usual: a larger gap
    would distort them, and a larger lag is an effect's."""
    paths = [(f"{m.name}.{p.name}", p.sd) for m in bench.response.members if is_path(m) for p in m.parameters]
    return bench.worst_G < NEARLY and all(abs(bench.at[name]) < USUAL * sd for name, sd in paths)


def needs_paths(search: Search, base: Candidate, bench: Candidate) -> bool:
    """Return whether the paths of a bench explain more than any one effect could: lags of several kinds, beside which
    no single effect would be complete."""
    on_A = project(base.response, search.A, base.at)
    largest = max(screen(on_A, m, starts=1).gain for m in search.library)
    return base.cost - bench.cost > 0.5 * largest + BEYOND_ONE


def without_lags(search: Search) -> Search:
    """Return the same search without the lags of the library: beside the paths of a bench, only the priors of the paths
    would favour the name of a lag."""
    return replace(search, library=tuple(m for m in search.library if not (isinstance(m, Effect) and m.lags)))


def in_words(search: Search, found: SearchResult) -> SearchResult | None:
    """Return an explanation in which one or two effects of the library take the place of the bench's paths; None if no
    such explanation is complete."""
    best = found.best
    if len(set(_lags(best))) > TWO_NAMES:
        return None
    paths = [m for m in best.response.members if is_path(m)]
    response = best.response
    for m in paths:
        response = response.without(m.name)
    bare = search.begin(response, {n: v for n, v in best.at.items() if not n.startswith("unnamed_path")})
    lagging = tuple(m for m in search.library if isinstance(m, Effect) and m.lags)
    named = explain(replace(search, library=lagging), bare, TWO_NAMES, 1)
    if not named.is_named:
        return None
    return replace(named, base=found.base, tried=(*found.tried, *named.tried))


def _lags(c: Candidate) -> list[int]:
    """Return the number of the class of each channel's lag: channels of one class are not told apart, and those without
    a lag are in none."""
    tau = np.array([v for n, v in c.at.items() if n.startswith("unnamed_path") and n.endswith("tau_us")])
    group = list(range(tau.size))
    for i, j in combinations(range(tau.size), 2):
        if abs(tau[i] - tau[j]) < SAME_LAG_US:
            group[j] = group[i]
    return [g for g, t in zip(group, tau, strict=True) if abs(t) > SAME_LAG_US]
