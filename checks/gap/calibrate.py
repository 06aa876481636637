"""The base model fitted to what was measured, before anything may be called missing ([GAP] 3)."""

from dataclasses import replace

from checks.fitting.calibrate import quicker
from checks.fitting.dataset import Dataset
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.unmodelled_modes import levels, unmodelled_modes
from checks.gap.preparation.inputs import Problem, possible_faults, with_fault
from checks.gap.search.candidates import WIDER_STEPS, WIDER_TOLERANCES, Effort, Say, Search
from checks.gap.search.explanation import Explanation
from checks.gap.search.residuals import with_tolerance

BENT = 0.1  # of a cubic share at the largest sine: noise of a tenth of its power
HALF = 0.5  # of the misfit
WORTH = 100.0  # of log-likelihood: a fault of the records is no small thing
FEW_STEPS = 10
COARSE_BINS = 150  # of a first look at records that may be turned
HOPELESS = 2.0  # times the misfit of the records as they came


def search_on(problem: Problem, say: Say, effort: Effort) -> Search:
    """Return a search on thinned records, with the library's effects for their channels. effort: of the whole
    analysis."""
    channels = problem.A.channels
    A, B = (d.thinned(problem.table.search_bins) for d in (problem.A, problem.B))
    effects = [e for e in problem.effects if e.fits(problem.inputs.model) and set(e.channels) & set(channels)]
    return Search(A, B, (*effects, *unmodelled_modes(channels)), problem.table, say, effort)


def calibrate(search: Search, problem: Problem) -> Explanation:
    """Return the base model fitted to A, with the more likely form of damping. A unit has the misalignment that its
    batch has in common or, if that agrees with no values, one within the scatter of the batch."""
    width = _level_dependence(problem)
    members: tuple[Effect, ...] = (levels(problem.inputs.merge_Hz, width),) if width else ()
    # With modal damping, derivatives by the modes' factors take half the time: the first search is for that form.
    given = problem.inputs.model
    of_batch = {n for n in (given.joint.names if given.joint else ()) if n.startswith("misalignment.")}
    like_all = replace(given, sds={n: sd for n, sd in given.sds.items() if n not in of_batch}) if of_batch else given
    first = quicker(like_all) if given.scatters else like_all
    own = search.with_likelier_damping(search.fit(Augmented(first, members), {}, drawn=0))
    if of_batch and not own.adequate:
        own_place = replace(own.response, model=replace(own.response.model, sds=given.sds))
        within = search.fit_from_one_place(own_place, {})  # without it the calibration has gone astray
        own = within if within.adequate and within.on(problem.B).adequate else own
    if own.adequate or not given.scatters:
        return own
    other = search.fit_elsewhere(own)
    return other if other.adequate or other is own else search.with_likelier_damping(other)


def _level_dependence(problem: Problem) -> float:
    """Return the relative difference between two levels of drive that the slow sines show: loops that open with the
    amplitude, a curve that bends."""
    slow = problem.slow
    if slow is None:
        return 0.0
    bend = BENT * abs(slow.bends.value) if slow.is_bent(problem.table) else 0.0
    opens = slow.grows.value if problem.in_slow or slow.opens(problem.table) else 0.0
    return max(opens, bend)


def correct_records(search: Search, base: Explanation, problem: Problem) -> Problem | None:
    """Return the problem with one more fault of the records corrected, another sign of a channel or two channels
    exchanged, if that leaves less than half of what is missing: the calibration had fitted the fault by wrong values.
    None if no correction does."""
    own = search.A.thinned(COARSE_BINS)
    same = _calibrate_coarsely(search, base, own)  # as the others: from the priors, so that none gains by its start
    cost = base.cost if same is None else min(base.cost, same.cost * search.A.f.size / own.f.size)
    best, least = None, HALF * cost
    for fault in possible_faults(problem):
        other = with_fault(problem, fault)
        A = other.A.select(search.A.channels).thinned(COARSE_BINS)
        if (again := _calibrate_coarsely(search, base, A)) is None:
            continue
        corrected = again.cost * search.A.f.size / A.f.size
        if corrected < least and cost - corrected > WORTH:
            best, least = other, corrected
    return best


def _calibrate_coarsely(search: Search, base: Explanation, A: Dataset) -> Explanation | None:
    """Return the base fitted to corrected records, the scatter of its modes following; None if an approximate model
    already shows that they are explained no better than the original records."""
    response = base.response.holding_scatter()
    response = replace(response, model=quicker(response.model))  # how modes exchange energy hides no turned channel
    at: dict[str, float] = {}
    original = search.A.thinned(COARSE_BINS)
    for tolerance in (t for t in WIDER_TOLERANCES if t > A.tolerance):
        blurred = search.on(with_tolerance(A, tolerance))
        c = blurred.advance(blurred.begin(response, at), WIDER_STEPS)
        if c.cost > HOPELESS * search.on(with_tolerance(original, tolerance)).begin(base.response, base.at).cost:
            return None
        at = c.at
    on_A = search.on(A)
    return on_A.advance(on_A.begin(response, at), FEW_STEPS)
