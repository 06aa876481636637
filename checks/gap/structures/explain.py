"""What a linear model of any structure lacks: the place, the kind and the values of what is missing, by the search that
struts have. Elements at every place, families of parts and filters in the signal path compete on one footing; no name
of the library takes part."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np

from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit
from checks.gap.calibrate import correct_records
from checks.gap.decision.build_result import fit_all_bins
from checks.gap.decision.elements import Unnamed, found_element
from checks.gap.decision.result import AMBIGUOUS, EXPLAINED, NO_MISSING, UNEXPLAINED, FoundElement, GapVerdict
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import HOLDER, PARTS, RESONATOR, GenericElement, element, family, is_across, kinds_at
from checks.gap.modelling.thresholds import THRESHOLDS, Thresholds
from checks.gap.modelling.unmodelled_modes import filters
from checks.gap.preparation.inputs import Inputs, Problem
from checks.gap.search.candidates import Search, best_of_each
from checks.gap.search.explanation import Alternative, Explanation
from checks.gap.search.places import Places
from checks.gap.search.screen import screen
from checks.gap.statistics.projected_residual import project
from checks.gap.structures.linear_model import LinearModel
from checks.model.model import Model

# A filter is one explanation among others here and no stand-in for a name that the library may have.
LINEAR = replace(THRESHOLDS, parsimony=0.0)
REWEIGHTED = 2


@dataclass(frozen=True, eq=False)
class LinearAnswer:
    """elements: what explains the records; empty if nothing is missing or nothing explains them. faults: of the
    records, corrected before the search. base, best: the model as calibrated, and with what was found; fit: of the
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
        whole = float(places.projected.left @ places.projected.left)
        gains = {f"{d.place}, {d.direction}": places.gains[d] for d in places.ranked} | places.factors
        return {name: gains[name] / whole for name in sorted(gains, key=lambda n: -gains[n])}


def explain_linear(
    model: LinearModel,
    A: Dataset,
    B: Dataset,
    *,
    most: int = 2,
    table: Thresholds = LINEAR,
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
    if corrected is not None and _is_complete(*(again := _calibrated(model, corrected, say))):
        return _explained(corrected, *again, most)
    answer = _explained(problem, search, base, most)
    if answer.verdict == UNEXPLAINED and corrected is not None:
        with_fault = _explained(corrected, *again, most)
        answer = answer if with_fault.verdict == UNEXPLAINED else with_fault
    if answer.verdict != UNEXPLAINED or len(A.channels) < 3:
        return answer
    others = {c: tuple(d.select(x for x in A.channels if x != c) for d in (A, B)) for c in A.channels}
    without = {c: _calibrated(model, replace(problem, A=a, B=b), say) for c, (a, b) in others.items()}
    return replace(answer, only_in=tuple(c for c, found in without.items() if _is_complete(*found)))


def _explained(problem: Problem, search: Search, base: Explanation, most: int) -> LinearAnswer:
    best, tried = base, [base]
    for _ in range(most):
        if search.over or _is_complete(search, best):
            break
        found = [*search.add_one(best), *search.add_element(best, in_path=True)]
        found += [s for c in found if not _are_of_their_kinds(c) for s in _of_simple_kinds(search, c)]
        found = [c for c in best_of_each(found) if _are_of_their_kinds(c)]
        tried += found
        first = max(found, key=lambda c: (_is_complete(search, c), c.score), default=best)
        if not first.score > best.score + problem.table.delta_lnL:
            break
        search, best = _reweighted(search, first)
    best = search.prune(best)
    alike = [c for c in tried if len(c.names) == len(best.names) and c.adequate]
    alike = [search.refit(c.response, c.at) for c in alike]  # with the same weights as the best
    near = best_of_each([*alike, *search.with_elements_elsewhere(best)])
    near = [c for c in near if 2.0 * (best.score - c.score) < problem.table.two_delta_lnL and _is_complete(search, c)]
    fit, full = fit_all_bins(problem, best)
    faults = tuple(e.words for e in problem.early)
    if not _is_complete(search, best) or any(n.partition(".")[0] in best.names for n in fit.at_bound):
        return LinearAnswer(UNEXPLAINED, (), faults, base, full, fit)
    elements = tuple(_found(m, best, near, fit) for m in best.response.members if isinstance(m, Unnamed))
    several = any(len(e.places) > 1 for e in elements)
    verdict = (AMBIGUOUS if several else EXPLAINED) if elements else NO_MISSING
    return LinearAnswer(verdict, elements, faults, base, full, fit)


def _calibrated(model: LinearModel, problem: Problem, say: Callable[[str], None]) -> tuple[Search, Explanation]:
    """Return a search with the families and filters of a model as its library, and the calibrated model."""
    A, B = (d.thinned(problem.table.search_bins) for d in (problem.A, problem.B))
    model = replace(model, sensors={c: model.sensors[c] for c in A.channels})
    families = (family(n, tuple(f"share.{s}" for s in of)) for n, of in model.families.items())
    search = Search(A, B, (*families, *filters(A.channels)), problem.table, say)
    return _reweighted(search, search.fit(Augmented(cast(Model, model)), {}))


def _found(member: Unnamed, best: Explanation, near: Sequence[Explanation], fit: Fit) -> FoundElement:
    """Return a member in words, with all that does as well in its place."""
    swapped = [(m, c) for c in near for m in c.response.members if c.names == best.names - {member.name} | {m.name}]
    others = [Alternative(m, c) for m, c in swapped if isinstance(m, Unnamed) and m.name not in best.names]
    return found_element(member, others, fit, best.response.model)


def _are_of_their_kinds(c: Explanation) -> bool:
    return all(_is_of_its_kind(m, c) for m in c.response.members)


def _is_of_its_kind(member: Effect, c: Explanation) -> bool:
    """Return whether a member has values that its kind can have: what swings does so within the band, nothing is taken
    away that was not there, and nothing comes before its cause. Others are signs of another class."""
    own, f = c.of(member.name), c.unseen.f
    if isinstance(member, GenericElement) and is_across(member.place):
        own = {n: v for n, v in own.items() if not n.startswith("k_")}  # a part may be softer than drawn
    positive = ("k_", "m_kg", "J_", "c_", "tau_")
    swings = "damping_ratio" not in own or f[0] < own["f_Hz"] < f[-1]
    return swings and all(v > 0.0 for n, v in own.items() if n.startswith(positive))


def _of_simple_kinds(search: Search, c: Explanation) -> Iterator[Explanation]:
    """Yield a candidate with a spring, a mass or a damper in the place of an element with more values: if the values of
    the others are not physical, one of these explains the data."""
    for m in c.response.members:
        if isinstance(m, GenericElement) and m.kind in (HOLDER, RESONATOR):
            parts = [element(m.place, m.direction, kind) for kind in kinds_at(m.place, PARTS)]
            yield from search.with_parts(c, m, parts)


def _is_complete(search: Search, c: Explanation) -> bool:
    """Return whether chance explains what a candidate leaves, and no family of parts is off together by more than
    chance, though each of them may be so alone."""
    families = (m for m in search.library if isinstance(m, GenericElement) and m.name not in c.names)
    return c.adequate and not any(screen(c.seen, m).p < c.table.p_global for m in families)


def _with_tolerance(data: Dataset, tolerance: float) -> Dataset:
    """Return data with a relative error of the model on top: of each channel, and of the structure's motion, the root
    mean square of all channels, each in proportion to its usual size. Where a channel hardly moves, large motions
    cancel, and a small part of each is a large part of their sum."""
    size = np.maximum(np.abs(data.H), 1e-300)
    usual = np.exp(np.mean(np.log(size), axis=0))
    motion = np.sqrt(np.mean((size / usual) ** 2, axis=1, keepdims=True)) * usual
    return replace(data, tolerance=tolerance, by_frequency=tolerance * motion / size)


def _reweighted(search: Search, c: Explanation) -> tuple[Search, Explanation]:
    """Return the search and a candidate with the tolerance as a fraction of what the candidate predicts."""
    for _ in range(REWEIGHTED):
        A, B = (d.around(c.response.frf(d.f, c.at, d.channels)) for d in (search.A, search.B))
        search = replace(search, A=A, B=B)
        c = search.refit(c.response, c.at)
    return search, c
