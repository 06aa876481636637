"""A bench that no file describes: its lags and gains are fitted beside every explanation, within what a bench may add.

Each channel comes some microseconds late, behind filters and converters of its own. Without them no explanation is
complete, or an effect would have to be found as the fourth or fifth of one. With `unmodelled_modes.bench_paths` in the
model, whose priors limit what a bench may add, it is the first.
"""

from dataclasses import replace
from itertools import combinations

import numpy as np

from checks.arrays import Array
from checks.gap.modelling.unmodelled_modes import USUAL_LAG_US, bench_paths
from checks.gap.search.candidates import Search
from checks.gap.search.disagreement import add_one, settle_if_held
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import SearchResult, explain

LITTLE = 25.0  # of profile log-likelihood, twice what a name needs: paths that explain less are no bench's
USUAL = 4.0  # sd of a bench's lags, filters and gains
SAME_LAG_US = 4.0  # lags this near may be one: as well as records tell a lag from a filter
TWICE = 2.0  # the usual lag: an amplifier, a filter and a converter's latency together
TWO_NAMES = 2  # effects by which lags of three channels are still told by their names


def on_bench(search: Search, base: Explanation) -> Explanation | None:
    """Return a calibrated candidate with the paths of a bench: fitted to explain all, if that is adequate, else beside
    its disagreement. None if they explain little, if one of them is larger than a bench's, or if the strut is not held
    on the way. Both are compared beside their disagreements: what neither explains hardly bends them, be it an effect
    of the strut or a guide that gives way."""
    response = replace(base.response, members=(*base.response.members, *bench_paths(search.A.channels)))
    fits: list[list[Explanation]] = [[], []]
    for at in (base.at, {}):  # a calibration that has gone astray is not followed
        for known, r in zip(fits, (base.response, response), strict=True):
            known += [b for b in (settle_if_held(search, r, at),) if b is not None]
        if not all(fits):
            return None
        bare, paths = (max(known, key=lambda b: b.lnL) for known in fits)
        if paths.lnL - bare.lnL < LITTLE:
            return None
    usual = (abs(paths.at[f"{m.name}.{p.name}"]) < USUAL * p.sd for m in response.paths for p in m.parameters)
    if not all(usual) or not _is_needed(search, bare, paths):
        return None
    whole = search.finish_to_the_end(search.begin(response.holding_scatter(paths.at), paths.at))
    return whole if whole.adequate else search.begin(response, paths.at)


def _is_needed(search: Search, bare: Explanation, paths: Explanation) -> bool:
    """Return whether the paths explain more than any one lag of the library could: lags of several kinds, beside which
    no single effect would be complete."""
    lagging = tuple(m for m in search.library if m.lags)
    largest = max((c.lnL - bare.lnL for c in add_one(search, bare, lagging)), default=0.0)
    return paths.lnL - bare.lnL > largest + 0.5 * search.table.two_delta_lnL


def without_lags(search: Search) -> Search:
    """Return the same search without the lags of the library: beside the paths of a bench, only the priors of the paths
    would favour the name of a lag."""
    return replace(search, library=tuple(m for m in search.library if not m.lags))


def in_words(search: Search, found: SearchResult) -> SearchResult | None:
    """Return an explanation in which one or two effects of the library take the place of the bench's paths; None if no
    such explanation is complete, or if every channel lags as on many a bench: which part of it causes what is not seen
    then."""
    best = found.best
    tau = np.array([v for n, v in best.at.items() if n.startswith("unnamed_path") and n.endswith("tau_us")])
    is_usual = np.abs(tau).min() > SAME_LAG_US and np.abs(tau).max() < TWICE * USUAL_LAG_US  # every lag
    if is_usual or len(set(_lags(tau))) > TWO_NAMES:
        return None
    paths = best.response.paths
    response = best.response.without(*(m.name for m in paths))
    bare = search.begin(response, {n: v for n, v in best.at.items() if not n.startswith("unnamed_path")})
    lagging = tuple(m for m in search.library if m.lags)
    named = explain(replace(search, library=lagging), bare, TWO_NAMES, 1)
    if not named.is_named:
        return None
    return replace(named, base=found.base, tried=(*found.tried, *named.tried))


def _lags(tau: Array) -> list[int]:
    """Return the number of the class of each channel's lag tau [us]: channels of one class are not told apart, and
    those without a lag are in none."""
    group = list(range(tau.size))
    for i, j in combinations(range(tau.size), 2):
        if abs(tau[i] - tau[j]) < SAME_LAG_US:
            group[j] = group[i]
    return [g for g, t in zip(group, tau, strict=True) if abs(t) > SAME_LAG_US]
