"""The gap before and after, for a pair of models such that no channel is worse with the named effects."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from checks.fitting.goodness import gaps, overall
from checks.gap.decision.evidence import AGREES
from checks.gap.decision.gates import Claim, accepted
from checks.gap.decision.result import Gaps, ModeGap
from checks.gap.search.explanation import Explanation

ABOUT_MODE_HZ = 5.0
SLACK = 1.05  # of G: the calibration with an effect and the one without are not the same


def withdraw_harmful(
    without: Sequence[Explanation], full: Explanation, claims: Sequence[Claim]
) -> tuple[tuple[Claim, ...], Explanation, Explanation]:
    """Withdraw names until no channel's gap is wider than before, and return the claims and the models with the gaps
    before and after. without: the model without effects, in every available calibration; full: the model with all
    effects found.

    Names are taken back, the one that explains least first, until no channel's gap grows by the others; with none left,
    nothing was gained and both gaps are that of the nearest model."""
    nearest = min(without, key=lambda c: gaps_of(c).G)
    claims = list(claims)
    while good := accepted(claims):
        after = _named_only(full, good)
        gaps_after = gaps_of(after)
        beside = [c for c in without if not gap_increased(gaps_of(c), gaps_after, agrees=0.0, slack=1.0)]
        beside = beside or [c for c in without if not gap_increased(gaps_of(c), gaps_after, slack=1.0)]
        worse = gap_increased(gaps_of(nearest), gaps_after)
        if beside and not worse:
            return tuple(claims), min(beside, key=lambda c: gaps_of(c).G), after
        least = min(good, key=lambda c: c.delta_lnL)
        words = f"would leave {' and '.join(worse) or 'a channel'} worse explained than without it"
        claims[claims.index(least)] = replace(least, reasons=(words,))
    return tuple(claims), nearest, nearest


def gap_increased(before: Gaps, after: Gaps, agrees: float = AGREES, slack: float = SLACK) -> list[str]:
    """Return the channels whose gap is wider after than before, beyond agreement."""
    old, new = before.channels, after.channels
    return [c for c in new if new[c].G > max(agrees, slack * old[c].G)]


def _named_only(full: Explanation, good: Sequence[Claim]) -> Explanation:
    """Return the model as it will be written: without unmodelled modes and unnamed effects, at the values of the joint
    fit. A parameter of the calibration that an unnamed effect stood for keeps the effect's value."""
    names, implied = {c.effect.name for c in good}, full.response.changes(full.at)
    unnamed = [m for m in full.response.counted if m.name not in names]
    response = full.response.without(*(m.name for m in unnamed))
    stood_for = {t: implied[t] for m in unnamed for t in m.stands_for(full.response.model)}
    return replace(full, response=response, at=response.own_values({**full.at, **stood_for}))


def gaps_of(c: Explanation) -> Gaps:
    """Return the gap of a model on its unseen records."""
    data, residual = c.unseen.around(c.modelled), c.residual
    channels = gaps([data], [residual])
    about = []
    poles = np.abs(c.response.model.poles(c.response.changes(c.at))) / (2.0 * np.pi)
    for f0 in (float(f) for f in poles if data.f[0] <= f <= data.f[-1]):
        near = np.abs(data.f - f0) <= ABOUT_MODE_HZ
        if near.any():
            G = overall(gaps([data.at(near)], [residual[near]])).G
            about.append(ModeGap(f0, G))
    return Gaps(overall(channels).G, channels, tuple(about))
