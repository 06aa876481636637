"""Explanations fitted to all conditions together, and compared on realisations that none of them has seen."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, FitPoint, coarse_fits, finish
from checks.fitting.prior import prior_rows
from checks.gap.conditions.trial import ConditionTrial, to_fit, together
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.condition import Together, marked
from checks.gap.modelling.effect import Effect
from checks.model.model import Model
from checks.model.parameters import is_mode_factor

WIDER = 10.0  # a prior that says next to nothing, and still keeps a search from walking off for ever


@dataclass(frozen=True, eq=False)
class JointFit:
    """An explanation fitted to A of all conditions. unseen: B of all."""

    response: Augmented
    under_all: Together
    fit: Fit
    unseen: tuple[Dataset, ...]

    @cached_property
    def lnL(self) -> float:
        """Return the log-likelihood of B at the values from A, priors included, but for a constant."""
        at, free = self.fit.at, self.fit.free
        rows = [d.whitener(d.H - self.under_all.frf(d.f, at, d.channels)) for d in self.unseen]
        off = prior_rows(free, self.fit.joint) @ np.array([at[p.name] - p.prior for p in free])
        return -0.5 * float(sum(r @ r for r in rows) + off @ off)


@dataclass(frozen=True, eq=False)
class Conditions:
    """The data that explanations are fitted to: A and B of the unit as it is, and every condition."""

    A: Dataset
    B: Dataset
    trials: tuple[ConditionTrial, ...]

    def thinned(self, bins: int) -> "Conditions":
        trials = tuple(replace(t, A=t.A.thinned(bins), B=t.B.thinned(bins)) for t in self.trials)
        return Conditions(self.A.thinned(bins), self.B.thinned(bins), trials)

    def explained(self, response: Augmented, at: Mapping[str, float], far: bool = False) -> JointFit:
        """Return a response fitted to all conditions from values nearby; far: also over wide tolerances, because
        they may lie elsewhere. Raises ModelError."""
        every, sets = together(response, self.trials), to_fit(self.A, self.trials)
        joint, free = response.model.joint, tuple(every.free(at))
        ways = [FitPoint(free, 0.0), *(coarse_fits(every, sets, free, joint=joint)[:1] if far else ())]
        fits = []
        for way in ways:
            with suppress(ModelError):
                fits.append(finish(every, sets, way, joint=joint))
        if not fits:
            raise ModelError("no values of the explanation come near these responses")
        best = min(fits, key=lambda f: f.cost)
        return JointFit(response, every, best, (self.B, *(marked(t.B, t.name) for t in self.trials)))


def by_data_alone(response: Augmented, effect: Effect) -> Augmented:
    """Return the same with very wide priors of its calibrated values. The modes of an APA, which would fit anything if
    they were free, and the parameters of the effect itself keep their priors."""
    return replace(response, model=_hardly_known(response.model, effect.stands_for(response.model)))


@lru_cache(maxsize=8)
def _hardly_known(model: Model, kept: tuple[str, ...]) -> Model:
    wider = {n: 1.0 if is_mode_factor(n) or n in kept else WIDER for n in model.sds}
    joint = model.joint
    if joint is not None:
        by = np.diag([wider.get(n, 1.0) for n in joint.names])
        joint = replace(joint, covariance=by @ joint.covariance @ by)
    return replace(model, sds={n: wider[n] * sd for n, sd in model.sds.items()}, joint=joint)
