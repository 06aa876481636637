"""Explanations that the unit's own responses do not distinguish, distinguished by its experiments ([GAP] 11).

Every rival is fitted to A of all conditions and compared on B of all. Two effects are distinguished as two explanations
are on one condition. An effect and other values of calibrated parameters that imitate it are compared with next to no
prior of those values: otherwise the priors would decide, and they were used before. And whether an explanation holds
under every condition, and whether the drive's level or a turn changes anything.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from checks.errors import ModelError
from checks.fitting.agreement import contradiction
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, FitPoint, finish
from checks.fitting.goodness import Gap, gaps
from checks.gap.conditions.kinds import DRIVE_LEVEL
from checks.gap.conditions.trial import Conditions, ConditionTrial, JointFit, by_data_alone, together
from checks.gap.decision.alternatives import Alternatives, needed_apart
from checks.gap.decision.evidence import chance_of_gain, is_significant
from checks.gap.decision.gates import Claim
from checks.gap.decision.result import Ambiguous, Nameless, Tested
from checks.gap.modelling.augmented import Augmented, Values
from checks.gap.modelling.condition import AT, Together, marked
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import GenericElement
from checks.gap.modelling.experiment import sharpest
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import SearchResult

FAR = 3.0  # prior standard deviations from which on a calibrated value is listed
ALIKE = 1e-3  # of the response: the same thing measured twice, beyond noise (as `same_unit`)
SAME_HZ = 1e-6  # of f: one bin of two records
FALSE_ALARM = 1e-4
LARGE = 1.5  # of G: what the noise's own estimate does not reach


@dataclass(frozen=True, eq=False)
class FinalExplanation:
    """An explanation that was decided on, with its fit to all bins (or to all conditions), its claims, the effects that
    cannot be distinguished, other adequate explanations (fitted), and notes for the reader."""

    fit: Fit
    full: Explanation
    claims: tuple[Claim, ...]
    rivals: tuple[Ambiguous, ...] = ()
    notes: tuple[str, ...] = ()
    fitted: tuple[Explanation, ...] = ()

    def alternatives(self, claim: Claim) -> Alternatives:
        """Return the class of a claim."""
        return Alternatives(claim, self.rivals, self.fitted, self.full)

    def replacing(
        self, claim: Claim, by: tuple[Claim, ...], note: str, alike: tuple[Ambiguous, ...] = ()
    ) -> "FinalExplanation":
        """Return the decision with others in place of a claim. alike: what remains of its rivals."""
        rivals = tuple(a for a in self.rivals if claim.effect.name not in a.effects)
        claims = tuple(k for c in self.claims for k in (by if c is claim else (c,)))
        return replace(self, claims=claims, rivals=(*rivals, *alike), notes=(*self.notes, note))

    def refuted_by(self, tested: Tested) -> "FinalExplanation":
        """Return the decision without a name: what an experiment contradicts is no explanation."""
        claims = tuple(replace(c, reasons=(f"refuted: {tested.against}",)) for c in self.claims)
        return replace(self, claims=claims, rivals=())

    def noting(self, *notes: str) -> "FinalExplanation":
        return replace(self, notes=(*self.notes, *notes))

    def explained_by(self, response: Augmented, at: Values) -> "FinalExplanation":
        full = replace(self.full, response=response, at=dict(at))
        return replace(self, full=full, fitted=(*self.fitted, self.full))


def resolve_by_experiments(
    decision: FinalExplanation, result: SearchResult, conditions: Conditions
) -> FinalExplanation:
    """Decide between rival explanations by the unit's experiments, and fit the explanation to all conditions. result:
    of the search, which holds the rival explanations."""
    few = conditions.thinned(decision.full.table.search_bins)
    for claim in decision.claims:
        if decision.alternatives(claim).names:
            try:
                decision = _resolve(decision, claim, few)
            except ModelError as e:
                decision = decision.noting(f"the experiments do not settle {claim.effect.name}: {e}")
    response = decision.full.response
    last = conditions.explained(response, decision.full.at)
    names = {p.name for p in response.free()}
    at = {n: v for n, v in last.fit.at.items() if n in names}
    full = replace(decision.full, at=at, cost=last.fit.cost)
    moved = _moved_values(response, last.fit, result)
    return replace(decision, fit=last.fit, full=full, notes=(*decision.notes, *moved))


def _resolve(decision: FinalExplanation, claim: Claim, few: Conditions) -> FinalExplanation:
    """Decide between the members of a class, then between the best of them and other calibrated values."""
    table, own = decision.full.table, decision.alternatives(claim)
    if own.without_fit:  # the band shows no difference in form, and no experiment changes a lag
        return decision.noting(f"the experiments do not tell {claim.effect.name} and {own.without_fit[0]} apart")
    fits = [(m, few.explained(m.whole.response, m.whole.at)) for m in own.members]
    (first, best), *others = sorted(fits, key=lambda each: -each[1].lnL)
    by = replace(claim, effect=first.member)
    apart = [(m, 2.0 * (best.lnL - e.lnL), needed_apart(by, [m.member], table)) for m, e in others]
    alike = [m for m, twice, needed in apart if twice < needed]
    if len(alike) == len(own.members) - 1 and alike:
        both = " and ".join(m.member.label for m in (first, alike[0]))
        return decision.noting(f"the experiments do not tell {both} apart (2 delta lnL {apart[0][1]:.1f})")
    if alike:
        names = {*own.names, claim.effect.name} - {m.member.name for m in own.members}
        names |= {m.member.name for m in (first, *alike)}
        left = Ambiguous(tuple(sorted(names)), sharpest(m.member.experiment for m in (first, *alike)).value)
        return _confirmed(decision, claim, by, best, (left,))
    if isinstance(first.member, GenericElement) and not own.other_values:
        return _confirmed(decision, claim, by, best)
    return _compare_with_values(decision, claim, first.member, best, few)


def _confirmed(
    decision: FinalExplanation, claim: Claim, by: Claim, best: JointFit, alike: tuple[Ambiguous, ...] = ()
) -> FinalExplanation:
    """Return the decision with the best of a class in place of a claim, and all values from the fit to all
    conditions. alike: what the experiments leave beside it."""
    words = f"the experiments leave {by.effect.label} (gain {by.delta_lnL:.0f})"
    return decision.replacing(claim, (by,), words, alike).explained_by(best.response, best.fit.at)


def _compare_with_values(
    decision: FinalExplanation, claim: Claim, effect: Effect, best: JointFit, few: Conditions
) -> FinalExplanation:
    """Decide whether an effect is needed even if calibrated values may be anything."""
    table = decision.full.table
    alone = by_data_alone(best.response, effect)
    less = alone.without(effect.name)
    free = few.explained(alone, best.fit.at, far=True)
    near = {n: v for n, v in free.fit.at.items() if not n.startswith(f"{effect.name}.")}
    # A rival that was not followed to its best would make a name: it begins at every place that is known.
    other = max((few.explained(less, at, far=True) for at in (near, {})), key=lambda e: -e.fit.cost)
    gain = free.lnL - other.lnL
    significant = is_significant(table, effect, best.fit, best.response)
    at_bound = any(n.startswith(f"{effect.name}.") for n in best.fit.at_bound)
    if gain > table.delta_lnL and significant and not at_bound:
        return _confirmed(decision, claim, Claim(effect, gain, chance_of_gain(gain, effect), ()), best)
    if gain < table.delta_lnL and effect is claim.effect and _is_excluded(effect, decision.full.at, free.fit, table):
        words = f"{effect.name} is not needed: other values of calibrated parameters explain every condition"
        return decision.replacing(claim, (), words).explained_by(less, other.fit.at)
    return decision.noting(f"the experiments do not settle whether {effect.name} is needed (gain {gain:.1f})")


def _is_excluded(effect: Effect, at: Values, free: Fit, table: Thresholds) -> bool:
    """Return whether an effect as large as claimed (values `at`) would have shown in a free fit."""
    names = [f"{effect.name}.{p.name}" for p in effect.parameters]
    i = [free.names.index(n) for n in names]
    away = np.array([at[n] for n in names]) - free.values[i]
    return bool(0.5 * away @ np.linalg.pinv(free.cov[np.ix_(i, i)], hermitian=True) @ away > table.delta_lnL)


def _moved_values(response: Augmented, fit: Fit, result: SearchResult) -> tuple[str, ...]:
    """Return the calibrated values far from the model file, if they explain what no effect does."""
    model = result.base.response.model
    if response.model is result.best.response.model:
        return ()
    far = {n: (fit.at[n] - model.values[n]) / sd for n, sd in model.sds.items() if n in fit.at}
    ranked = sorted(far.items(), key=lambda kv: -abs(kv[1]))
    values = [f"{n} {fit.at[n]:.4g} ({z:+.0f} sd)" for n, z in ranked if abs(z) > FAR]
    return (f"calibrated values beside those of the model file: {', '.join(values[:4])}",) if values else ()


def check_by_experiments(
    response: Augmented, fit: Fit, A: Dataset, B: Dataset, trials: Sequence[ConditionTrial]
) -> tuple[Tested, ...]:
    """Check an explanation, with its fit to A or to all conditions, by every experiment."""
    return tuple(_check(response, fit, A, B, t) for t in trials)


def _check(response: Augmented, fit: Fit, A: Dataset, B: Dataset, trial: ConditionTrial) -> Tested:
    value, data = trial.value, marked(trial.B, trial.name)
    try:
        every, fit = _with_own_values(response, fit, A, trial)
        H = every.frf(data.f, fit.at, data.channels)
        worst = contradiction(every, fit, data)
    except ModelError as e:
        return Tested(trial.kind.name, value, trial.words, {}, against=f"it cannot be tested: {e}")
    channels = {c.partition(AT)[0]: g for c, g in gaps([data.around(H)], [data.H - H]).items()}
    against = ""
    if worst is not None:
        channel = worst.channel.partition(AT)[0]
        against = (
            f"with {trial.words} {channel} does not fit from {worst.f_lo_Hz:.0f} to {worst.f_hi_Hz:.0f} Hz "
            f"(G {worst.G:.2g}, p {worst.p:.1g})"
        )
    level = tuple(changed_channels(B, trial.B)) if trial.kind is DRIVE_LEVEL else ()
    return Tested(trial.kind.name, value, trial.words, channels, against, level)


def _with_own_values(response: Augmented, fit: Fit, A: Dataset, trial: ConditionTrial) -> tuple[Together, Fit]:
    """Return the response under one condition, with values for its own parameters: if the fit has none, from a fit
    continued on the condition's records."""
    every = together(response, [trial])
    if every.shifts[0].names <= set(fit.names):
        return replace(every, fixed=fit.at), fit
    start = FitPoint(tuple(every.free(fit.at)), fit.cost)
    return every, finish(every, [A, marked(trial.A, trial.name)], start, joint=response.model.joint)


def changed_channels(one: Dataset, other: Dataset) -> dict[str, Gap]:
    """Return the channels whose responses differ by more than noise between two records of the same unit, with their G;
    only at frequencies that both have."""
    near = np.abs(one.f[:, None] - other.f) <= SAME_HZ * one.f[:, None]
    i, j = np.nonzero(near)
    if i.size == 0:
        return {}
    a, b = one.at(i), other.select(one.channels).at(j)
    both = replace(a, cov=a.cov + b.cov, nu=np.minimum(a.nu, b.nu), tolerance=ALIKE, scale=a.H)
    change = gaps([both], [b.H - a.H])
    return {c: g for c, g in change.items() if g.p < FALSE_ALARM and g.G > LARGE}


def disagreements(experiments: Sequence[Tested], level_known: bool) -> tuple[Nameless, ...]:
    """Return the disagreements that experiments show with the explanation. level_known: slow records show that the unit
    depends on the level, and by what."""
    out = []
    for t in experiments:
        if t.level and not level_known:
            words = f"{t.words}: the response differs beyond noise, so it depends on the level; no linear effect does"
            out += [Nameless(c, (), (), True, words) for c in t.level]
        elif t.against and t.channels and not (t.level and level_known):
            worst = max(t.channels, key=lambda c: t.channels[c].G)
            out.append(Nameless(worst, (), (), False, f"the explanation does not hold: {t.against}"))
    return tuple(out)
