"""The base model fitted to what was measured, before anything may be called missing ([GAP] 3)."""

from dataclasses import replace

from checks.fitting.dataset import Dataset
from checks.fitting.fit import BEYOND_DOUBT
from checks.gap.decision.gates import is_bent
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented, Member
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.modelling.unmodelled_modes import levels, unmodelled_modes
from checks.gap.preparation.inputs import Inputs, Prepared, possible_faults, with_fault
from checks.gap.search.candidate import Candidate
from checks.gap.search.candidates import Effort, Say, Search, quicker
from checks.gap.search.refit import ANNEAL, ANNEAL_STEPS, Refit, begin, blurred

BENT = 0.1  # of a cubic share at the largest sine: noise of a tenth of its power
HALF = 0.5  # of the misfit
WORTH = 100.0  # of log-likelihood: a fault of the records is no small thing
FEW_STEPS = 10
COARSE_BINS = 150  # of a first look at records that may be turned
HOPELESS = 2.0  # times the misfit of the records as they came


def searching(p: Prepared, channels: tuple[str, ...], say: Say, effort: Effort) -> Search:
    """Return a search on some channels, thinned, with the library's effects for them. effort: of the whole analysis."""
    A, B = (d.select(channels).thinned(p.table.search_bins) for d in (p.A, p.B))
    return Search(A, B, _library(p.inputs, channels), p.table, say, effort)


def _library(inputs: Inputs, channels: tuple[str, ...]) -> tuple[Member, ...]:
    named = [e for e in EFFECTS.values() if e.name not in inputs.without and e.fits(inputs.model)]
    seen = [e for e in named if set(e.channels) & set(channels)]
    return (*seen, *unmodelled_modes(channels))


def calibrated(search: Search, p: Prepared) -> Candidate:
    """Return the base model fitted to A, with the more likely form of damping."""
    members: tuple[Member, ...] = ()
    width = _level_dependence(p.slow, bool(p.in_slow), p.table)
    if width:
        members = (levels(p.inputs.merge_Hz, width),)
    # With modal damping, derivatives by the modes' factors take half the time: the first search is for that form.
    given = p.inputs.model
    first = quicker(given) if given.scatters else given
    own = _damped(search, search.fitted(Augmented(first, members), {}, drawn=0))
    if own.adequate or not given.scatters:
        return own
    other = search.elsewhere(own)
    return other if other.adequate or other is own else _damped(search, other)


def _damped(search: Search, own: Candidate) -> Candidate:
    """Return the candidate with the form of damping that is more likely beyond doubt."""
    other = search.damped_otherwise(own)
    return own if other is None or not other.cost < own.cost - BEYOND_DOUBT else other


def turned_right(search: Search, base: Candidate, p: Prepared) -> Prepared | None:
    """Return records in which another sign of a channel, or two channels exchanged, leaves less than half of what is
    missing: the calibration had fitted the fault by wrong values. None if no change does."""
    own = search.A.thinned(COARSE_BINS)
    same = _as_near(search, base, own)  # as the others are: from the priors, so that none gains by another start
    cost = base.cost if same is None else min(base.cost, same.cost * search.A.f.size / own.f.size)
    best, least = None, HALF * cost
    for fault in possible_faults(p):
        other = with_fault(p, fault)
        A = other.A.select(search.A.channels).thinned(COARSE_BINS)
        if (again := _as_near(search, base, A)) is None:
            continue
        turned = again.cost * search.A.f.size / A.f.size
        if turned < least and cost - turned > WORTH:
            best, least = other, turned
    return best


def _as_near(search: Search, base: Candidate, A: Dataset) -> Refit | None:
    """Return the base fitted to records that were turned, the scatter of its modes following; None if an approximate
    model already shows that they are explained no better than the original records."""
    response = base.response.holding_scatter()
    response = replace(response, model=quicker(response.model))  # how modes exchange energy hides no turned channel
    at: dict[str, float] = {}
    own = search.A.thinned(COARSE_BINS)
    for tolerance in (t for t in ANNEAL if t > A.tolerance):
        refit = search.go_on(begin(response, blurred(A, tolerance), at), ANNEAL_STEPS)
        if refit.cost > HOPELESS * begin(base.response, blurred(own, tolerance), base.at).cost:
            return None
        at = refit.at
    return search.go_on(begin(response, A, at), FEW_STEPS)


def _level_dependence(slow: Slow | None, loops: bool, table: Thresholds) -> float:
    """Return the relative difference between two levels of drive that the slow sines show: loops that open with the
    amplitude, a curve that bends."""
    if slow is None:
        return 0.0
    bends = BENT * abs(slow.bends.value) if is_bent(slow, table) else 0.0
    return max(slow.grows.value if loops else 0.0, bends)
