"""Explanations that stand beside their disagreement: members are fitted with the sizes of what they leave free
(`statistics.disagreement`)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from checks.gap.modelling.augmented import Augmented, Values
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.thresholds import PER_PARAMETER, Thresholds
from checks.gap.search.candidates import Search
from checks.gap.search.explanation import Explanation, if_held
from checks.gap.search.places import Places
from checks.gap.search.screen import Score
from checks.gap.statistics.disagreement import with_disagreement

EFFECTS_TRIED, STAND_INS_TRIED, ELEMENTS_TRIED = 8, 5, 3  # members of a round that are fitted, the best of the screen
FOLLOWED = 4  # of these to the end, with everything free
ROUNDS = 6  # of weights
STEPS, STEPS_HELD = 4, 6  # of a fit within a round, and of the first one, with the scatter held
LARGE = 12.5  # gain in the screen, half of what a name needs, from which on an effect may be too large for the weights
SMALL_GAIN = 0.1  # of log-likelihood: a round that gains less is the last


def required_gain(table: Thresholds, member: Effect) -> float:
    """Return the gain that a member needs beside a disagreement: that of a name, plus the cost of its parameters."""
    return table.delta_lnL + PER_PARAMETER * (len(member.parameters) - 1)


def add_one(search: Search, state: Explanation, among: Sequence[Effect] = ()) -> list[Explanation]:
    """Return members added to a state, each at its best beside the disagreement, by falling score; the few that look
    best in the screen. among: only these."""
    weighted = _weighted(search, state)
    absent = [m for m in among or search.library if m.name not in state.response.names]
    scores = sorted(search.screened(state.on(weighted.A).seen, absent), key=lambda s: -s.gain)
    few = [s for s in scores if not s.member.stands_in][:EFFECTS_TRIED]
    few += [s for s in scores if s.member.stands_in][:STAND_INS_TRIED]
    return _fitted(search, weighted, state, few, LARGE)


def add_elements(search: Search, state: Explanation) -> list[Explanation]:
    """Return the generic elements that promise most added to a state, in the same way."""
    weighted = _weighted(search, state)
    scores = sorted(Places(state.on(weighted.A).seen).scores(), key=lambda s: -s.net)
    return _fitted(search, weighted, state, scores[:ELEMENTS_TRIED], np.inf)


def _fitted(
    search: Search, weighted: Search, state: Explanation, scores: Sequence[Score], large: float
) -> list[Explanation]:
    """Return members added to a state and fitted, by falling score. weighted: the search with what the state leaves;
    large: gain from which on an effect is also fitted with the weights of what it leaves itself."""
    out: list[Explanation] = []
    for score in scores:
        if search.over:
            break
        fits = [_begun(weighted, state, score.member, values) for values in score.starts]
        if score.gain > large and not score.member.stands_in:
            fits += [_large(search, state, score.member, values) for values in score.starts]
        out += sorted((fit for fit in fits if fit), key=lambda fit: -fit.lnL)[:1]
    out = sorted(out, key=lambda c: -c.score)
    out[:FOLLOWED] = [settle_if_held(search, c.response, c.at) or c for c in out[:FOLLOWED]]
    return sorted(out, key=lambda c: -c.score)


def _weighted(search: Search, c: Explanation) -> Search:
    """Return the search with the disagreement that an explanation leaves of A in its covariance."""
    return search.on(with_disagreement(search.A, c.on(search.A).residual))


def _begun(weighted: Search, state: Explanation, member: Effect, values: Values) -> Explanation | None:
    """Return a member added to a state and fitted from its own values, the scatter at its best; None if the strut is
    not held at them."""
    c = weighted.begun_with(state, member, values, STEPS_HELD)
    return c and if_held(lambda: replace(weighted.free_scatter(c), beside=True))


def _large(search: Search, state: Explanation, member: Effect, values: Values) -> Explanation | None:
    """Return the same with the weights of what the member leaves at its own values. Beside the disagreement without it,
    a large effect is hardly seen, and its fit stays where the disagreement hides the most."""
    start = {**state.at, **{f"{member.name}.{k}": v for k, v in values.items()}}
    own = if_held(lambda: _weighted(search, search.begin(state.response.with_member(member), start)))
    return _begun(own, state, member, values) if own else None


def settle_if_held(search: Search, response: Augmented, start: Values) -> Explanation | None:
    """Return a response fitted to A beside its disagreement; None if the strut is not held at values on the way."""
    return if_held(lambda: settle(search, response, start, ROUNDS))


def settle(search: Search, response: Augmented, start: Values, rounds: int) -> Explanation:
    """Return a response fitted to A beside its disagreement, from values nearby. Raises ModelError."""
    c, last = replace(search.begin(response, start), beside=True), -np.inf
    for _ in range(rounds):
        weighted = _weighted(search, c)
        c = replace(weighted.advance(weighted.begin(response, c.at), STEPS), beside=True)
        now = c.on(search.A).lnL
        if now - last < SMALL_GAIN:
            break
        last = now
    return c
