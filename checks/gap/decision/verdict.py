"""The verdict: names with their numbers, effects that cannot be distinguished, and the one word ([GAP] 10 to 12)."""

from collections.abc import Mapping, Sequence

import numpy as np

from checks.fitting.fit import Fit
from checks.gap.decision.aliases import any_lag_explains, imitation
from checks.gap.decision.alternatives import needed_apart
from checks.gap.decision.gates import Claim
from checks.gap.decision.result import (
    AMBIGUOUS,
    EXPLAINED,
    NO_MISSING,
    PARTLY,
    UNEXPLAINED,
    Ambiguous,
    FoundElement,
    Named,
    NamedValue,
    Nameless,
)
from checks.gap.effects import EFFECTS
from checks.gap.modelling.effect import Effect, SlowFinding
from checks.gap.modelling.element import GenericElement
from checks.gap.modelling.experiment import Experiment, sharpest
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.preparation.record_faults import RecordFault
from checks.gap.search.bench_paths import SAME_LAG_US
from checks.gap.search.candidate import Candidate
from checks.gap.search.forward import SearchResult
from checks.model.channel_paths import CHANNELS, LATENCIES
from checks.model.model import Model
from checks.quantity import TWO_SIDED_95

OF_BENCH = "losses of the bench"
LOPSIDED = "a lopsided APA"


def named_effects(
    claims: Sequence[Claim],
    final: Fit,
    early: tuple[RecordFault, ...],
    in_slow: Mapping[Effect, SlowFinding],
    model: Model,
) -> tuple[Named, ...]:
    """Return the named effects in the order in which they were found: before the search, by it, in the slow sines.
    claims: those that passed every gate."""
    out = []
    for fault in early:
        exact = {k: NamedValue(v, v, v) for k, v in fault.parameters.items()}
        out.append(Named(fault.effect, fault.effect.replace("_", " "), fault.words, exact, float("inf"), 0.0))
    for claim in claims:
        effect = claim.effect
        if isinstance(effect, GenericElement):
            continue
        shown = {p.name: _fitted_value(final, effect, p.name, model) for p in effect.parameters}
        out.append(_named(effect, shown, claim.delta_lnL, claim.p))
    for effect, finding in in_slow.items():
        halves = finding.half_widths
        shown = {k: NamedValue(v, v - halves[k], v + halves[k]) for k, v in finding.values.items()}
        out.append(_named(effect, shown, finding.delta_lnL, finding.p))
    return tuple(out)


def _fitted_value(final: Fit, effect: Effect, name: str, model: Model) -> NamedValue:
    """Return a fitted value with its interval, which includes what the units of a learned batch have in common."""
    at, (lo, hi) = final.at[f"{effect.name}.{name}"], final.interval(f"{effect.name}.{name}")
    targets = (t for p in effect.parameters if p.name == name for t in p.targets(model))
    common = TWO_SIDED_95 * max((abs(model.common_offset(t)) for t in targets), default=0.0)
    half = float(np.hypot(hi - at, common))
    return NamedValue(at, at - half, at + half) if common else NamedValue(at, lo, hi)


def _named(effect: Effect, shown: Mapping[str, NamedValue], delta_lnL: float, p: float) -> Named:
    """Return an effect with the sentence of these values and intervals, which `made_again` compares."""
    words = effect.say({k: v.value for k, v in shown.items()}, {k: (v.hi - v.lo) / 2 for k, v in shown.items()})
    return Named(effect.name, effect.title, words, shown, delta_lnL, p)


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


def imitable(full: Candidate, claims: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return the named effects that calibrated parameters imitate: only their priors favour the effect."""
    found = ((c.effect, ", ".join(imitation(full, c.effect))) for c in claims)
    return tuple(Ambiguous((e.name, f"other values of {names}"), e.experiment.value) for e, names in found if names)


def lags_alike(full: Candidate, claims: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return the named lags whose form the band does not show, with the others of their channels."""
    found = (c.effect for c in claims if any_lag_explains(full, c.effect))
    return tuple(Ambiguous(_lags_on(e.channels), e.experiment.value) for e in found)


def _lags_on(channels: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the lags of exactly these channels."""
    return tuple(sorted(e.name for e in EFFECTS.values() if e.lags and set(e.channels) == set(channels)))


def forms_of_drive_lag(full: Candidate, claims: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return the named lags of the drive whose form a bench that was not learned makes up: beside another lag, two of
    them or one of second order are as well another lag of first order behind the bench's own."""
    lags = [e for e in full.response.effects if e.lags]
    in_drive = [e for e in lags if set(e.channels) == set(CHANNELS)]
    if full.response.model.learned is not None or len(lags) < 2 or sum(len(e.parameters) for e in in_drive) < 2:
        return ()
    if not any(c.effect in in_drive for c in claims):
        return ()
    return (Ambiguous(_lags_on(CHANNELS), Experiment.DUMMY.value),)


def early_channels(full: Candidate, claims: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return the named latencies of a channel that is early beside a lag of the drive, on a bench that was not learned,
    with those of the other channels: no converter is early, so the others may be late and the drive less so."""
    response, of_channel = full.response, set(LATENCIES.values())
    latencies = [e for e in EFFECTS.values() if any(set(p.sets) & of_channel for p in e.parameters)]
    in_drive = any(e.lags and set(e.channels) == set(CHANNELS) for e in response.effects)
    if response.model.learned is not None or not in_drive:
        return ()
    early = [e for e in (c.effect for c in claims) if e in latencies and response.of(full.at, e.name)["tau_us"] < 0.0]
    names = tuple(sorted(e.name for e in latencies if set(e.channels) <= set(full.unseen.channels)))
    return tuple(Ambiguous(names, e.experiment.value) for e in early)


def scale_or_lopsided(full: Candidate, claims: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return a named scale of the encoder beside something that is left, where the model's file states that the APA may
    be lopsided: its head turns, and the encoder reads some per cent otherwise, for which the file has an offset."""
    stated = [name for name in full.response.model.sds if name.startswith("apa.lopsided")]
    scales = [c.effect for c in claims if any("encoder.scale" in p.sets for p in c.effect.parameters)]
    if full.adequate or not stated:
        return ()
    return tuple(Ambiguous((effect.name, LOPSIDED), effect.experiment.value) for effect in scales)


def losses_of_bench(full: Candidate, claims: Sequence[Claim]) -> tuple[Ambiguous, ...]:
    """Return the named effects that multiply all channels alike where a bench that was not learned has paths of its
    own, fitted or named: losses of its amplifier or its converters do the same, to the slow sines as well."""
    own_paths = full.response.paths or any(map(_is_of_one_channel, full.response.effects))
    if full.response.model.learned is not None or not own_paths:
        return ()
    alike = [e for e in (c.effect for c in claims) if e.factor and not e.lags and set(e.channels) == set(CHANNELS)]
    return tuple(Ambiguous((e.name, OF_BENCH), Experiment.DUMMY.value, or_bench=True) for e in alike)


def lags_of_bench(full: Candidate) -> tuple[Ambiguous, ...]:
    """Return the lags that the paths of a bench may be, for each channel that is late by more than a record tells."""
    out = []
    for path in full.response.paths:
        if abs(full.response.of(full.at, path.name)["tau_us"]) > SAME_LAG_US:
            alike = [e for e in EFFECTS.values() if e.lags and set(path.channels) <= set(e.channels)]
            out.append(Ambiguous(tuple(sorted(e.name for e in alike)), sharpest(e.experiment for e in alike).value))
    return tuple(out)


def verdict_of(
    adequate: bool,
    named: Sequence[Named | FoundElement],
    rivals: Sequence[Ambiguous],
    missing: Sequence[Nameless],
) -> str:
    """Return the verdict. adequate: of the whole explanation, on unseen records; named: effects and elements."""
    if adequate and not missing:
        if rivals or any(isinstance(n, FoundElement) and (n.alike or len(n.places) > 1) for n in named):
            return AMBIGUOUS
        return EXPLAINED if named else NO_MISSING
    return PARTLY if named or rivals else UNEXPLAINED
