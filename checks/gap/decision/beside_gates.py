"""The gates before a name that stands beside a disagreement: of an explanation that leaves something unexplained.

Its evidence and its rivals are measured by the profile likelihood of `search.disagreement`. Because the nearest member
of a library is not the cause, four gates look at where an effect acts: it explains most of the cells, makes none worse,
what it changes most is explained, and the gap of one channel as a whole becomes much smaller.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.fit import Fit
from checks.gap.decision.gates import (
    AGREES,
    CONFIRMED,
    GAIN,
    OFF_MODES,
    ON_ITS_CHANNELS,
    SIGNIFICANT,
    SLOW_SINES,
    WITHIN_LIMITS,
    Claim,
    Gate,
    NameEvidence,
    failed_reasons,
)
from checks.gap.decision.result import Ambiguous
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import sharpest
from checks.gap.modelling.slow_sines import Slow
from checks.gap.search.candidate import Fitted
from checks.gap.search.candidates import Effort, Search
from checks.gap.search.disagreement import (
    ROUNDS,
    STAND_IN,
    DisagreementFit,
    ExplainingStep,
    add_elements,
    add_one,
    left_by_cell,
    required_gain,
    score_of,
    settle,
)

ACTS = 1.0  # of Q: an effect that changes a cell by more acts there
LEFT = 1.0 / 3.0  # of the logarithms of Q over the cells where an effect acts: with more left, it is not the cause
CONFIRMING = 2  # rounds of weights, from values that are nearly right
LEFT_OF_CHANNEL = 0.2  # of a channel's G: an effect that leaves more of every channel is no cause of its gap
HARDLY_LEFT = 0.01  # of a channel's G: an effect that leaves no more needs no more evidence than another name
EXPLAINED_CELL = 1.5  # of Q, as of G of a channel
FAR_ABOVE = 10.0  # of Q in the cell that an effect changes most
NEAR = 15.0  # of score: rivals of its step that are compared once more beside everything else


@dataclass(frozen=True)
class ActingCells:
    """The residual in the cells in which an effect acts. share: of the logarithms of Q; worse: how many it makes worse;
    worst: Q of the cell that it changes most, in the channel with the largest."""

    share: float
    worse: int
    worst: float


@dataclass(frozen=True, eq=False)
class BesideEvidence(NameEvidence):
    """NameEvidence of an effect of an explanation beside its disagreement."""

    fitted: DisagreementFit

    @cached_property
    def without(self) -> DisagreementFit:
        name = self.effect.name
        at = {k: v for k, v in self.fitted.at.items() if not k.startswith(f"{name}.")}
        return settle(self.search, self.fitted.response.without(name), at, ROUNDS)

    def refitted(self, c: Fitted) -> DisagreementFit:
        return settle(self.search.exchanged, c.response, c.at, CONFIRMING)

    @property
    def required_gain(self) -> float:
        """Return the gain that a step of the search needs; twice that of a name if the effect leaves something of every
        channel, as what is no effect of the library may be one in part."""
        more = 0.0 if self.left_of_channel < HARDLY_LEFT else self.table.delta_lnL
        return required_gain(self.table, self.effect) + more

    @cached_property
    def _bare_residual(self) -> Complex:
        """Return the residual (F, C) of B without the effect, everything else at the same values."""
        fitted, data = self.fitted, self.fitted.unseen
        less = fitted.response.without(self.effect.name)
        return np.asarray(data.H - less.frf(data.f, less.own_values(fitted.at), data.channels))

    @cached_property
    def cells(self) -> ActingCells:
        """Return the residual of the explanation where the effect acts."""
        fitted, data, bare = self.fitted, self.fitted.unseen, self._bare_residual
        change, before, after = left_by_cell(data, bare - fitted.residual), left_by_cell(data, bare), fitted.Q
        acts = change > ACTS
        if not acts.any():
            return ActingCells(1.0, 0, np.inf)
        larger = np.maximum(before, change)
        share = float(_log(after)[acts].sum() / max(_log(larger)[acts].sum(), 1e-9))
        worse = int((acts & (after > np.maximum(larger, EXPLAINED_CELL))).sum())
        most = np.argmax(change, axis=0)
        worst = max(float(after[k, c]) for c, k in enumerate(most) if change[k, c] > ACTS)
        return ActingCells(share, worse, worst)

    @cached_property
    def left_of_channel(self) -> float:
        """Return G after over G before the effect, everything else at the same values: of the channel that it explains
        best; 0 if it makes a channel agree that did not."""
        residuals, variance = (self._bare_residual, self.fitted.residual), self.fitted.unseen.variance
        before, after = (np.mean(np.abs(residual) ** 2 / variance, axis=0) for residual in residuals)
        return 0.0 if np.any((after < AGREES) & (before > AGREES)) else float(np.min(after / before))

    @property
    def unexplained_beside(self) -> float:
        """Return the smallest G of the channels on which an effect of the signal path does not act: what is in the
        mechanics moves the zeros of all of them, and may do all that it seems to do; a channel that alone disagrees has
        a path of its own. 0 for an effect of the mechanics, or of every channel."""
        data, others = self.fitted.unseen, [c for c in self.fitted.unseen.channels if c not in self.effect.channels]
        if not self.effect.in_signal_path or not others:
            return 0.0
        G = np.mean(np.abs(self.fitted.residual) ** 2 / data.variance, axis=0)
        return float(min(G[data.channels.index(c)] for c in others))

    @property
    def percent_left(self) -> float:
        return 100 * self.cells.share


def _log(Q: Array) -> Array:
    return np.log(np.maximum(Q, 1.0))


BESIDE_GATES: tuple[Gate[BesideEvidence], ...] = (
    GAIN,
    CONFIRMED,
    Gate(
        "share_left",
        "leaves {e.percent_left:.0f} % of the gap where it acts",
        lambda e: not e.cells.share > LEFT,
    ),
    Gate(
        "no_cell_worse",
        "makes the gap wider in a band where it acts",
        lambda e: not e.cells.worse,
        after="share_left",
    ),
    Gate(
        "worst_cell",
        "leaves G {e.cells.worst:.0f} in the band where it acts most",
        lambda e: not e.cells.worst > FAR_ABOVE,
        after="no_cell_worse",
    ),
    Gate(
        "channel_left",
        "leaves more than a fifth of the gap of every channel",
        lambda e: e.left_of_channel < LEFT_OF_CHANNEL,
    ),
    Gate(
        "mechanics",
        "stands beside other channels that the mechanics do not explain (G {e.unexplained_beside:.0f})",
        lambda e: not e.unexplained_beside > FAR_ABOVE,
    ),
    WITHIN_LIMITS,
    SIGNIFICANT,
    ON_ITS_CHANNELS,
    OFF_MODES,
    Gate(
        "priors",
        "needs calibrated values that the model's file does not allow",
        lambda e: not e.far_from_priors,
    ),
    SLOW_SINES,
)


def judge_claims_beside(
    search: Search, steps: Sequence[ExplainingStep], final: Fit, slow: Slow | None
) -> tuple[tuple[Claim, ...], tuple[Ambiguous, ...]]:
    """Judge every effect of an explanation beside its disagreement by its gates, and return the claims, and the rivals
    of those that pass.

    steps: those of the search; final: the fit of the whole to all bins, the disagreement in its covariance."""
    claims, rivals, fitted = [], [], steps[-1].after
    search = replace(search, effort=Effort())  # a few fits, whatever the search has spent
    for step in steps:
        effect = step.member
        if not isinstance(effect, Effect):
            continue
        evidence = BesideEvidence(effect, fitted, final, slow, search.table, search)
        reasons = failed_reasons(BESIDE_GATES, evidence)
        if not reasons:
            alike, reasons = _compare_rivals(evidence, step)
            if alike:
                experiment = sharpest(e.experiment for e in (effect, *alike))
                names = sorted({effect.name, *(e.name for e in alike)})
                rivals.append(Ambiguous(tuple(names), experiment.value))
        claims.append(evidence.claim(reasons))
    return tuple(claims), tuple(rivals)


def _compare_rivals(evidence: BesideEvidence, step: ExplainingStep) -> tuple[list[Effect], list[str]]:
    """Return the effects that do as well in the place of one, and why a member that does better takes its name."""
    effect, fitted = evidence.effect, evidence.fitted
    own, first = score_of(effect, fitted), score_of(effect, step.after)
    near = [m for m, fit in step.rivals if score_of(m, fit) > first - NEAR and m.name not in fitted.response.names]
    alike, reasons = [], []
    tried = add_one(evidence.search, evidence.without, near) if near else []
    if effect.rivals_elements:
        tried += add_elements(evidence.search, evidence.without)
    for member, fit in tried:
        score = score_of(member, fit)
        if score > own - STAND_IN and isinstance(member, Effect):
            alike.append(member)
        elif score > own:
            reasons.append(f"explains less than {member.label}")
    return alike, reasons
