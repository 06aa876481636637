"""Whether an explanation holds under every condition, and whether the drive's level or a turn changes anything."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from checks.errors import ModelError
from checks.fitting.agreement import contradiction
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, Led, finish
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


def tested(
    response: Augmented, fit: Fit, A: Dataset, B: Dataset, trials: Sequence[ConditionTrial]
) -> tuple[Tested, ...]:
    """Test an explanation, with its fit to A or to all conditions, by every experiment."""
    return tuple(_one(response, fit, A, B, t) for t in trials)


def _one(response: Augmented, fit: Fit, A: Dataset, B: Dataset, trial: ConditionTrial) -> Tested:
    value, data = trial.value, marked(trial.B, trial.name)
    try:
        every, own = _with_own(response, fit, A, trial)
        H = every.frf(data.f, own.at, data.channels)
        worst = contradiction(every, own, data)
    except ModelError as e:
        return Tested(trial.kind.name, value, trial.words, {}, against=f"it cannot be tested: {e}")
    found = {c.partition(AT)[0]: g for c, g in gaps([data.around(H)], [data.H - H]).items()}
    said = ""
    if worst is not None:
        channel = worst.channel.partition(AT)[0]
        said = (
            f"with {trial.words} {channel} does not fit from {worst.f_lo_Hz:.0f} to {worst.f_hi_Hz:.0f} Hz "
            f"(G {worst.G:.2g}, p {worst.p:.1g})"
        )
    level = tuple(changed(B, trial.B)) if trial.kind is DRIVE_LEVEL else ()
    return Tested(trial.kind.name, value, trial.words, found, said, level)


def _with_own(response: Augmented, fit: Fit, A: Dataset, trial: ConditionTrial) -> tuple[Together, Fit]:
    """Return the response under one condition, with values for its own parameters: if the fit has none, from a fit
    continued on the condition's records."""
    every = together(response, [trial])
    if shift_of(trial, response).names <= set(fit.names):
        return replace(every, fixed=fit.at), fit
    free = tuple(every.free(fit.at))
    return every, finish(every, [A, marked(trial.A, trial.name)], Led(free, fit.cost), joint=response.model.joint)


def changed(one: Dataset, other: Dataset) -> dict[str, Gap]:
    """Return the channels whose responses differ by more than noise between two records of the same unit, with their G;
    only at frequencies that both have."""
    near = np.abs(one.f[:, None] - other.f) <= SAME_HZ * one.f[:, None]
    i, j = np.nonzero(near)
    if i.size == 0:
        return {}
    a, b = one.at(i), other.select(one.channels).at(j)
    both = replace(a, cov=a.cov + b.cov, nu=np.minimum(a.nu, b.nu), tolerance=ALIKE, scale=a.H)
    found = gaps([both], [b.H - a.H])
    return {c: g for c, g in found.items() if g.p < FALSE_ALARM and g.G > LARGE}


def missing_in(experiments: Sequence[Tested], level_known: bool) -> tuple[Nameless, ...]:
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
