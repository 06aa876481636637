"""A candidate of an explanation: a model with members of the library added and fitted, and how well it does.

It is fitted to one realisation (A) and compared on the other (B), which it has never seen.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

from checks.arrays import Complex
from checks.fitting.dataset import Dataset
from checks.fitting.fit import FitPoint
from checks.fitting.goodness import gaps
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.thresholds import PER_PARAMETER, Thresholds
from checks.gap.statistics.adequacy import Adequacy, judge
from checks.gap.statistics.projected_residual import Projected, at_known, project

POINT = 1.0  # of log-likelihood: what a coordinate of a free point gains by chance, and as much again
GROSS = 1e4  # of a channel's G: most of it is no calibration's business


@dataclass(frozen=True, eq=False)
class Fitted(ABC):
    """A response at values of its parameters, fitted to A. cost: half the squared rows of the priors at least; unseen:
    B."""

    response: Augmented
    at: dict[str, float]
    cost: float
    unseen: Dataset

    @property
    @abstractmethod
    def lnL(self) -> float:
        """Return the log-likelihood of B at the values from A, priors included, but for a constant."""

    @cached_property
    def residual(self) -> Complex:
        """Return the residual (F, C) of B."""
        return self.unseen.H - self.response.frf(self.unseen.f, self.at, self.unseen.channels)


@dataclass(frozen=True, eq=False)
class Candidate(Fitted):
    """An explanation of everything. cost: half the squared whitened residuals on A, and priors; settled: no step leads
    further down; coarse: the end of the search on few bins, if the fit began there."""

    table: Thresholds
    settled: bool = False
    coarse: FitPoint | None = None

    @cached_property
    def seen(self) -> Projected:
        """Return the projected residual on B."""
        return project(self.response, self.unseen, self.at)

    @cached_property
    def lnL(self) -> float:
        return -at_known(self.response, self.unseen, self.at).cost

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
        model = self.response.frf(self.unseen.f, self.at, self.unseen.channels)
        data = self.unseen.around(model)
        return {channel: g.G for channel, g in gaps([data], [data.H - model]).items()}

    @property
    def worst_G(self) -> float:
        """Return the largest G of a channel on B."""
        return max(self.channel_G.values())

    @property
    def gross(self) -> bool:
        """Return whether the residual is so large that a linear prediction is meaningless."""
        return self.worst_G > GROSS

    @property
    def names(self) -> frozenset[str]:
        return frozenset(self.response.names)

    @property
    def score(self) -> float:
        """Return lnL less the cost of parameters and unmodelled modes: a named effect is preferred to an unmodelled
        mode that is hardly better."""
        sizes = sum(len(m.sizes) for m in self.response.members)
        every = sum(len(m.parameters) for m in self.response.members)
        return (
            self.lnL
            - PER_PARAMETER * sizes
            - POINT * (every - sizes)
            - self.table.parsimony * len(self.response.unmodelled_modes)
        )
