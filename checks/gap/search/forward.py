"""One search: members are added to an explanation one after the other, stage by stage: from the library, elements at
every place, beside a disagreement, or, for a model without a library, all at once; then swaps and deletion."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from checks.errors import ModelError
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import RESONATOR, ROCKING, GenericElement, kind_of, parts_of
from checks.gap.modelling.unmodelled_modes import MODE, UnmodelledMode
from checks.gap.search.candidates import BOTH_WAYS, GO_ON, MOVES, NO_RIVAL, Search, best_of_each
from checks.gap.search.disagreement import add_one, required_gain, settle_if_held
from checks.gap.search.explanation import Explanation
from checks.gap.search.places import Places

NEAR = 15.0  # of score: rivals that are compared once more beside everything else, and by full likelihood
NEARLY_ALL = 0.75  # of what a filter explains: a rival's place has more, if its dynamic stiffness may be anything

Beam = Sequence[Explanation]
Rounds = Iterator[list[Explanation]]


@dataclass(frozen=True)
class SearchStage:
    """A way to look for one more member. rounds: yields what is found on top of some candidates, beside each other, by
    falling score; followed: of all that, the candidates that are worth one more member, the best first."""

    rounds: Callable[[Search, Beam], Rounds]
    followed: Callable[[Search, Beam, Beam], list[Explanation]]


@dataclass(frozen=True, eq=False)
class ExplainingStep:
    """One more member in an explanation. before: without it; after: with it; rivals: with others in its place, the best
    first."""

    before: Explanation
    after: Explanation
    rivals: tuple[Explanation, ...]

    @property
    def member(self) -> Effect:
        return self.after.added

    def near(self, names: Collection[str]) -> list[Explanation]:
        """Return the rivals that come near. names: of members that are there already."""
        least = self.after.score - NEAR
        return [r for r in self.rivals if r.score > least and r.added.name not in names]


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The result of a search. base: the model without anything added; best: what explains most; rivals: other adequate
    sets, best first; steps: by which it was found."""

    base: Explanation
    best: Explanation
    rivals: tuple[Explanation, ...]
    tried: tuple[Explanation, ...]
    steps: tuple[ExplainingStep, ...] = ()

    @property
    def is_named(self) -> bool:
        """Return whether the explanation is complete and consists of named effects only."""
        return self.best.adequate and not self.best.response.unmodelled_modes

    @property
    def is_final(self) -> bool:
        """Return whether the explanation is complete, and named effects of which it needs each."""
        return self.is_named and not has_needless_effect(self.best)

    @property
    def is_one_mode(self) -> bool:
        """Return whether one unmodelled mode explains everything: what an effect explains beside a gap that remains is
        then a part of what the mode does, as its static gain looks like a scale."""
        response = self.best.response
        return self.best.adequate and len(response.unmodelled_modes) == 1 and not response.effects

    @property
    def is_filter(self) -> bool:
        """Return whether a filter of the signal path is claimed."""
        return any(isinstance(e, UnmodelledMode) for e in self.best.response.effects)

    def before(self, other: "SearchResult") -> "SearchResult":
        """Return the result of a search that started from the end of this one, together with it."""
        return replace(other, base=self.base, tried=(*self.tried, *other.tried))


def grow(search: Search, start: Explanation, stage: SearchStage, most: int, width: int = 1) -> SearchResult:
    """Add at most so many members to an explanation, one after the other. width: candidates that are followed after the
    first round, later ones follow the best alone. What a round finds first that is complete ends the search."""
    beam = [start]
    tried: list[Explanation] = []
    steps: list[ExplainingStep] = []
    for size in range(1, most + 1):
        if search.over:
            break
        found: list[Explanation] = []  # of this round
        for more in stage.rounds(search, beam):
            found = best_of_each([*more, *found])
            first = sorted(more[: 2 * GO_ON], key=lambda c: not search.is_complete(c))
            weighted, first = search.weighted_by(first)
            if complete := [c for c in first if weighted.is_complete(c)]:
                return _finish(weighted, start, complete, (*tried, *found))
        tried += found
        if not (better := stage.followed(search, beam, found)):
            break
        steps.append(ExplainingStep(beam[0], better[0], tuple(c for c in found if c is not better[0])))
        search, beam = search.weighted_by(better[: width if size == 1 else 1])
    return SearchResult(start, max([start, *tried], key=lambda c: c.score), (), tuple(tried), tuple(steps))


def _by_library(search: Search, beam: Beam) -> Rounds:
    search.say(f"looking for effect {len(beam[0].response.counted) + 1}")
    found: list[Explanation] = []
    for b in beam:
        if not found or b.cost <= NO_RIVAL * min(c.cost for c in found):
            found = best_of_each([*found, *search.add_one(b, {c.names for c in found})])
            yield found
    if search.over:
        return
    again = search.refit_from_priors(found)
    nearest = [c for c in best_of_each([*again, *found])[:BOTH_WAYS] if not c.adequate]
    again += [e for c in nearest for e in search.with_moved_modes(c, MOVES)]
    yield again
    likeliest = best_of_each([*again, *found])[:BOTH_WAYS]
    yield [c for c in map(search.with_other_damping, likeliest) if c is not None]


def _by_elements(search: Search, beam: Beam) -> Rounds:
    search.say("looking for places of what is missing")
    found = search.add_element(beam[0])
    yield found
    yield search.refit_from_priors(found, NO_RIVAL)


def _beside(search: Search, beam: Beam) -> Rounds:
    yield add_one(search, beam[0])


def _everywhere(search: Search, beam: Beam) -> Rounds:
    found = [*search.add_one(beam[0]), *search.add_element(beam[0], in_path=True)]
    for c in [c for c in found if not c.possible]:  # an element of one value in its place may be
        simpler = ((m, parts_of(m)) for m in c.response.members)
        found += [s for m, parts in simpler for s in search.with_parts(c, m, parts)]
    yield [c for c in best_of_each(found) if c.possible]


def _those_that_progress(search: Search, beam: Beam, found: Beam) -> list[Explanation]:
    """Return the candidates that gain what a name needs, and so much of the misfit that few members may explain all."""
    before = max(b.lnL for b in beam)
    needed = max(search.table.delta_lnL, search.table.progress * -before)
    return [c for c in found if c.lnL > before + needed]


def _those_that_take_half(search: Search, beam: Beam, found: Beam) -> list[Explanation]:
    """Return those of them that take half of the misfit or more, as the better of two that explain all does."""
    return [c for c in _those_that_progress(search, beam, found) if c.lnL > 0.5 * beam[0].lnL]


def _first_effect(search: Search, beam: Beam, found: Beam) -> list[Explanation]:
    """Return the best candidate whose new member stands in for no name, if it gains enough."""
    first = next((c for c in found if not c.added.stands_in), None)
    return [first] if first and first.lnL - beam[0].lnL > required_gain(search.table, first.added) else []


LIBRARY = SearchStage(_by_library, _those_that_progress)
ELEMENTS = SearchStage(_by_elements, _those_that_take_half)
BESIDE = SearchStage(_beside, _first_effect)
EVERYWHERE = SearchStage(_everywhere, _first_effect)


def explain(search: Search, base: Explanation, most: int, width: int) -> SearchResult:
    """Return the smallest set of at most so many more members of the library that is adequate on B; failing that, the
    set that explains most. width: partial explanations that are followed after the first round."""
    found = grow(search, base, LIBRARY, most, width)
    return found if found.best.adequate else replace(found, best=search.prune(found.best))


def as_filter(search: Search, library: SearchResult, elements: SearchResult) -> SearchResult | None:
    """Return a filter in the path of one channel, or in the drive, as an explanation of everything: the one mode that
    explains all beside the library's effects or, on the channel that any factor explains best, one beside a calibration
    without that channel. Its rivals are those like it and the elements. None if there is no such filter.

    elements: of the search for these alone, which tries none if any factor on one channel explains as much as they."""
    base = library.base
    places = Places(base.on(search.A).seen)
    if library.is_one_mode:
        near = [c for c in library.rivals if len(c.response.counted) == 1 and c.score > library.best.score - NEAR]
        filters = [_claimed(c) for c in (library.best, *near)]
    else:
        channel = max(places.factors, key=lambda c: places.factors[c])
        filters = search.with_effort_of_its_own().add_filter(base, channel)
    filters = [c for c in filters if c.adequate and c.possible and _is_bump(c)]
    if not filters:
        return None
    first, *rivals = sorted(filters, key=lambda c: -c.score)
    found: Beam = elements.tried
    if not found and places.largest > NEARLY_ALL * 2.0 * (base.cost - first.cost):
        search.say("looking for what does as well as a filter")
        found = search.with_effort_of_its_own().add_element(base, in_path=True)
    rivals += [c for c in found if c.adequate and c.possible]
    best = max((first, *rivals), key=lambda c: c.score)
    if best.score < first.score + search.table.delta_lnL:  # what an element has to gain beyond every filter
        best = first
    return replace(library, best=best, rivals=tuple(c for c in (first, *rivals) if c is not best))


def _is_bump(c: Explanation) -> bool:
    """Return whether an explanation is a filter with a pole in the band: lags and gains are the library's."""
    return all(isinstance(m, UnmodelledMode) and m.shape is MODE for m in c.response.counted)


def _claimed(c: Explanation) -> Explanation:
    """Return an explanation whose unmodelled modes no longer stand in for a name."""
    modes = c.response.unmodelled_modes
    members = tuple(replace(m, stands_in=False) if m in modes else m for m in c.response.members)
    return replace(c, response=replace(c.response, members=members))


def explain_beside(search: Search, result: SearchResult) -> SearchResult:
    """Return the result of a search beside the disagreement, used if no explanation was complete: an explanation that
    is adequate after all, with its rivals, or one with its steps.

    result: of the search for what explains everything."""
    search.say("looking beside what is left")
    base, search = result.base, search.with_effort_of_its_own()
    if result.is_one_mode:  # then only an explanation of everything counts, which has no stand-in
        search = replace(search, library=tuple(m for m in search.library if not m.stands_in))
    begun = [c for at in (base.at, {}) if (c := settle_if_held(search, base.response, at)) is not None]
    steps = grow(search, max(begun, key=lambda c: c.lnL), BESIDE, search.table.most_effects).steps
    if not steps:
        return result
    steps = (*steps[:-1], _from_better_start(search, steps[-1], result))
    last = steps[-1].after
    own = search.refit(last.response, last.at)
    tried = (*result.tried, *(search.begin(s.after.response, s.after.at) for s in steps))
    if not own.adequate:
        return SearchResult(base, last, (), tried, steps)
    rivals = []
    for step in steps:
        less = last.without(step.member.name)
        for r in (r for r in step.near(last.names) if not r.added.stands_in):
            at = less.at | {f"{r.added.name}.{k}": v for k, v in r.of(r.added.name).items()}
            with suppress(ModelError):  # the strut is not held at such values: no rival
                rivals.append(search.refit(less.response.with_member(r.added), at))
    adequate = [own, *(c for c in rivals if c.adequate)]
    return _finish(search, base, adequate, (*tried, own, *rivals))


def _from_better_start(search: Search, step: ExplainingStep, result: SearchResult) -> ExplainingStep:
    """Return the last step at its best from where the search for everything ended with the same members: beside a large
    disagreement the weights hide what a calibration that has gone astray would have to come back from."""
    alike = [c for c in (result.best, *result.tried) if c.names == frozenset(step.after.response.names)]
    if not alike:
        return step
    start = max(alike, key=lambda c: c.lnL)
    found = settle_if_held(search, start.response, start.at)
    return replace(step, after=found) if found is not None and found.lnL > step.after.lnL else step


def is_within_tolerance(c: Explanation, effect: Effect, most: float) -> bool:
    """Return whether no channel has a larger G without an effect of a candidate, everything else at the same values."""
    return c.without(effect.name).worst_G < most


def has_needless_effect(c: Explanation) -> bool:
    """Return whether one of several effects changes no channel by more than the tolerance: a model is right to its
    tolerance only, and what single bins hold beside a right name invites any narrow effect."""
    effects = c.response.effects
    return len(effects) > 1 and any(is_within_tolerance(c, e, c.table.G) for e in effects)


def _finish(
    search: Search, base: Explanation, adequate: Sequence[Explanation], tried: Sequence[Explanation]
) -> SearchResult:
    """Return the result of a search that found adequate candidates: the best of them without the members that it does
    not need, with effects in the place of unmodelled modes if these do as well, and with the form of damping that the
    data ask for; the others are its rivals."""
    best = search.prune(_prefer_named(adequate))
    if named := [c for c in search.swap_members(best) if search.is_complete(c) and c.possible]:
        adequate = [*adequate, *named]
        best = search.prune(_prefer_named([*named, best]))
    elsewhere = [c for c in search.with_elements_elsewhere(best) if search.is_complete(c) and c.possible]
    adequate = [*adequate, best, *elsewhere]
    worth = [c for c in (best, *elsewhere) if _is_worth_rocking(c, adequate)]
    best = max(worth or [best], key=lambda c: (c.possible, c.score))
    damped = search.with_likelier_damping(best)
    if damped is not best and damped.adequate:  # its rivals are compared with the same form
        near = (c for c in adequate if c.score > best.score - NEAR and c.names != best.names)
        adequate = [c for c in map(search.with_other_damping, near) if c is not None and c.adequate]
        best = damped
    if not best.response.counted:  # the calibration had gone astray, and what it needed was another start
        return SearchResult(best, best, (), tuple(tried))
    return SearchResult(base, best, tuple(c for c in adequate if c.names != best.names), tuple(tried))


def _is_worth_rocking(c: Explanation, others: Sequence[Explanation]) -> bool:
    """Return whether a candidate has no rocking payload, or one that does better than a mass that hangs there by what
    two explanations are told apart with: it does the same with two values more."""
    if not any(kind_of(m) == ROCKING for m in c.response.effects):
        return True
    hangs = [o.lnL for o in others if any(kind_of(m) == RESONATOR and m.place == "payload" for m in _elements(o))]
    return c.lnL > max(hangs, default=-np.inf) + 0.5 * c.table.two_delta_lnL


def _elements(c: Explanation) -> list[GenericElement]:
    return [m for m in c.response.effects if isinstance(m, GenericElement)]


def _prefer_named(adequate: Sequence[Explanation]) -> Explanation:
    """Return the best candidate without unmodelled modes; failing that, the best one with them."""
    named = [c for c in adequate if not c.response.unmodelled_modes]
    return max(named or adequate, key=lambda c: c.score)
