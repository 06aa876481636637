"""The experiment that would distinguish explanations: the one with the largest predicted separation of all of them.

The difference of two explanations over all conditions, with all that the rival's parameters could make up for taken
out, has a length: twice the gain in log-likelihood to expect of it, in units of the noise and the tolerance of the
unit's own records. Priors do not count, except those of the modes of an APA ([GAP] 11). The worst pair counts first.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.gap.conditions.kinds import ADDED_MASS, EVERY, OTHER_RESISTOR, REMOVED, SIDE_MASSES, ExperimentKind
from checks.gap.conditions.trial import ConditionTrial, to_fit, together
from checks.gap.decision.aliases import by_its_size, shares
from checks.gap.decision.alternatives import Alternatives, needed_apart
from checks.gap.decision.experiments import FinalExplanation
from checks.gap.decision.gates import accepted
from checks.gap.decision.result import Ambiguous
from checks.gap.modelling.augmented import Augmented, Member, Values
from checks.gap.modelling.condition import Together
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import GenericElement
from checks.gap.modelling.experiment import Experiment
from checks.gap.search.candidate import Candidate
from checks.model.parameters import is_mode_factor

# Twice the expected gain: eight times 12.5, what a name needs, because a large effect is not linear and a gain spreads.
ENOUGH = 100.0
SPREAD = 3.0  # times what decides: a gain of 28 is above 9.2 in 96 of 100 records


def choose_experiments(decision: FinalExplanation, A: Dataset) -> tuple[Ambiguous, ...]:
    """Return the rivals, each with the experiment that is predicted to separate its class best, the least troublesome
    of those that do as well; as they are if no experiment decides a pair beyond doubt."""
    rivals = decision.rivals
    for claim in accepted(decision.claims):
        of = decision.alternatives(claim)
        best, worst = None, 0.0
        decided: tuple[float, ...] = (0.0,)
        for trial in _menu(of, A):
            try:
                apart, new = separations(of, trial)
            except ModelError:
                continue
            if new > decided:
                best, worst, decided = trial, float(np.sqrt(apart)), new
            if decided[0] == ENOUGH:
                break
        if best is not None and decided[-1] == ENOUGH:
            asks = [
                replace(a, experiment=request(a.experiment, best.kind, best.value), separation=worst) for a in rivals
            ]
            own = [claim.effect.name in a.effects for a in rivals]
            rivals = tuple(b if is_own else a for a, b, is_own in zip(rivals, asks, own, strict=True))
    return rivals


def _menu(of: Alternatives, A: Dataset) -> Iterator[ConditionTrial]:
    """Yield the experiments that could separate the members of a class, the sharpest and least troublesome first."""
    first = {Experiment.RESISTOR: OTHER_RESISTOR}.get(of.claim.effect.experiment, ADDED_MASS)
    places = {m.member.place for m in of.members if isinstance(m.member, GenericElement)}
    if of.without_fit or not of.names:
        return
    for kind in sorted(EVERY, key=lambda kind: kind is not first):
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
    first = Prediction.of(of.whole, data, trial, first=True)
    every = [(of.members[0], first), *((m, Prediction.of(m.whole, first.sets, trial)) for m in of.members[1:])]
    found = [(separation_from_values(first, of.claim.effect), table.two_delta_lnL)] if of.other_values else []
    for (a, one), (b, other) in combinations(every, 2):
        if not _same_place(a.member, b.member):
            needed = needed_apart(replace(of.claim, effect=a.member), [b.member], table)
            found.append((separation(one, other), needed))
    decided = (min(apart, ENOUGH) if apart > SPREAD * needed else 0.0 for apart, needed in found)
    return min((apart for apart, _ in found), default=0.0), tuple(sorted(decided)) or (0.0,)


def _same_place(a: Member, b: Member) -> bool:
    return isinstance(a, GenericElement) and isinstance(b, GenericElement) and a.place == b.place


@dataclass(frozen=True, eq=False)
class Prediction:
    """What an explanation predicts under all conditions. H: responses (F, C) of each dataset; sets: the datasets, which
    weigh differences, with the responses of the first explanation of a class."""

    response: Augmented
    every: Together
    free: list[Free]
    at: Values
    H: list[Complex]
    sets: Sequence[Dataset]

    @classmethod
    def of(cls, c: Candidate, sets: Sequence[Dataset], trial: ConditionTrial, first: bool = False) -> "Prediction":
        """Return the prediction of an explanation. first: whether it is the first of its class. Raises ModelError."""
        every = together(c.response, [trial])
        free = every.free(c.at)
        at = {p.name: p.begin for p in free}
        H = [every.frf(d.f, at, d.channels) for d in sets]
        if first:
            sets = [replace(d, H=h) for d, h in zip(sets, H, strict=True)]
        return cls(c.response, every, free, at, H, sets)

    @cached_property
    def rows(self) -> Array:
        """Return the whitened derivatives (n, p) by all parameters."""
        names = [p.name for p in self.free]
        return np.hstack([s.whitener(self.every.jacobian(s.f, names, self.at, s.channels)) for s in self.sets]).T

    def left(self, changes: Sequence[Complex], without: Collection[str] = ()) -> float:
        """Return the squared length of changes (F, C) of the datasets, without what the parameters could make up for.
        without: parameters that are held."""
        d = np.concatenate([s.whitener(c) for s, c in zip(self.sets, changes, strict=True)])
        kept = [i for i, p in enumerate(self.free) if p.name not in without]
        scatter = np.diag([1.0 / p.sd if is_mode_factor(p.name) else 0.0 for p in (self.free[i] for i in kept)])
        _, rest = shares(np.vstack([self.rows[:, kept], scatter]), np.concatenate([d, np.zeros(len(kept))]))
        return float(rest @ rest)


def separation(one: Prediction, other: Prediction) -> float:
    """Return twice the gain in log-likelihood to expect of an explanation over another."""
    return other.left([a - b for a, b in zip(one.H, other.H, strict=True)])


def separation_from_values(one: Prediction, effect: Effect) -> float:
    """Return the same over other values of calibrated parameters, without the effect."""
    model = one.response.model
    own = {f"{effect.name}.{p.name}" for p in effect.parameters} | set(effect.stands_for(model))
    less = replace(one.every, base=one.every.base.without(effect.name))
    changes = []
    for s in one.sets:
        change = by_its_size(effect, model, one.every, one.at, s)
        changes.append(s.H - less.frf(s.f, one.at, s.channels) if change is None else change)
    return one.left(changes, own)
