"""The gates before a name that stands beside a disagreement: of an explanation that leaves something unexplained.

Evidence and rivals by the profile likelihood of `search.disagreement`; and, because the nearest member of a library is
not the cause, three conditions on the cells where an effect acts: it explains most of them, makes none worse, and what
it changes most is explained.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from checks import distributions as stats
from checks.arrays import Array
from checks.errors import ModelError
from checks.fitting.fit import Fit
from checks.gap.decision.gates import LOOKED, Claim, acts_alone, off_zero, on_a_mode
from checks.gap.decision.result import Ambiguous
from checks.gap.modelling.augmented import Member
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import sharpest
from checks.gap.modelling.slow_sines import Slow
from checks.gap.search.candidates import Effort, Search
from checks.gap.search.disagreement import (
    ROUNDS,
    STAND_IN,
    Beside,
    ExplainingStep,
    left_by_cell,
    needed,
    one_more,
    score_of,
    settle,
)

ACTS = 1.0  # of Q: an effect that changes a cell by more acts there
LEFT = 1.0 / 3.0  # of the logarithms of Q over the cells where an effect acts: with more left, it is not the cause
CONFIRMING = 2  # rounds of weights, from values that are nearly right
EXPLAINED_CELL = 1.5  # of Q, as of G of a channel
FAR_ABOVE = 10.0  # of Q in the cell that an effect changes most
NEAR = 15.0  # of score: rivals of its step that are compared once more beside everything else


def claims_beside(
    search: Search, steps: Sequence[ExplainingStep], final: Fit, slow: Slow | None
) -> tuple[tuple[Claim, ...], tuple[Ambiguous, ...]]:
    """Judge every effect of an explanation beside its disagreement by its gates, and return the claims, and the rivals
    of those that pass.

    steps: those of the search; final: the fit of the whole to all bins, the disagreement in its covariance."""
    made, rivals, state = [], [], steps[-1].after
    search = replace(search, effort=Effort())  # a few fits, whatever the search has spent
    for step in steps:
        effect = step.member
        if not isinstance(effect, Effect):
            continue
        less = state.response.without(effect.name)
        at = {k: v for k, v in state.at.items() if not k.startswith(f"{effect.name}.")}
        without = settle(search, less, at, ROUNDS)
        gain = state.lnL - without.lnL
        p = gain_p(gain, effect)
        reasons = _reasons(search, effect, state, without, gain, final)
        if slow is not None and (words := effect.slow.contradicts(slow, state.response.of(final.at, effect.name))):
            reasons.append(words)
        if not reasons:
            alike, better = _rivals(search, effect, state, without, step)
            reasons += better
            if alike:
                experiment = sharpest(e.experiment for e in (effect, *alike))
                names = sorted({effect.name, *(e.name for e in alike)})
                rivals.append(Ambiguous(tuple(names), experiment.value))
        made.append(Claim(effect, gain, p, tuple(reasons)))
    return tuple(made), tuple(rivals)


def gain_p(gain: float, member: Member) -> float:
    """Return the chance of a gain in log-likelihood by one of the places that a search looks at."""
    return float(min(1.0, LOOKED * stats.chi2.sf(2.0 * max(gain, 0.0), max(1, len(member.parameters)))))


def _reasons(search: Search, effect: Effect, state: Beside, without: Beside, gain: float, final: Fit) -> list[str]:
    """Return the gates that an effect does not pass."""
    out, asked = [], needed(search.table, effect)
    if not gain > asked:
        out.append(f"explains too little beside what is left (gain {gain:.0f})")
    elif not (again := _confirmed(search, state, without)) > asked:
        out.append(f"is not confirmed with the records exchanged (gain {again:.0f})")
    acting = cells_of(effect, state)
    if acting.share > LEFT:
        out.append(f"leaves {100 * acting.share:.0f} % of the gap where it acts")
    elif acting.worse:
        out.append("makes the gap wider in a band where it acts")
    elif acting.worst > FAR_ABOVE:
        out.append(f"leaves G {acting.worst:.0f} in the band where it acts most")
    names = [f"{effect.name}.{p.name}" for p in effect.parameters]
    if bound := [n for n in names if n in final.at_bound]:
        out.append(f"{bound[0]} is at its physical limit")
    if not off_zero(search.table, effect, final, state):
        out.append("parameters not significant")
    if lonely := acts_alone(effect, state.response, state.at, state.unseen):
        out.append(lonely)
    if on_a_mode(effect, state.response, final.at):
        out.append("lies on a mode of the strut, which looks the same when its coupling is not that of the model")
    free = [p for p in state.response.free() if np.isfinite(p.sd)]
    if any(abs(state.at[p.name] - p.prior) > search.table.pull * p.sd for p in free):
        out.append("needs calibrated values that the model's file does not allow")
    return out


@dataclass(frozen=True)
class ActingCells:
    """The residual in the cells in which an effect acts. share: of the logarithms of Q; worse: how many it makes worse;
    worst: Q of the cell that it changes most, in the channel with the largest."""

    share: float
    worse: int
    worst: float


def cells_of(effect: Effect, state: Beside) -> ActingCells:
    """Return the residual of an explanation where one of its effects acts."""
    data, response = state.unseen, state.response
    less = response.without(effect.name)
    at = {p.name: state.at.get(p.name, p.begin) for p in less.free()}
    bare = data.H - less.frf(data.f, at, data.channels)
    change, before, after = left_by_cell(data, bare - state.residual), left_by_cell(data, bare), state.Q
    acts = change > ACTS
    if not acts.any():
        return ActingCells(1.0, 0, np.inf)
    larger = np.maximum(before, change)
    share = float(_log(after)[acts].sum() / max(_log(larger)[acts].sum(), 1e-9))
    worse = int((acts & (after > np.maximum(larger, EXPLAINED_CELL))).sum())
    most = np.argmax(change, axis=0)
    worst = max(float(after[k, c]) for c, k in enumerate(most) if change[k, c] > ACTS)
    return ActingCells(share, worse, worst)


def _log(Q: Array) -> Array:
    return np.log(np.maximum(Q, 1.0))


def _confirmed(search: Search, state: Beside, without: Beside) -> float:
    """Return the same gain with the realisations exchanged: fitted to B, judged on A."""
    exchanged = replace(search, A=search.B, B=search.A)
    try:
        both = [settle(exchanged, b.response, b.at, CONFIRMING) for b in (state, without)]
    except ModelError:
        return -np.inf
    return both[0].lnL - both[1].lnL


def _rivals(
    search: Search, effect: Effect, state: Beside, without: Beside, step: ExplainingStep
) -> tuple[list[Effect], list[str]]:
    """Return the effects that do as well in the place of one, and why a member that does better takes its name."""
    own = score_of(effect, state)
    first = score_of(effect, step.after)
    near = [m for m, b in step.rivals if score_of(m, b) > first - NEAR and m.name not in state.response.names]
    alike, better = [], []
    for member, b in one_more(search, without, near) if near else []:
        if score_of(member, b) > own - STAND_IN and isinstance(member, Effect):
            alike.append(member)
        elif score_of(member, b) > own:
            better.append(f"explains less than {member.label}")
    return alike, better
