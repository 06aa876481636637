"""What a linear model of any structure lacks: the place, the kind and the values of what is missing, by the search and
the gates that struts have. Elements at every place, families of parts and filters in the signal path compete on one
footing; no name of the library takes part."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np

from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.gap.calibrate import correct_records
from checks.gap.decision.build_result import elements_of, fit_all_bins, verdict_of
from checks.gap.decision.experiments import FinalExplanation
from checks.gap.decision.gates import accepted, judge_claims
from checks.gap.decision.result import UNEXPLAINED, FoundElement, GapVerdict
from checks.gap.decision.rivals import indistinguishable
from checks.gap.decision.unidentified import unidentified_effects
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.element import family
from checks.gap.modelling.thresholds import THRESHOLDS, Thresholds
from checks.gap.modelling.unmodelled_modes import filters
from checks.gap.preparation.inputs import Inputs, Problem
from checks.gap.search.candidates import Search
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import EVERYWHERE, SearchResult, grow
from checks.gap.search.places import Places
from checks.gap.statistics.projected_residual import project
from checks.gap.structures.linear_model import LinearModel
from checks.model.model import Model


@dataclass(frozen=True, eq=False)
class LinearAnswer:
    """The answer about a linear model. elements: of what explains the records, those that passed every gate. faults: of
    the records, corrected before the search. base, best: the model as calibrated, and with what was found; fit: of the
    latter. only_in: if nothing explains the records, channels without which nothing is missing: it lies in the path of
    one of them."""

    verdict: GapVerdict
    elements: tuple[FoundElement, ...]
    faults: tuple[str, ...]
    base: Explanation
    best: Explanation
    fit: Fit
    only_in: tuple[str, ...] = ()

    @property
    def gain(self) -> float:
        """Return the gain in log-likelihood on records that were not fitted."""
        return self.best.lnL - self.base.on(self.best.unseen).lnL

    @cached_property
    def shares(self) -> Mapping[str, float]:
        """Return by place, the best first, the share of what the calibrated model leaves that any dynamic stiffness
        there, or any factor on a channel, explains: where something is, even if it is of no kind."""
        places = Places(project(self.base.response, self.base.unseen, self.base.at))
        gains = {f"{d.place}, {d.direction}": places.gains[d] for d in places.ranked} | places.factors
        return {name: gains[name] / places.left for name in sorted(gains, key=lambda n: -gains[n])}


def explain_linear(
    model: LinearModel,
    A: Dataset,
    B: Dataset,
    *,
    most: int = 2,
    table: Thresholds = THRESHOLDS,
    say: Callable[[str], None] = lambda _: None,
) -> LinearAnswer:
    """Return what a model of any structure lacks. A: responses to fit; B: of another realisation, to judge with, the
    same channels; most: elements or filters that are added one after the other. Raises ModelError."""
    if A.channels != B.channels or not {*A.channels} <= {*model.channels}:
        first, second, has = (", ".join(each) for each in (A.channels, B.channels, model.channels))
        raise ModelError(f"{model.name}: responses of {first} and of {second}; expected the same ones of {has}")
    A, B = (_with_tolerance(d, model.tolerance) for d in (A, B))
    as_of_strut = cast(Model, model)  # it has all that a search asks of one
    problem = Problem(Inputs(as_of_strut, A, B, fs=0.0), A, B, (), None, {}, table)
    search, base = _calibrated(model, problem, say)
    corrected = None if base.adequate else correct_records(search, base, problem)
    if corrected is not None and (again := _calibrated(model, corrected, say))[0].is_complete(again[1]):
        return _explained(corrected, *again, most)
    answer = _explained(problem, search, base, most)
    if answer.verdict == UNEXPLAINED and corrected is not None:
        with_fault = _explained(corrected, *again, most)
        answer = answer if with_fault.verdict == UNEXPLAINED else with_fault
    if answer.verdict != UNEXPLAINED or len(A.channels) < 3:
        return answer
    others = {c: tuple(d.select(x for x in A.channels if x != c) for d in (A, B)) for c in A.channels}
    without = {c: _calibrated(model, replace(problem, A=a, B=b), say) for c, (a, b) in others.items()}
    return replace(answer, only_in=tuple(c for c, (search, base) in without.items() if search.is_complete(base)))


def _explained(problem: Problem, search: Search, base: Explanation, most: int) -> LinearAnswer:
    result = SearchResult(base, base, (), ())
    if not search.is_complete(base):
        result = grow(search, base, EVERYWHERE, most)
    best, faults = result.best, tuple(e.words for e in problem.early)
    problem = replace(problem, A=best.around(problem.A), B=best.around(problem.B))
    fit, full = fit_all_bins(problem, best)
    nothing = LinearAnswer(UNEXPLAINED, (), faults, base, full, fit)
    search = replace(search, A=problem.A.thinned(problem.table.search_bins), B=best.unseen)
    bare = search.refit(base.response, base.at)  # with the same weights
    earned = best is base or best.score - bare.score > problem.table.delta_lnL * len(best.names)
    if not (search.is_complete(best) and earned):
        return nothing
    result = replace(result, base=bare, tried=tuple(c.on(search.B) for c in result.tried))
    claims, _ = judge_claims(search, result, fit, best, None)
    good = accepted(claims)
    rivals = indistinguishable(result, good, problem.table)
    elements = elements_of(problem, FinalExplanation(fit, full, claims, rivals, fitted=result.rivals))
    refused = () if len(good) == len(claims) else unidentified_effects(best, fit, claims, None, problem.table)
    return replace(nothing, verdict=GapVerdict(verdict_of(True, elements, rivals, refused)), elements=elements)


def _calibrated(model: LinearModel, problem: Problem, say: Callable[[str], None]) -> tuple[Search, Explanation]:
    """Return a search with the families and filters of a model as its library, and the calibrated model."""
    A, B = (d.thinned(problem.table.search_bins) for d in (problem.A, problem.B))
    model = replace(model, sensors={c: model.sensors[c] for c in A.channels})
    families = (family(n, tuple(f"share.{s}" for s in of)) for n, of in model.families.items())
    search = Search(A, B, (*families, *filters(A.channels)), problem.table, say, by_prediction=True)
    search, (base,) = search.weighted_by([search.fit(Augmented(cast(Model, model)), {})])
    return search, base


def _with_tolerance(data: Dataset, tolerance: float) -> Dataset:
    """Return data with a relative error of the model on top: of each channel, and of the structure's motion, the root
    mean square of all channels, each in proportion to its usual size. Where a channel hardly moves, large motions
    cancel, and a small part of each is a large part of their sum."""
    size = np.maximum(np.abs(data.H), 1e-300)
    usual = np.exp(np.mean(np.log(size), axis=0))
    motion = np.sqrt(np.mean((size / usual) ** 2, axis=1, keepdims=True)) * usual
    return replace(data, tolerance=tolerance, by_frequency=tolerance * motion / size)
