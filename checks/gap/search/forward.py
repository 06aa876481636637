"""Which members of the library, together, explain the data: forward with a beam, then swaps and deletion."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from checks.errors import ModelError
from checks.gap.modelling.effect import Effect
from checks.gap.search.candidates import BOTH_WAYS, GO_ON, MOVES, NO_RIVAL, Effort, Search, best_of_each
from checks.gap.search.disagreement import NEAR, ExplainingStep, search_beside, settle_if_held
from checks.gap.search.explanation import Explanation

BESIDE = 0.5  # of the work of an analysis: kept for each other search, however the first one ended

Stages = Iterator[list[Explanation]]


@dataclass(frozen=True, eq=False)
class SearchResult:
    """base: the model without anything added; best: what explains most; rivals: other adequate sets, best first; steps:
    of a search beside a disagreement, whose result is then `best`."""

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

    def continued_by(self, other: "SearchResult") -> "SearchResult":
        """Return the result together with that of a search that started from its end."""
        return SearchResult(self.base, other.best, other.rivals, (*self.tried, *other.tried))


def explain(search: Search, base: Explanation, most: int, width: int) -> SearchResult:
    """Return the smallest set of at most so many more members of the library that is adequate on B; failing that, the
    set that explains most. width: partial explanations that are followed after the first round."""

    def by_library(beam: Sequence[Explanation]) -> Stages:
        search.say(f"looking for effect {len(beam[0].response.counted) + 1}")
        found: list[Explanation] = []
        for b in beam:
            if not found or b.cost <= NO_RIVAL * min(c.cost for c in found):
                found = best_of_each([*found, *search.add_one(b, {c.names for c in found})])
                yield found
        if search.over:
            return
        again = search.refit_from_priors(found)
        again += [e for c in again[:BOTH_WAYS] if not c.adequate for e in search.with_moved_modes(c, MOVES)]
        yield again
        likeliest = best_of_each([*again, *found])[:BOTH_WAYS]
        yield [c for c in map(search.with_other_damping, likeliest) if c is not None]

    found = _forward(search, base, most, width, by_library)
    return found if found.best.adequate else replace(found, best=search.prune(found.best))


def explain_by_elements(search: Search, base: Explanation, most: int) -> SearchResult:
    """Return the explanation by at most so many generic elements, on top of a candidate; with its rivals, if it is
    adequate."""

    def by_elements(beam: Sequence[Explanation]) -> Stages:
        found = search.add_element(beam[0])
        yield found
        yield search.refit_from_priors(found)

    search.say("looking for places of what is missing")
    search = replace(search, effort=Effort(BESIDE * search.table.effort))  # whatever the library's search has spent
    return _forward(search, base, most, 1, by_elements)


def _forward(
    search: Search, base: Explanation, most: int, width: int, stages: Callable[[Sequence[Explanation]], Stages]
) -> SearchResult:
    """Add at most so many members to a candidate, one after the other. stages: yields what a round finds beside each
    other; the first stage with an adequate explanation ends the search."""
    beam = [base]
    tried: list[Explanation] = []
    for size in range(1, most + 1):
        if search.over:
            break
        found: list[Explanation] = []  # of this round
        for more in stages(beam):
            found = best_of_each([*more, *found])
            if adequate := [c for c in more[: 2 * GO_ON] if c.adequate]:
                return _finish(search, base, adequate, (*tried, *found))
        tried += found
        before = max(b.lnL for b in beam)
        needed = max(search.table.delta_lnL, search.table.progress * -before)
        better = [c for c in found if c.lnL > before + needed]
        if search.over or not better:
            break
        beam = better[: width if size == 1 else 1]
    return SearchResult(base, max([base, *tried], key=lambda c: c.score), (), tuple(tried))


def explain_beside(search: Search, result: SearchResult) -> SearchResult:
    """Return the result of a search beside the disagreement, used if no explanation was complete: an explanation that
    is adequate after all, with its rivals, or one with its steps.

    result: of the search for what explains everything."""
    base = result.base
    search = replace(search, effort=Effort(BESIDE * search.table.effort))
    steps = search_beside(search, base)
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
        for r in (r for r in step.near(last.names) if not r.member.stands_in):
            at = less.at | {f"{r.member.name}.{k}": v for k, v in r.whole.of(r.member.name).items()}
            with suppress(ModelError):  # the strut is not held at such values: no rival
                rivals.append(search.refit(less.response.with_member(r.member), at))
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
    if named := [c for c in search.swap_members(best) if c.adequate]:
        adequate = [*adequate, *named]
        best = search.prune(_prefer_named([*named, best]))
    elsewhere = [c for c in search.with_elements_elsewhere(best) if c.adequate]
    adequate, best = [*adequate, best, *elsewhere], max([best, *elsewhere], key=lambda c: c.score)
    damped = search.with_likelier_damping(best)
    if damped is not best and damped.adequate:  # its rivals are compared with the same form
        near = (c for c in adequate if c.score > best.score - NEAR and c.names != best.names)
        adequate = [c for c in map(search.with_other_damping, near) if c is not None and c.adequate]
        best = damped
    if not best.response.counted:  # the calibration had gone astray, and what it needed was another start
        return SearchResult(best, best, (), tuple(tried))
    return SearchResult(base, best, tuple(c for c in adequate if c.names != best.names), tuple(tried))


def _prefer_named(adequate: Sequence[Explanation]) -> Explanation:
    """Return the best candidate without unmodelled modes; failing that, the best one with them."""
    named = [c for c in adequate if not c.response.unmodelled_modes]
    return max(named or adequate, key=lambda c: c.score)
