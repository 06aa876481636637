"""Explanations compared together with their residual: a disagreement between model and unit whose size is estimated.

An explanation may be right and yet leave something: another effect, or what no effect of the library does. Compared as
if noise and tolerance were all that it may leave, whatever bends the model towards the rest wins, and intervals are far
too narrow ([KENNEDY01]; [BRYNJARSDOTTIR14]). Here the rest is a random function of frequency in every channel, smooth
over half an octave, of a size that is free in each half octave. A cell (channel and half octave) then holds two real
numbers of information on that size, however many bins it has. With E the whitened energy of a cell's n bins and Q = E /
2n, the profile likelihood over all sizes is

    ln L = - sum over cells of (2 / 2) ln max(Q, 1) - (priors) / 2,

and its maximum is found by fits in which the variance of a cell's bins is raised by (Q - 1) 2n / 2, Q from the fit
before (iterated weights; each round lowers the sum). An effect gains by the number of cells that it explains and by how
much better, not by the bins of a single peak.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.dataset import Dataset
from checks.fitting.prior import prior_rows
from checks.gap.modelling.augmented import Augmented, Member, Values
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.thresholds import PER_PARAMETER, Thresholds
from checks.gap.search.candidate import Candidate, Fitted
from checks.gap.search.candidates import Search
from checks.gap.search.places import Places
from checks.gap.search.screen import screen
from checks.gap.statistics.projected_residual import project

CELLS_PER_OCTAVE = 2.0
FIRST_HZ = 5.0  # where the first cell begins
VALUES_PER_CELL = 2.0  # real numbers that a disagreement smooth over a cell has in it: one complex value
STAND_IN = 4.6  # of log-likelihood, a ratio of 100: by so much a stand-in must be better than an effect
EFFECTS_TRIED, STAND_INS_TRIED, ELEMENTS_TRIED = 8, 5, 3  # members of a round that are fitted, the best of the screen
FOLLOWED = 4  # of these to the end, with everything free
ROUNDS = 6  # of weights
STEPS, STEPS_HELD = 4, 6  # of a fit within a round, and of the first one, with the scatter held
LARGE = 12.5  # gain in the screen, half of what a name needs, from which on an effect may be too large for the weights
SMALL_GAIN = 0.1  # of log-likelihood: a round that gains less is the last


def cells(f: Array) -> NDArray[np.intp]:
    """Return the number of the half octave (F,) that each frequency f (F,) [Hz] lies in."""
    return np.floor(CELLS_PER_OCTAVE * np.log2(f / FIRST_HZ)).astype(np.intp)


def by_cell(data: Dataset, values: Array) -> Array:
    """Return the means (K, C) of values (F, C) over the cells of a dataset, in the order of frequency."""
    _, at, counts = np.unique(cells(data.f), return_inverse=True, return_counts=True)
    out = np.zeros((counts.size, values.shape[1]))
    np.add.at(out, at, values)
    return np.asarray(out / counts[:, None])


def left_by_cell(data: Dataset, residual: Complex) -> Array:
    """Return Q (K, C): squared residual (F, C) over noise variance and squared tolerance, the mean of each cell."""
    return by_cell(data, np.abs(residual) ** 2 / data.variance)


def with_disagreement(data: Dataset, residual: Complex) -> Dataset:
    """Return the dataset with the variance of a disagreement of the size that a residual (F, C) shows in each cell."""
    _, at, counts = np.unique(cells(data.f), return_inverse=True, return_counts=True)
    beyond = np.maximum(left_by_cell(data, residual) - 1.0, 0.0) * (2.0 * counts / VALUES_PER_CELL)[:, None]
    extra = beyond[at] * data.variance
    cov = data.cov.copy()
    d = np.arange(len(data.channels))
    cov[:, d, d] += extra
    return replace(data, cov=cov)


@dataclass(frozen=True, eq=False)
class DisagreementFit(Fitted):
    """An explanation beside its disagreement. cost: half the squared rows of the priors."""

    @cached_property
    def Q(self) -> Array:
        """Return the disagreement (K, C) that is left on B, by cell."""
        return left_by_cell(self.unseen, self.residual)

    @property
    def lnL(self) -> float:
        """Return the profile log-likelihood of B over the sizes of the disagreement, but for a constant."""
        return -0.5 * VALUES_PER_CELL * float(np.log(np.maximum(self.Q, 1.0)).sum()) - self.cost


@dataclass(frozen=True, eq=False)
class ExplainingStep:
    """One more effect in an explanation beside its disagreement. before: without it; after: with it; rivals: other
    members in its place, the best first."""

    member: Member
    before: DisagreementFit
    after: DisagreementFit
    rivals: tuple[tuple[Member, DisagreementFit], ...]

    @property
    def gain(self) -> float:
        """Return the gain in profile log-likelihood of B."""
        return self.after.lnL - self.before.lnL


def search_beside(search: Search, starts: Sequence[Candidate]) -> tuple[DisagreementFit, tuple[ExplainingStep, ...]]:
    """Return the model without effects beside its disagreement, and the effects that are found one after the other.

    starts: candidates with no member that counts, from whose calibrations the search begins."""
    search.say("looking beside what is left")
    begun = [settle_if_held(search, c.response, at) for c in starts for at in (c.at, {})]
    state = base = max((b for b in begun if b is not None), key=lambda b: b.lnL)
    steps: list[ExplainingStep] = []
    while len(steps) < search.table.most_effects and not search.over:
        tried = add_one(search, state)
        effects = [(m, b) for m, b in tried if isinstance(m, Effect)]
        if not effects:
            break
        member, after = effects[0]
        step = ExplainingStep(member, state, after, tuple(t for t in tried if t[0] is not member))
        if not step.gain > required_gain(search.table, member):
            break
        steps.append(step)
        state = after
    return base, tuple(steps)


def required_gain(table: Thresholds, member: Member) -> float:
    """Return the gain that a member needs beside a disagreement: that of a name, plus the cost of its parameters."""
    return table.delta_lnL + PER_PARAMETER * (len(member.parameters) - 1)


def add_one(
    search: Search, state: DisagreementFit, among: Sequence[Member] = ()
) -> list[tuple[Member, DisagreementFit]]:
    """Return members added to a state, each at its best beside the disagreement, by falling score; the few that look
    best in the screen. among: only these."""
    weighted = search.on(with_disagreement(search.A, _residual(search.A, state.response, state.at)))
    projected = project(state.response, weighted.A, state.at)
    absent = [m for m in among or search.library if m.name not in state.response.names]
    scores = sorted((screen(projected, m) for m in absent), key=lambda s: -s.gain)
    search.failures.update({s.member.name: s.failure for s in scores if s.failure})
    few = [s for s in scores if isinstance(s.member, Effect)][:EFFECTS_TRIED]
    few += [s for s in scores if not isinstance(s.member, Effect)][:STAND_INS_TRIED]
    out = []
    for score in few:
        if search.over:
            break
        fits = [_fit_with_member(weighted, state, score.member, values) for values in score.starts]
        if score.gain > LARGE and isinstance(score.member, Effect):
            fits += [_fit_large(search, state, score.member, values) for values in score.starts]
        if fitted := [fit for fit in fits if fit is not None]:
            out.append((score.member, max(fitted, key=lambda fit: fit.lnL)))
    out = sorted(out, key=lambda each: -score_of(*each))
    out = [(m, (settle_if_held(search, b.response, b.at) or b) if i < FOLLOWED else b) for i, (m, b) in enumerate(out)]
    return sorted(out, key=lambda each: -score_of(*each))


def add_elements(search: Search, state: DisagreementFit) -> list[tuple[Member, DisagreementFit]]:
    """Return the generic elements that promise most added to a state, as `add_one` does, by falling score."""
    weighted = search.on(with_disagreement(search.A, _residual(search.A, state.response, state.at)))
    scores = Places(project(state.response, weighted.A, state.at)).scores()
    few = sorted(scores, key=lambda s: -s.net)[:ELEMENTS_TRIED]
    tried = [(s.member, _fit_with_member(weighted, state, s.member, s.starts[0])) for s in few]
    fitted = [(m, settle_if_held(search, b.response, b.at) or b) for m, b in tried if b is not None]
    return sorted(fitted, key=lambda each: -score_of(*each))


def score_of(member: Member, b: DisagreementFit) -> float:
    """Return lnL less the cost of parameters, and less the margin that an unmodelled mode must gain."""
    return b.lnL - PER_PARAMETER * len(member.sizes) - (0.0 if isinstance(member, Effect) else STAND_IN)


def _fit_with_member(search: Search, state: DisagreementFit, member: Member, values: Values) -> DisagreementFit | None:
    """Return a member added to a state and fitted from its own values, the scatter at its best; None if the strut is
    not held at them."""
    with suppress(ModelError):
        if (c := search.begun_with(state.response, state.at, member, values, STEPS_HELD)) is not None:
            c = search.free_scatter(c)
            return _at_values(c.response, c.at, search.B)
    return None


def _fit_large(search: Search, state: DisagreementFit, member: Member, values: Values) -> DisagreementFit | None:
    """Return a member added to a state and fitted with the weights of what it leaves at its own values; None if the
    strut is not held at them. Beside the disagreement without it, a large effect is hardly seen, and its fit stays
    where the disagreement hides the most."""
    response = state.response.with_member(member)
    start = {**state.at, **{f"{member.name}.{k}": v for k, v in values.items()}}
    try:
        at = search.begin(response, start).at
        weighted = search.on(with_disagreement(search.A, _residual(search.A, response, at)))
    except ModelError:
        return None
    return _fit_with_member(weighted, state, member, values)


def settle_if_held(search: Search, response: Augmented, start: Values) -> DisagreementFit | None:
    """Return a response fitted to A beside its disagreement; None if the strut is not held at values on the way."""
    try:
        return settle(search, response, start, ROUNDS)
    except ModelError:
        return None


def settle(search: Search, response: Augmented, start: Values, rounds: int) -> DisagreementFit:
    """Return a response fitted to A beside its disagreement, from values nearby. Raises ModelError."""
    at, last = search.begin(response, start).at, np.inf
    for _ in range(rounds):
        weighted = search.on(with_disagreement(search.A, _residual(search.A, response, at)))
        at = weighted.advance(weighted.begin(response, at), STEPS).at
        now = -_at_values(response, at, search.A).lnL
        if last - now < SMALL_GAIN:
            break
        last = now
    return _at_values(response, at, search.B)


def _at_values(response: Augmented, at: dict[str, float], unseen: Dataset) -> DisagreementFit:
    free = response.free(at)
    off = prior_rows(free, response.model.joint) @ np.array([at[p.name] - p.prior for p in free])
    return DisagreementFit(response, at, 0.5 * float(off @ off), unseen)


def _residual(data: Dataset, response: Augmented, at: Values) -> Complex:
    return data.H - response.frf(data.f, at, data.channels)
