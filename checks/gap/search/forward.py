"""Which members of the library, together, explain the data: forward with a beam, then swaps and deletion."""

from collections.abc import Sequence
from dataclasses import dataclass

from checks.gap.search.candidate import Candidate
from checks.gap.search.candidates import BOTH_WAYS, GO_ON, NO_RIVAL, Search


@dataclass(frozen=True, eq=False)
class SearchResult:
    """base: the model without anything added; best: what explains most; rivals: other adequate sets, best first."""

    base: Candidate
    best: Candidate
    rivals: tuple[Candidate, ...]
    tried: tuple[Candidate, ...]


def explain(search: Search, base: Candidate, most: int, width: int) -> SearchResult:
    """Smallest set of at most so many more members that is adequate on B; without one, the set that explains most.
    width: partial explanations that are followed after the first round."""
    beam = [base]
    tried: list[Candidate] = []
    for size in range(1, most + 1):
        if search.over:
            break
        search.say(f"looking for effect {len(base.response.effects) + len(base.response.stand_ins) + size}")
        found: list[Candidate] = []
        for b in beam:
            if found and b.cost > NO_RIVAL * min(c.cost for c in found):
                continue
            found = _distinct([*found, *search.extended(b, {c.names for c in found})])
            adequate = [c for c in found[: 2 * GO_ON] if c.adequate]
            if adequate:
                return _done(search, base, adequate, (*tried, *found))
        if search.over:
            tried += found
            break
        again = search.from_far(found)
        again += [e for c in again[:BOTH_WAYS] if not c.adequate for e in search.rearranged(c)]
        found = _distinct([*again, *found])
        adequate = [c for c in again if c.adequate]
        if adequate:
            return _done(search, base, adequate, (*tried, *found))
        swapped = [c for c in (search.damped_otherwise(c) for c in found[:BOTH_WAYS]) if c is not None]
        found = _distinct([*found, *swapped])
        adequate = [c for c in swapped if c.adequate]
        tried += found
        if adequate:
            return _done(search, base, adequate, tried)
        before = max(b.lnL for b in beam)
        needed = max(search.table.delta_lnL, search.table.progress * -before)
        better = [c for c in found if c.lnL > before + needed]
        if not better:
            break
        beam = better[: width if size == 1 else 1]
    best = search.pruned(max([base, *tried], key=lambda c: c.score))
    return SearchResult(base, best, (), tuple(tried))


def _done(search: Search, base: Candidate, adequate: Sequence[Candidate], tried: Sequence[Candidate]) -> SearchResult:
    best = search.pruned(_preferred(adequate))
    if named := [c for c in search.swapped(best) if c.adequate]:
        adequate = [*adequate, *named]
        best = search.pruned(_preferred([*named, best]))
    best = search.damped_best(best)
    if not best.response.counted:  # the calibration had gone astray, and what it needed was another start
        return SearchResult(best, best, (), tuple(tried))
    return SearchResult(base, best, tuple(c for c in adequate if c.names != best.names), tuple(tried))


def _preferred(adequate: Sequence[Candidate]) -> Candidate:
    """The best that names everything; only where there is none, the best with a stand-in."""
    named = [c for c in adequate if not c.response.stand_ins]
    return max(named or adequate, key=lambda c: c.score)


def _distinct(candidates: Sequence[Candidate]) -> list[Candidate]:
    best: dict[frozenset[str], Candidate] = {}
    for c in sorted(candidates, key=lambda c: -c.score):
        best.setdefault(c.names, c)
    return list(best.values())
