"""The verdict: names with their numbers, effects that cannot be distinguished, and the one word ([GAP] 10 to 12)."""

from collections.abc import Mapping, Sequence

import numpy as np

from checks.fitting.fit import Fit
from checks.gap.decision.alternatives import Unnamed
from checks.gap.decision.gates import Claim
from checks.gap.decision.result import (
    AMBIGUOUS,
    EXPLAINED,
    NO_MISSING,
    PARTLY,
    UNEXPLAINED,
    Ambiguous,
    FoundElement,
    Named,
    NamedValue,
    Nameless,
)
from checks.gap.modelling.effect import Effect, SlowFinding
from checks.gap.preparation.record_faults import RecordFault
from checks.model.model import Model
from checks.quantity import TWO_SIDED_95


def named_effects(
    claims: Sequence[Claim],
    final: Fit,
    early: tuple[RecordFault, ...],
    in_slow: Mapping[Effect, SlowFinding],
    model: Model,
) -> tuple[Named, ...]:
    """Return the named effects in the order in which they were found: before the search, by it, in the slow sines.
    claims: those that passed every gate."""
    out = []
    for fault in early:
        exact = {k: NamedValue(v, v, v) for k, v in fault.parameters.items()}
        out.append(Named(fault.effect, fault.effect.replace("_", " "), fault.words, exact, float("inf"), 0.0))
    for claim in claims:
        effect = claim.effect
        if isinstance(effect, Unnamed):
            continue
        shown = {p.name: _fitted_value(final, effect, p.name, model) for p in effect.parameters}
        out.append(_named(effect, shown, claim.delta_lnL, claim.p))
    for effect, finding in in_slow.items():
        halves = finding.half_widths
        shown = {k: NamedValue(v, v - halves[k], v + halves[k]) for k, v in finding.values.items()}
        out.append(_named(effect, shown, finding.delta_lnL, finding.p))
    return tuple(out)


def _fitted_value(final: Fit, effect: Effect, name: str, model: Model) -> NamedValue:
    """Return a fitted value with its interval, which includes what the units of a learned batch have in common."""
    at, (lo, hi) = final.at[f"{effect.name}.{name}"], final.interval(f"{effect.name}.{name}")
    targets = (t for p in effect.parameters if p.name == name for t in p.targets(model))
    common = TWO_SIDED_95 * max((abs(model.common_offset(t)) for t in targets), default=0.0)
    half = float(np.hypot(hi - at, common))
    return NamedValue(at, at - half, at + half) if common else NamedValue(at, lo, hi)


def _named(effect: Effect, shown: Mapping[str, NamedValue], delta_lnL: float, p: float) -> Named:
    """Return an effect with the sentence of these values and intervals, which `made_again` compares."""
    words = effect.say({k: v.value for k, v in shown.items()}, {k: (v.hi - v.lo) / 2 for k, v in shown.items()})
    return Named(effect.name, effect.title, words, shown, delta_lnL, p)


def verdict_of(
    adequate: bool,
    named: Sequence[Named | FoundElement],
    rivals: Sequence[Ambiguous],
    missing: Sequence[Nameless],
) -> str:
    """Return the verdict. adequate: of the whole explanation, on unseen records; named: effects and elements."""
    if adequate and not missing:
        if rivals or any(isinstance(n, FoundElement) and (n.alike or len(n.places) > 1) for n in named):
            return AMBIGUOUS
        return EXPLAINED if named else NO_MISSING
    return PARTLY if named or rivals else UNEXPLAINED
