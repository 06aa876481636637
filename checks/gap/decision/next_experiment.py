"""The experiment that would distinguish explanations: the one with the largest predicted separation of all of them.

The difference of two explanations over all conditions, with all that the rival's parameters could make up for taken
out, has a length: twice the gain in log-likelihood to expect of it, in units of the noise and the tolerance of the
unit's own records. Priors do not count, except those of the modes of an APA ([GAP] 11). The worst pair counts first.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.gap.conditions.kinds import ADDED_MASS, EVERY, OTHER_RESISTOR, REMOVED, SIDE_MASSES, ExperimentKind
from checks.gap.conditions.trial import ConditionTrial, to_fit
from checks.gap.decision.alternatives import Alternatives, needed_apart
from checks.gap.decision.experiments import FinalExplanation
from checks.gap.decision.gates import accepted
from checks.gap.decision.prediction import Prediction
from checks.gap.decision.result import Ambiguous
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import ROCKING, GenericElement
from checks.gap.modelling.experiment import Experiment

# Twice the expected gain: eight times 12.5, what a name needs, because a large effect is not linear and a gain spreads.
ENOUGH = 100.0
SPREAD = 3.0  # times what decides: a gain of 28 is above 9.2 in 96 of 100 records


def choose_experiments(decision: FinalExplanation, A: Dataset, made: Sequence[ConditionTrial]) -> tuple[Ambiguous, ...]:
    """Return the rivals, each with the experiment that is predicted to separate its class best, the least troublesome
    of those that do as well; as they are if none decides a pair beyond doubt. made: those that are there already."""
    known = {(t.kind, t.value) for t in made}
    rivals = decision.rivals
    for claim in accepted(decision.claims):
        of = decision.alternatives(claim)
        best, worst = None, 0.0
        decided: tuple[float, ...] = (0.0,)
        for trial in (t for t in _menu(of, A) if (t.kind, t.value) not in known):
            try:
                apart, new = separations(of, trial)
            except ModelError:
                continue
            if new > decided:
                best, worst, decided = trial, float(np.sqrt(apart)), new
            if decided[0] == ENOUGH:
                break
        if best is not None and decided[-1] == ENOUGH:
            asks = {a: request(a.experiment, best.kind, best.value) for a in rivals if claim.effect.name in a.effects}
            rivals = tuple(replace(a, experiment=asks[a], separation=worst) if a in asks else a for a in rivals)
    return rivals


def _menu(of: Alternatives, A: Dataset) -> Iterator[ConditionTrial]:
    """Yield the experiments that could separate the members of a class, the sharpest and least troublesome first."""
    first = {Experiment.RESISTOR: OTHER_RESISTOR}.get(of.claim.effect.experiment, ADDED_MASS)
    places = {m.member.place for m in of.members if isinstance(m.member, GenericElement)}
    kinds = sorted(EVERY, key=lambda kind: kind is not first) if of.names and not of.without_fit else []
    for kind in kinds:
        if kind not in REMOVED or kind.place in places:
            sizes = kind.sizes if places or kind not in SIDE_MASSES else ()
            yield from (ConditionTrial(kind.name, kind, size, A, A) for size in sizes)


def request(before: str, kind: ExperimentKind, value: float | None) -> str:
    """Return an experiment in words, with its entry of unit.toml. before: what was asked for before a prediction."""
    key = "" if kind.value is None else f", {kind.value.name} = {value:g}"
    entry = f'in unit.toml [[experiments]] kind = "{kind.name}"{key}'
    if kind is ADDED_MASS:
        return f"repeat with +{value:g} kg on the payload: {kind.why}; {entry}"
    if kind is OTHER_RESISTOR and "resistor" not in before:
        return f"{before}; or repeat with {kind.said(value)}; {entry}"
    return f"repeat with {kind.said(value)}: {kind.why}; {entry}"


def every_experiment() -> frozenset[str]:
    """Return every experiment that can be asked for, in words."""
    plain = [experiment.value for experiment in Experiment]
    sizes = [(kind, size) for kind in EVERY for size in kind.sizes]
    return frozenset([*plain, *(request(before, *each) for before in plain for each in sizes)])


def separations(of: Alternatives, trial: ConditionTrial) -> tuple[float, tuple[float, ...]]:
    """Return the smallest separation of a pair of a class under a condition with the noise of the unit's records, and
    those of all pairs, rising: ENOUGH for one beyond doubt, 0 for one that decides nothing. Elements at one place are
    no pair. Raises ModelError."""
    table, data = of.whole.table, to_fit(trial.A, [trial])
    first = Prediction.of(of.whole, data, [trial], first=True)
    every = [(of.members[0], first), *((m, Prediction.of(m.whole, first.sets, [trial])) for m in of.members[1:])]
    found = [(first.imitated(of.claim.effect)[1], table.two_delta_lnL)] if of.other_values else []
    for (a, one), (b, other) in combinations(every, 2):
        if not _same_place(a.member, b.member):
            needed = needed_apart(replace(of.claim, effect=a.member), [b.member], table)
            found.append((other.left([x - y for x, y in zip(one.H, other.H, strict=True)])[1], needed))
    decided = (min(apart, ENOUGH) if apart > SPREAD * needed else 0.0 for apart, needed in found)
    return min((apart for apart, _ in found), default=0.0), tuple(sorted(decided)) or (0.0,)


def _same_place(a: Effect, b: Effect) -> bool:
    if not (isinstance(a, GenericElement) and isinstance(b, GenericElement)):
        return False
    return a.place == b.place and (a.kind == ROCKING) == (b.kind == ROCKING)
