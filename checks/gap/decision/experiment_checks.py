"""Whether an explanation holds under every condition, and whether the drive's level or a turn changes anything."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from checks.errors import ModelError
from checks.fitting.agreement import contradiction
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, FitPoint, finish
from checks.fitting.goodness import Gap, gaps
from checks.gap.conditions.kinds import DRIVE_LEVEL
from checks.gap.conditions.trial import ConditionTrial, shift_of, together
from checks.gap.decision.result import Nameless, Tested
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.condition import AT, Together, marked

ALIKE = 1e-3  # of the response: the same thing measured twice, beyond noise (as `same_unit`)
SAME_HZ = 1e-6  # of f: one bin of two records
FALSE_ALARM = 1e-4
LARGE = 1.5  # of G: what the noise's own estimate does not reach


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
    if shift_of(trial, response).names <= set(fit.names):
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
