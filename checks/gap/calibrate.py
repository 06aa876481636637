"""The base model fitted to what was measured, before anything may be called missing ([GAP] 3)."""

from math import inf

from checks.fitting.calibrate import of_damping
from checks.fitting.fit import BEYOND_DOUBT
from checks.gap.decision.gates import is_bent
from checks.gap.effects import EFFECTS
from checks.gap.inputs import Inputs, Prepared, possible_faults, with_fault
from checks.gap.modelling.augmented import Augmented, Member
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.unmodelled_modes import levels, unmodelled_modes
from checks.gap.search.forward import COARSE_BINS, Candidate, Say, Search
from checks.gap.search.levenberg_marquardt import annealed, go_on
from checks.gap.thresholds import Thresholds

BENT = 0.1  # of a cubic share at the largest sine: noise of a tenth of its power
HALF = 0.5  # of the misfit
WORTH = 100.0  # of log-likelihood: a fault of the records is no small thing
FEW_STEPS = 10


def searching(p: Prepared, channels: tuple[str, ...], say: Say, until: float = inf) -> Search:
    """A search on some channels, thinned, with what the library holds for them. until: processor time [s] at which it
    ends with what it has."""
    A, B = (d.select(channels).thinned(p.table.search_bins) for d in (p.A, p.B))
    return Search(A, B, _library(p.inputs, channels), p.table, say, until)


def _library(inputs: Inputs, channels: tuple[str, ...]) -> tuple[Member, ...]:
    named = [e for e in EFFECTS.values() if e.name not in inputs.without and e.fits(inputs.model)]
    seen = [e for e in named if set(e.channels) & set(channels)]
    return (*seen, *unmodelled_modes(channels))


def calibrated(search: Search, p: Prepared) -> Candidate:
    """The base model fitted to A, with the form of damping that the data ask for."""
    members: tuple[Member, ...] = ()
    width = _level_dependence(p.slow, bool(p.in_slow), p.table)
    if width:
        members = (levels(p.inputs.merge_Hz, width),)
    # With modal damping, derivatives by the modes' factors take half the time: the first search is for that form.
    given = p.inputs.model
    first = (of_damping(given, "modal") if given.scatters else None) or given
    own = search.fitted(Augmented(first, members), {})
    other = search.damped_otherwise(own)
    if other is None:
        return own
    return other if other.cost < own.cost - BEYOND_DOUBT else own


def turned_right(search: Search, base: Candidate, p: Prepared) -> Prepared | None:
    """Records in which another sign of a channel, or two channels exchanged, leaves less than half of what is missing:
    the model had bent itself to what no value of it means. None where nothing does."""
    best, least = None, HALF * base.cost
    for fault in possible_faults(p):
        other = with_fault(p, fault)
        A = other.A.select(search.A.channels).thinned(COARSE_BINS)
        again = go_on(annealed(base.response, A, {}), FEW_STEPS)
        cost = again.cost * search.A.f.size / A.f.size
        if cost < least and base.cost - cost > WORTH:
            best, least = other, cost
    return best


def _level_dependence(slow: Slow | None, loops: bool, table: Thresholds) -> float:
    """By how much two levels of drive may differ, as the slow sines show: loops that open with the amplitude, a curve
    that bends."""
    if slow is None:
        return 0.0
    bends = BENT * abs(slow.bends.value) if is_bent(slow, table) else 0.0
    return max(slow.grows.value if loops else 0.0, bends)
