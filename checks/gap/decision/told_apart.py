"""Explanations that the unit's own responses do not distinguish, distinguished by its experiments ([GAP] 11).

Every rival is fitted to A of all conditions and compared on B of all. Two effects are distinguished as two explanations
are on one condition. An effect and other values of calibrated parameters that imitate it are compared with next to no
prior of those values: otherwise the priors would decide, and they were used before.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from checks import distributions as stats
from checks.errors import ModelError
from checks.fitting.fit import Fit
from checks.gap.conditions.joint import Conditions, Explanation, by_data_alone
from checks.gap.decision.gates import LOOKED, Claim, off_zero
from checks.gap.decision.result import Ambiguous
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented, Values
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.search.candidate import Candidate
from checks.gap.search.forward import SearchResult

FAR = 3.0  # prior standard deviations from which on a calibrated value is said


@dataclass(frozen=True, eq=False)
class Settled:
    """The result of the experiments: the explanation with its fit to all conditions, its claims, the effects that still
    cannot be distinguished, and the decisions, in words."""

    fit: Fit
    full: Candidate
    made: tuple[Claim, ...]
    rivals: tuple[Ambiguous, ...]
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _State:
    response: Augmented
    at: Values
    made: tuple[Claim, ...]
    rivals: tuple[Ambiguous, ...]
    words: tuple[str, ...] = ()

    def decided(self, claim: Claim, kept: tuple[Claim, ...], words: str) -> "_State":
        rivals = tuple(a for a in self.rivals if claim.effect.name not in a.effects)
        made = tuple(k for c in self.made for k in (kept if c is claim else (c,)))
        return replace(self, made=made, rivals=rivals, words=(*self.words, words))

    def undecided(self, words: str) -> "_State":
        return replace(self, words=(*self.words, words))


def settled(
    found: SearchResult,
    full: Candidate,
    made: Sequence[Claim],
    rivals: Sequence[Ambiguous],
    conditions: Conditions,
    table: Thresholds,
) -> Settled:
    """Decide between rival explanations by the unit's experiments. full: the explanation that was found, with its
    values; made: its claims; rivals: effects that cannot be distinguished without experiments."""
    few = conditions.thinned(table.search_bins)
    state = _State(full.response, full.at, tuple(made), tuple(rivals))
    for claim in made:
        mine = {name for a in rivals if claim.effect.name in a.effects for name in a.effects} - {claim.effect.name}
        if mine:
            try:
                state = _one(state, claim, mine, few, found, table)
            except ModelError as e:
                state = state.undecided(f"the experiments do not settle {claim.effect.name}: {e}")
    last = conditions.explained(state.response, state.at)
    names = {p.name for p in state.response.free()}
    at = {n: v for n, v in last.fit.at.items() if n in names}
    full = replace(full, response=state.response, at=at, cost=last.fit.cost)
    words = (*state.words, *_moved(state.response, last.fit, found))
    return Settled(last.fit, full, state.made, state.rivals, words)


def _one(
    state: _State, claim: Claim, mine: set[str], few: Conditions, found: SearchResult, table: Thresholds
) -> _State:
    """Decide between one claim and its rivals."""
    ranked = [(claim.effect, few.explained(state.response, state.at))]
    wanted = state.response.names
    for name in sorted(mine & EFFECTS.keys()):
        names = frozenset({*wanted, name} - {claim.effect.name})
        rival = next(c for c in found.rivals if c.names == names)
        ranked.append((EFFECTS[name], few.explained(rival.response, rival.at)))
    ranked.sort(key=lambda each: -each[1].lnL)
    effect, best = ranked[0]
    if len(ranked) > 1 and (apart := 2.0 * (best.lnL - ranked[1][1].lnL)) < table.two_delta_lnL:
        both = " and ".join(e.name for e, _ in ranked[:2])
        return state.undecided(f"the experiments do not tell {both} apart (2 delta lnL {apart:.1f})")
    return _against_values(state, claim, effect, best, few, table)


def _against_values(
    state: _State, claim: Claim, effect: Effect, best: Explanation, few: Conditions, table: Thresholds
) -> _State:
    """Return whether an effect is needed even if calibrated values may be anything."""
    alone = by_data_alone(best.response, effect)
    less = alone.without(effect.name)
    free = few.explained(alone, best.fit.at, far=True)
    near = {n: v for n, v in free.fit.at.items() if not n.startswith(f"{effect.name}.")}
    # A rival that was not followed to its best would make a name: it begins at every place that is known.
    other = max((few.explained(less, at, far=True) for at in (near, {})), key=lambda e: -e.fit.cost)
    gain = free.lnL - other.lnL
    sure = off_zero(table, effect, best.fit, best)
    bound = any(n.startswith(f"{effect.name}.") for n in best.fit.at_bound)
    if gain > table.delta_lnL and sure and not bound:
        p = float(min(1.0, LOOKED * stats.chi2.sf(2.0 * gain, max(1, len(effect.parameters)))))
        kept = state.decided(
            claim, (Claim(effect, gain, p, ()),), f"the experiments leave {effect.name} (gain {gain:.0f})"
        )
        return replace(kept, response=best.response, at=best.fit.at)
    if gain < table.delta_lnL and _excluded(claim.effect, state.at, effect, free.fit, table):
        words = f"{effect.name} is not needed: other values of calibrated parameters explain every condition"
        dropped = state.decided(claim, (), words)
        return replace(dropped, response=less, at=other.fit.at)
    return state.undecided(f"the experiments do not settle whether {effect.name} is needed (gain {gain:.1f})")


def _excluded(claimed: Effect, at: Values, effect: Effect, free: Fit, table: Thresholds) -> bool:
    """Return whether an effect as large as the claimed one would have shown."""
    if effect is not claimed:
        return False
    names = [f"{effect.name}.{p.name}" for p in effect.parameters]
    i = [free.names.index(n) for n in names]
    away = np.array([at[n] for n in names]) - free.values[i]
    return bool(0.5 * away @ np.linalg.pinv(free.cov[np.ix_(i, i)], hermitian=True) @ away > table.delta_lnL)


def _moved(response: Augmented, fit: Fit, found: SearchResult) -> tuple[str, ...]:
    """Return the calibrated values far from the model file, if they explain what no effect does."""
    model = found.base.response.model
    if response.model is found.best.response.model:
        return ()
    far = {n: (fit.at[n] - model.values[n]) / sd for n, sd in model.sds.items() if n in fit.at}
    said = [f"{n} {fit.at[n]:.4g} ({z:+.0f} sd)" for n, z in sorted(far.items(), key=lambda kv: -abs(kv[1]))]
    said = [words for words, z in zip(said, sorted(far.values(), key=lambda z: -abs(z)), strict=True) if abs(z) > FAR]
    return (f"calibrated values beside those of the model file: {', '.join(said[:4])}",) if said else ()
