"""The verdict: names with their numbers, effects that cannot be distinguished, and the one word ([GAP] 10 to 12)."""

from collections.abc import Mapping, Sequence

from checks.fitting.fit import Fit
from checks.gap.decision.aliases import imitation
from checks.gap.decision.gates import Claim, is_bent
from checks.gap.decision.result import (
    AMBIGUOUS,
    EXPLAINED,
    NO_MISSING,
    PARTLY,
    UNEXPLAINED,
    Ambiguous,
    Named,
    NamedValue,
    Nameless,
)
from checks.gap.effects import effect_named
from checks.gap.modelling.effect import Effect, SlowFinding
from checks.gap.modelling.experiment import sharpest
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.preparation.record_faults import Early
from checks.gap.search.candidate import Candidate
from checks.gap.search.forward import SearchResult


def named_effects(
    good: Sequence[Claim], final: Fit, early: tuple[Early, ...], in_slow: Mapping[Effect, SlowFinding]
) -> tuple[Named, ...]:
    """Return the named effects in the order in which they were found: before the search, by it, in the slow sines."""
    out = [Named(e.effect, e.effect.replace("_", " "), e.words, _exact(e), float("inf"), 0.0) for e in early]
    for claim in good:
        effect = claim.effect
        values = {p.name: final.at[f"{effect.name}.{p.name}"] for p in effect.parameters}
        shown = {k: NamedValue(v, *final.interval(f"{effect.name}.{k}")) for k, v in values.items()}
        words = effect.say(values, {k: (v.hi - v.lo) / 2 for k, v in shown.items()})
        out.append(Named(effect.name, effect.title, words, shown, claim.delta_lnL, claim.p))
    return (*out, *(_from_slow(effect, found) for effect, found in in_slow.items()))


def _exact(e: Early) -> dict[str, NamedValue]:
    return {k: NamedValue(v, v, v) for k, v in e.parameters.items()}


def _from_slow(effect: Effect, found: SlowFinding) -> Named:
    halves = found.half_widths
    shown = {k: NamedValue(v, v - halves[k], v + halves[k]) for k, v in found.values.items()}
    return Named(effect.name, effect.title, effect.say(found.values, halves), shown, found.delta_lnL, found.p)


def not_told_apart(found: SearchResult, good: Sequence[Claim], table: Thresholds) -> tuple[Ambiguous, ...]:
    """Return the names of other adequate explanations that unseen records do not distinguish from the best."""
    names = found.best.names
    out = []
    for claim in good:
        alike = {claim.effect.name}
        for rival in found.rivals:
            swapped = rival.names - names
            if rival.response.stand_ins or names - rival.names != {claim.effect.name} or len(swapped) != 1:
                continue
            # An explanation with more parameters has to earn them, or whatever is flexible would rival every name.
            apart = max(found.best.lnL - rival.lnL, found.best.score - rival.score)
            if 2.0 * apart < table.two_delta_lnL:
                alike |= swapped
        if len(alike) > 1:
            asked = sharpest(effect_named(name).experiment for name in sorted(alike))
            out.append(Ambiguous(tuple(sorted(alike)), asked.value))
    return tuple(out)


def imitated(full: Candidate, good: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return the named effects that calibrated parameters imitate: only their priors favour the effect."""
    found = ((c.effect, imitation(full, c.effect)) for c in good)
    return tuple(
        Ambiguous((effect.name, f"other values of {', '.join(by)}"), effect.experiment.value)
        for effect, by in found
        if by
    )


def bent(slow: Slow | None, table: Thresholds) -> tuple[Nameless, ...]:
    """Return the bend of the static curve between drive and displacement as an unidentified effect; the library has no
    effect for it."""
    if slow is None or not is_bent(slow, table):
        return ()
    words = f"under slow sines de bends: the cubic part of the curve is {slow.bends.value:.3f} of the straight one"
    return (Nameless("de", (), (), True, words),)


def word(adequate: bool, named: Sequence[Named], rivals: Sequence[Ambiguous], missing: Sequence[Nameless]) -> str:
    """Return the verdict. adequate: of the whole explanation, on unseen records."""
    if adequate and not missing:
        if rivals:
            return AMBIGUOUS
        return EXPLAINED if named else NO_MISSING
    return PARTLY if named or rivals else UNEXPLAINED
