"""The experiment that would distinguish explanations: one that is predicted to do so by a sufficient margin.

The difference of two explanations over all conditions, with all that the rival's parameters could make up for taken
out, has a length: twice the gain in log-likelihood to expect of it. Priors do not count, except those of the modes of
an APA ([GAP] 11).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from checks.arrays import Complex
from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.gap.conditions.kinds import ADDED_MASS, OTHER_RESISTOR, ExperimentKind
from checks.gap.conditions.trial import ConditionTrial, together
from checks.gap.decision.aliases import by_its_size, shares
from checks.gap.decision.gates import Claim
from checks.gap.decision.result import Ambiguous
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Values
from checks.gap.modelling.condition import Together, marked
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment
from checks.gap.search.candidate import Candidate
from checks.gap.search.forward import SearchResult
from checks.model.parameters import is_mode_factor

# Twice the expected gain: eight times 12.5, what a name needs, because a large effect is not linear and a gain spreads.
ENOUGH = 100.0
MENU: tuple[tuple[ExperimentKind, float], ...] = (
    *((ADDED_MASS, kg) for kg in (0.5, 1.0, 2.0, 5.0)),
    *((OTHER_RESISTOR, ohm) for ohm in (20_000.0, 1.0)),
)


def choose_experiments(
    rivals: Sequence[Ambiguous], claims: Sequence[Claim], result: SearchResult, full: Candidate, A: Dataset
) -> tuple[Ambiguous, ...]:
    """Return the rivals, each with the experiment that is predicted to distinguish it, if the menu has a possible
    one. claims: those that passed every gate."""
    return tuple(_with_experiment(a, claims, result, full, A) for a in rivals)


def _with_experiment(
    a: Ambiguous, claims: Sequence[Claim], result: SearchResult, full: Candidate, A: Dataset
) -> Ambiguous:
    claim = next((c for c in claims if c.effect.name in a.effects), None)
    if claim is None:
        return a
    # A rival is another explanation of the search; a set of other calibrated values has no name in the library.
    others: list[Candidate | None] = []
    for name in a.effects:
        if name != claim.effect.name:
            rival = result.rival_of_names(frozenset({*full.names, name} - {claim.effect.name}))
            if rival is None and name in EFFECTS:  # a lag of another form, not fitted: the menu changes neither
                return a
            others.append(rival)
    first = {Experiment.RESISTOR: OTHER_RESISTOR}.get(claim.effect.experiment, ADDED_MASS)
    for kind, value in sorted(MENU, key=lambda each: each[0] is not first):
        trial = ConditionTrial(kind.name, kind, value, A, A)
        try:
            least = min(separation(full, claim.effect, rival, A, trial) for rival in others)
        except ModelError:
            continue
        if least > ENOUGH:
            return replace(a, experiment=_words(a.experiment, kind, value))
    return a


def every_experiment() -> frozenset[str]:
    """Return every experiment that can be asked for, in words."""
    plain = [experiment.value for experiment in Experiment]
    return frozenset([*plain, *(_words(before, kind, value) for before in plain for kind, value in MENU)])


def _words(before: str, kind: ExperimentKind, value: float) -> str:
    key = "" if kind.value is None else f", {kind.value.name} = {value:g}"
    entry = f'in unit.toml [[experiments]] kind = "{kind.name}"{key}'
    if kind is ADDED_MASS:
        why = "an added mass moves what depends on the payload, nothing else"
        return f"repeat with +{value:g} kg on the payload: {why}; {entry}"
    if "resistor" in before:
        return f"repeat with {value:g} ohm across the sensor stack: only the sensor's circuit changes; {entry}"
    return f"{before}; or repeat with {value:g} ohm across the sensor stack; {entry}"


def separation(full: Candidate, effect: Effect, rival: Candidate | None, A: Dataset, trial: ConditionTrial) -> float:
    """Return twice the expected gain in log-likelihood under a condition with the noise of A. rival: another
    explanation, or None for other calibrated values. Raises ModelError."""
    every = together(full.response, [trial])
    at = {p.name: p.begin for p in every.free(full.at)}
    sets = [replace(d, H=every.frf(d.f, at, d.channels)) for d in (A, marked(A, trial.name))]
    if rival is None:
        own = {f"{effect.name}.{p.name}" for p in effect.parameters} | set(effect.stands_for(full.response.model))
        free, other, there = [p for p in every.free(full.at) if p.name not in own], every, at
        changes = [_change_under_all(full, effect, every, at, s) for s in sets]
    else:
        other = together(rival.response, [trial])
        free = other.free(rival.at)
        there = {p.name: p.begin for p in free}
        changes = [s.H - other.frf(s.f, there, s.channels) for s in sets]
    d = np.concatenate([s.whitener(c) for s, c in zip(sets, changes, strict=True)])
    names = [p.name for p in free]
    J = np.hstack([s.whitener(other.jacobian(s.f, names, there, s.channels)) for s in sets]).T
    scatter = np.diag([1.0 / p.sd if is_mode_factor(p.name) else 0.0 for p in free])
    _, rest = shares(np.vstack([J, scatter]), np.concatenate([d, np.zeros(len(names))]))
    return float(rest @ rest)


def _change_under_all(full: Candidate, effect: Effect, every: Together, at: Values, data: Dataset) -> Complex:
    """Return the change (F, C) of the response by the effect: its derivative times its size, or the whole change if the
    effect has no size."""
    change = by_its_size(effect, full.response.model, every, at, data)
    if change is not None:
        return change
    less = replace(every, base=full.response.without(effect.name))
    return data.H - less.frf(data.f, at, data.channels)
