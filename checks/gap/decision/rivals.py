"""What explains the records as well as a named effect, which is then no name ([GAP] 6, 11): other effects, other values
of calibrated parameters, and what a bench that no file describes may add.

Exact ones are known: a payload mass is a common scaling of force constant, stiffness and damping; a constant cross-talk
into Vs, in the 2-DoF APA, is another sensor constant with another split of the force.
"""

from collections.abc import Callable, Sequence

import numpy as np

from checks.arrays import Complex
from checks.gap.decision.alternatives import OTHER_VALUES, needed_apart
from checks.gap.decision.gates import Claim
from checks.gap.decision.prediction import Prediction, shares
from checks.gap.decision.result import Ambiguous
from checks.gap.effects import EFFECTS
from checks.gap.modelling.effect import Effect
from checks.gap.modelling.experiment import Experiment, sharpest
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.search.bench_paths import SAME_LAG_US
from checks.gap.search.explanation import Explanation
from checks.gap.search.forward import SearchResult
from checks.model.channel_paths import CHANNELS, LATENCIES

COUNTS = 0.1  # of the largest share in the imitation: parameters with less are not listed
OF_BENCH = "losses of the bench"
LOPSIDED = "a lopsided APA"
Rule = Callable[[Explanation, Effect], Ambiguous | None]  # what does as well as an effect of an explanation


def rivals_by(rules: Sequence[Rule], full: Explanation, claims: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return what some rules find to do as well as the effects of claims."""
    found = (rule(full, c.effect) for rule in rules for c in claims)
    return tuple(a for a in found if a is not None)


def indistinguishable(result: SearchResult, claims: Sequence[Claim], table: Thresholds) -> tuple[Ambiguous, ...]:
    """Return the names of other adequate explanations that unseen records do not distinguish from the best."""
    names = result.best.names
    out = []
    for claim in claims:
        alike, others = {claim.effect.name}, _up_to_form(names - {claim.effect.name})
        asks = {e.name: e.experiment for c in (result.best, *result.rivals) for e in c.response.effects}
        for rival in result.rivals:
            # An explanation with more parameters has to earn them, or whatever is flexible would rival every name.
            apart = 2.0 * max(result.best.lnL - rival.lnL, result.best.score - rival.score)
            needed = needed_apart(claim, rival.response.effects, table)
            if not rival.response.unmodelled_modes and apart < needed:
                alike |= {n for n in rival.names - names if _up_to_form(rival.names - {n}) == others}
        if len(alike) > 1:
            experiment = sharpest(asks[name] for name in sorted(alike))
            out.append(Ambiguous(tuple(sorted(alike)), experiment.value))
    return tuple(out)


def _up_to_form(names: frozenset[str]) -> list[str]:
    """Return the names, in order, with the channel in the place of the lags of one channel: which of them it is, a
    latency or a filter, tells nothing of the others."""
    lags = {e.name: e.channels[0] for e in EFFECTS.values() if _is_of_one_channel(e)}
    return sorted(lags.get(name, name) for name in names)


def _is_of_one_channel(effect: Effect) -> bool:
    """Return whether an effect is a lag of one channel, as the path of a bench is."""
    return effect.lags and len(effect.channels) == 1


def imitated(full: Explanation, effect: Effect) -> Ambiguous | None:
    """Return an effect that calibrated parameters imitate, with these: only their priors favour it."""
    names = ", ".join(imitation(full, effect))
    return Ambiguous((effect.name, f"{OTHER_VALUES} {names}"), effect.experiment.value) if names else None


def lags_alike(full: Explanation, effect: Effect) -> Ambiguous | None:
    """Return a lag whose form the band does not show, with the others of its channels."""
    return Ambiguous(_lags_on(effect.channels), effect.experiment.value) if any_lag_explains(full, effect) else None


def _lags_on(channels: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the lags of exactly these channels."""
    return tuple(sorted(e.name for e in EFFECTS.values() if e.lags and set(e.channels) == set(channels)))


def forms_of_drive_lag(full: Explanation, effect: Effect) -> Ambiguous | None:
    """Return a lag of the drive whose form a bench that was not learned makes up: beside another lag, two of them or
    one of second order are as well another lag of first order behind the bench's own."""
    lags = [e for e in full.response.effects if e.lags]
    in_drive = [e for e in lags if set(e.channels) == set(CHANNELS)]
    if full.response.model.learned is not None or len(lags) < 2 or sum(len(e.parameters) for e in in_drive) < 2:
        return None
    return Ambiguous(_lags_on(CHANNELS), Experiment.DUMMY.value) if effect in in_drive else None


def early_channels(full: Explanation, effect: Effect) -> Ambiguous | None:
    """Return the latency of a channel that is early beside a lag of the drive, on a bench that was not learned, with
    those of the other channels: no converter is early, so the others may be late and the drive less so."""
    response, of_channel = full.response, set(LATENCIES.values())
    latencies = [e for e in EFFECTS.values() if any(set(p.sets) & of_channel for p in e.parameters)]
    in_drive = any(e.lags and set(e.channels) == set(CHANNELS) for e in response.effects)
    if response.model.learned is not None or not in_drive or effect not in latencies:
        return None
    names = tuple(sorted(e.name for e in latencies if set(e.channels) <= set(full.unseen.channels)))
    return Ambiguous(names, effect.experiment.value) if full.of(effect.name)["tau_us"] < 0.0 else None


def scale_or_lopsided(full: Explanation, effect: Effect) -> Ambiguous | None:
    """Return a scale of the encoder beside something that is left, where the model's file states that the APA may be
    lopsided: its head turns, and the encoder reads some per cent otherwise, for which the file has an offset."""
    stated = any(name.startswith("apa.lopsided") for name in full.response.model.sds)
    is_scale = any("encoder.scale" in p.sets for p in effect.parameters)
    rivals = is_scale and stated and not full.adequate
    return Ambiguous((effect.name, LOPSIDED), effect.experiment.value) if rivals else None


def losses_of_bench(full: Explanation, effect: Effect) -> Ambiguous | None:
    """Return an effect that multiplies all channels alike where a bench that was not learned has paths of its own,
    fitted or named: losses of its amplifier or its converters do the same, to the slow sines as well."""
    own_paths = full.response.paths or any(map(_is_of_one_channel, full.response.effects))
    if full.response.model.learned is not None or not own_paths:
        return None
    alike = effect.factor and not effect.lags and set(effect.channels) == set(CHANNELS)
    return Ambiguous((effect.name, OF_BENCH), Experiment.DUMMY.value, or_bench=True) if alike else None


def lags_of_bench(full: Explanation) -> tuple[Ambiguous, ...]:
    """Return the lags that the paths of a bench may be, for each channel that is late by more than a record tells."""
    out = []
    for path in full.response.paths:
        if abs(full.of(path.name)["tau_us"]) > SAME_LAG_US:
            alike = [e for e in EFFECTS.values() if e.lags and set(path.channels) <= set(e.channels)]
            out.append(Ambiguous(tuple(sorted(e.name for e in alike)), sharpest(e.experiment for e in alike).value))
    return tuple(out)


def imitation(full: Explanation, effect: Effect) -> tuple[str, ...]:
    """Return the calibrated parameters that together imitate the effect, the largest share first; none if the part that
    they cannot imitate is seen: beyond 2 delta lnL of two distinguishable explanations. The modes of an APA are limited
    to their scatter, the paths of a bench to their size, because without that limit they would imitate anything; the
    latencies of a learned bench to what its units have in common, because that was measured."""
    share, rest = Prediction.of(full, [full.unseen]).imitated(effect)
    if rest > full.table.two_delta_lnL:
        return ()
    ranked = sorted(((abs(s), n) for n, s in share.items()), reverse=True)
    return tuple(n for s, n in ranked if s > COUNTS * ranked[0][0])


def any_lag_explains(full: Explanation, effect: Effect) -> bool:
    """Return whether a delay with a droop does as well in the place of a lag: exp(c1 s + c2 s^2 ...) with real c, as
    many as the effect has parameters. Then its order or its damping is not seen, because its corner lies too far above
    the band: a hold, a filter and a slow amplifier are one thing. Of a lag with one parameter that is the question
    whether it is a delay, which the search asks."""
    number = len(effect.parameters)
    if not effect.lags or number < 2:
        return False
    data, response = full.unseen, full.response
    H = full.modelled
    factor = H / (H - full.change_by(effect))
    log = np.log(np.abs(factor)) + 1j * np.unwrap(np.angle(factor), axis=0)
    s = 2j * np.pi * data.f[:, None] / (2.0 * np.pi * data.f[-1])
    acts = np.array([c in effect.channels for c in data.channels])
    terms = np.array([H * s**n * acts for n in range(1, number + 1)])
    free = [p for p in response.free(full.at) if p.name in full.at]
    own = [p.name for p in free if p.name.split(".")[0] == effect.name]
    rest = [p for p in free if p.name not in own]
    J = response.jacobian(data.f, [p.name for p in rest], full.at, data.channels)
    priors = [1.0 / p.sd if np.isfinite(p.sd) else 0.0 for p in rest]

    def left(residual: Complex, columns: Complex) -> float:
        limits = np.array([*priors, *[0.0] * len(columns)])
        return shares(data.whitener(np.concatenate([J, columns])).T, data.whitener(residual), limits)[1]

    residual = data.H - H
    itself = left(residual, response.jacobian(data.f, own, full.at, data.channels))
    return left(residual + H * log * acts, terms) - itself < full.table.two_delta_lnL


RULES: tuple[Rule, ...] = (imitated, lags_alike, forms_of_drive_lag, early_channels)
BESIDES: tuple[Rule, ...] = (losses_of_bench, scale_or_lopsided)  # what no experiment of the menu tells apart
