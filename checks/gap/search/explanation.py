"""An explanation: a model with members added - effects of the library, elements of the mechanics, filters in the signal
path - at values fitted to one realisation (A), and how likely it makes the other one (B), which it has never seen.

An explanation may be right and yet leave something: another effect, or what no effect of the library does. Compared as
if noise and tolerance were all that it may leave, whatever bends the model towards the rest wins, and intervals are far
too narrow. So the likelihood has the size of a disagreement in it (`statistics.disagreement`): held at nothing for an
explanation of everything, free for one that stands beside what it does not explain.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.fit import FitPoint
from checks.fitting.goodness import gaps
from checks.fitting.prior import off_priors
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.element import GenericElement, has_negative
from checks.gap.modelling.thresholds import PER_PARAMETER, Thresholds
from checks.gap.modelling.unmodelled_modes import UnmodelledMode
from checks.gap.statistics.disagreement import VALUES_PER_CELL, left_by_cell
from checks.gap.statistics.projected_residual import Adequacy, Projected, at_known, judge, project

POINT = 1.0  # of log-likelihood: what a coordinate of a free point gains by chance, and as much again
STAND_IN = 4.6  # of log-likelihood, a ratio of 100: beside a disagreement a filter must be better by so much
GROSS = 1e4  # of a channel's G: most of it is no calibration's business
MATTERS = 1.0  # mean energy of a member on a channel, in units of chance, from which on it acts there
M = TypeVar("M", bound=Effect, covariant=True)
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Explanation:
    """A response at values of its parameters, fitted to A. cost: half the squared whitened residuals on A, and priors;
    unseen: B; beside: whether the size of its disagreement is free; settled: no step leads further down; coarse: the
    end of the search on few bins, if the fit began there."""

    response: Augmented
    at: dict[str, float]
    cost: float
    unseen: Dataset
    table: Thresholds
    beside: bool = False
    settled: bool = False
    coarse: FitPoint | None = None

    def on(self, unseen: Dataset) -> "Explanation":
        """Return the same, judged on other records."""
        return replace(self, unseen=unseen)

    def without(self, *names: str) -> "Explanation":
        """Return the same without some members, everything else at the same values."""
        less = self.response.without(*names)
        return replace(self, response=less, at=less.own_values(self.at))

    def of(self, member: str) -> dict[str, float]:
        """Return the values of a member, by its own parameter names."""
        return self.response.of(self.at, member)

    @property
    def names(self) -> frozenset[str]:
        return frozenset(self.response.names)

    def around(self, data: Dataset) -> Dataset:
        """Return data with the tolerance as a fraction of the predicted response."""
        return data.around(self.response.frf(data.f, self.at, data.channels))

    @property
    def off_file(self) -> dict[str, float]:
        """Return how many standard deviations of its file each calibrated value of the model lies off it."""
        values = self.response.model.values
        free = (p for p in self.response.free() if np.isfinite(p.sd) and p.name in self.at and p.name in values)
        return {p.name: (self.at[p.name] - p.prior) / p.sd for p in free}

    @property
    def added(self) -> Effect:
        """Return the member that was added last."""
        return self.response.members[-1]

    @cached_property
    def modelled(self) -> Complex:
        """Return the response (F, C) at the bins of B."""
        return self.response.frf(self.unseen.f, self.at, self.unseen.channels)

    @cached_property
    def residual(self) -> Complex:
        """Return the residual (F, C) of B."""
        return self.unseen.H - self.modelled

    @cached_property
    def seen(self) -> Projected:
        """Return the projected residual on B."""
        return project(self.response, self.unseen, self.at)

    @cached_property
    def Q(self) -> Array:
        """Return the disagreement (K, C) that is left on B, by half octave."""
        return left_by_cell(self.unseen, self.residual)

    @cached_property
    def lnL(self) -> float:
        """Return the log-likelihood of B at the values from A, priors included, but for a constant; beside a
        disagreement, over all its sizes."""
        if not self.beside:
            return -at_known(self.response, self.unseen, self.at).cost
        off = off_priors(self.response.free(self.at), self.at, self.response.model.joint)
        return -0.5 * VALUES_PER_CELL * float(np.log(np.maximum(self.Q, 1.0)).sum()) - 0.5 * float(off @ off)

    @property
    def score(self) -> float:
        """Return lnL less the cost of parameters and unmodelled modes: a named effect is preferred to an unmodelled
        mode that is hardly better."""
        sizes = sum(len(m.sizes) for m in self.response.members)
        every = sum(len(m.parameters) for m in self.response.members)
        point, stand_in = (0.0, STAND_IN) if self.beside else (POINT, self.table.parsimony)
        return (
            self.lnL - PER_PARAMETER * sizes - point * (every - sizes) - stand_in * len(self.response.unmodelled_modes)
        )

    @cached_property
    def adequacy(self) -> Adequacy:
        return judge(self.seen, self.table.p_global)

    @property
    def adequate(self) -> bool:
        """Return whether chance explains what is left and no channel is off by more than tolerance as a whole: a smooth
        error that the tolerance could just explain bin by bin is still one."""
        return self.worst_G < self.table.G and self.adequacy.adequate(self.table.p_global)  # the quicker one first

    @cached_property
    def channel_G(self) -> dict[str, float]:
        """Return G of every channel on B."""
        data = self.unseen.around(self.modelled)
        return {channel: g.G for channel, g in gaps([data], [data.H - self.modelled]).items()}

    @property
    def worst_G(self) -> float:
        """Return the largest G of a channel on B."""
        return max(self.channel_G.values())

    @cached_property
    def possible(self) -> bool:
        """Return whether elements, and filters that stand in for no name, have values that their kinds can have: what
        swings does so within the band, nothing is taken away that was not there, and nothing comes before its cause.
        Others are signs of another class."""
        f = self.unseen.f
        for m in (m for m in self.response.effects if isinstance(m, GenericElement | UnmodelledMode)):
            own = self.of(m.name)
            swings = "damping_ratio" not in own or f[0] < own["f_Hz"] < f[-1]
            if not swings or has_negative(m, own):
                return False
        return True

    @property
    def gross(self) -> bool:
        """Return whether the residual is so large that a linear prediction is meaningless."""
        return self.worst_G > GROSS

    def change_by(self, effect: Effect) -> Complex:
        """Return the change (F, C) of the response by an effect in it, everything else at the same values."""
        return np.asarray(self.modelled - self.without(effect.name).modelled)

    def acting_on(self, effect: Effect) -> tuple[str, ...]:
        """Return the channels in which an effect changes a half octave by more than noise and tolerance."""
        most = left_by_cell(self.unseen, self.change_by(effect)).max(axis=0)
        return tuple(c for c, Q in zip(self.unseen.channels, most, strict=True) if Q > MATTERS)


def if_held(fit: Callable[[], T]) -> T | None:
    """Return the result of a fit; None if the structure is not held at values on the way."""
    try:
        return fit()
    except ModelError:
        return None


@dataclass(frozen=True, eq=False)
class Alternative(Generic[M]):
    """A member that may be in the place of another, and the whole explanation with it."""

    member: M
    whole: Explanation
