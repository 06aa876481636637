"""Explanations fitted to all conditions together, and compared on realisations that none of them has seen."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, FitPoint, coarse_fits, finish
from checks.fitting.prior import prior_rows
from checks.gap.conditions.trial import ConditionTrial, to_fit, together
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.condition import marked
from checks.gap.modelling.effect import Effect
from checks.model.model import Model
from checks.model.parameters import is_mode_factor

WIDER = 10.0  # a prior that says next to nothing, and still keeps a search from walking off for ever


@dataclass(frozen=True, eq=False)
class JointFit:
    """An explanation fitted to A of all conditions. lnL: the log-likelihood of B of all at these values, priors
    included, but for a constant."""

    response: Augmented
    fit: Fit
    lnL: float


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
        unseen = (self.B, *(marked(t.B, t.name) for t in self.trials))
        rows = [d.whitener(d.H - every.frf(d.f, best.at, d.channels)) for d in unseen]
        off = prior_rows(best.free, best.joint) @ np.array([best.at[p.name] - p.prior for p in best.free])
        return JointFit(response, best, -0.5 * float(sum(r @ r for r in rows) + off @ off))


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
