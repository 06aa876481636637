"""A bench that no file describes: its lags and gains are fitted beside every explanation, within what a bench may add.

Each channel comes some microseconds late, behind filters and converters of its own. Without them no explanation is
complete, or an effect would have to be found as the fourth or fifth of one. With `unmodelled_modes.bench_paths` in the
model, whose priors limit what a bench may add, it is the first.
"""

from dataclasses import dataclass, replace
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


@dataclass(frozen=True, eq=False)
class OnBench:
    """A calibrated model without and with the paths of a bench, each beside its disagreement: what neither explains
    hardly bends them, be it an effect of the strut or a guide that gives way."""

    without: Explanation
    paths: Explanation

    @property
    def gain(self) -> float:
        """Return the gain of the paths in profile log-likelihood of B."""
        return self.paths.lnL - self.without.lnL

    @property
    def is_usual(self) -> bool:
        """Return whether no path is larger than a bench's: a larger lag is an effect's."""
        sizes = [(f"{m.name}.{p.name}", p.sd) for m in self.paths.response.paths for p in m.parameters]
        return all(abs(self.paths.at[name]) < USUAL * sd for name, sd in sizes)

    def is_needed(self, search: Search) -> bool:
        """Return whether the paths explain more than any one lag of the library could: lags of several kinds, beside
        which no single effect would be complete."""
        lagging = tuple(m for m in search.library if m.lags)
        largest = max((c.lnL - self.without.lnL for c in add_one(search, self.without, lagging)), default=0.0)
        return self.gain > largest + 0.5 * search.table.two_delta_lnL


def on_bench(search: Search, base: Explanation) -> OnBench | None:
    """Return a calibrated candidate on a bench with paths of its own; None if these explain little, or if the strut is
    not held on the way."""
    response = replace(base.response, members=(*base.response.members, *bench_paths(search.A.channels)))
    fits: list[list[Explanation]] = [[], []]
    for at in (base.at, {}):  # a calibration that has gone astray is not followed
        for known, r in zip(fits, (base.response, response), strict=True):
            known += [b for b in (settle_if_held(search, r, at),) if b is not None]
        if not all(fits):
            return None
        bench = OnBench(*(max(known, key=lambda b: b.lnL) for known in fits))
        if bench.gain < LITTLE:
            return None
    return bench


def with_bench_paths(search: Search, bench: OnBench) -> Explanation:
    """Return the model with the paths of a bench: fitted to explain all, if that is adequate, else beside its
    disagreement."""
    response, at = bench.paths.response, bench.paths.at
    whole = search.finish_to_the_end(search.begin(response.holding_scatter(at), at))
    return whole if whole.adequate else search.begin(response, at)


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
