"""gap.json of an analysis."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from accept.base.documents.analyses import (
    AmbiguousEffects,
    CandidateEffect,
    EffectValue,
    ElementFound,
    ElementPlace,
    Evidence,
    GapAtMode,
    GapBand,
    GapDocument,
    GapExperiment,
    GapSize,
    GapStep,
    NamedEffect,
    UnnamedEffect,
)
from accept.gap.text import chance, words_of
from checks.gap import GapVerdict, Result, Tried
from checks.rounding import fixed


def to_json(serial: str, r: Result) -> dict[str, Any]:
    """Return gap.json ([DESIGN] 6)."""
    return GapDocument(
        serial=serial,
        model=r.model,
        verdict=str(r.verdict),
        gap_before=_size(r.gap_before),
        where=tuple(GapBand(w.channel, w.f_lo_Hz, w.f_hi_Hz, w.p, w.excess_dB) for w in r.where),
        named=tuple(
            NamedEffect(n.effect, _values(n.parameters), Evidence(_finite(n.delta_lnL), n.p), n.sentence)
            for n in r.named
        ),
        ambiguous=tuple(AmbiguousEffects(a.effects, a.experiment) for a in r.ambiguous),
        unnamed=tuple(
            UnnamedEffect(u.channel, u.poles_Hz, u.zeros_Hz, bool(u.level_dependent), u.words, u.ci95, bool(u.at_edge))
            for u in r.unnamed
        ),
        elements=tuple(
            ElementFound(e.kind, _places(e), _values(e.parameters), e.sentence, e.looks_like, e.experiment)
            for e in r.elements
        ),
        candidates=tuple(
            CandidateEffect(", ".join(t.names), _finite(t.delta_lnL), _finite(t.p), why)
            for t, why in considered_explanations(r)
        ),
        steps=tuple(GapStep(s.effect, s.channels) for s in r.steps),
        detection_limits=r.detection_limits,
        gap_after=_size(r.gap_after),
        p_before=r.p_before,
        p_after=r.p_after,
        damping=r.damping,
        notes=r.notes,
        experiments=tuple(
            GapExperiment(t.kind, t.value, _by_channel(t.channels), t.holds, t.level, t.against) for t in r.experiments
        ),
    ).to_json()


def _size(g: Any) -> GapSize:
    return GapSize(g.G, _by_channel(g.channels), tuple(GapAtMode(m.f_Hz, m.G) for m in g.modes))


def _by_channel(gaps: Mapping[str, Any]) -> dict[str, float]:
    return {channel: gap.G for channel, gap in gaps.items()}


def _values(parameters: Mapping[str, Any]) -> dict[str, EffectValue]:
    return {name: EffectValue(v.value, (v.lo, v.hi)) for name, v in parameters.items()}


def _places(e: Any) -> tuple[ElementPlace, ...]:
    return tuple(ElementPlace(p.part, p.against, p.direction, p.point_mm) for p in e.places)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


SHOWN = 8  # of each: the others add little
ALIKE = 3.0  # in ln L: less does not distinguish two explanations
POOR = 1e-3  # probability of the rest below which an explanation leaves something over
NOTHING_MORE = "not named: the additional effect gains nothing"
NOT_KNOWN = "not named: would explain it, but no effect of the library is behind it"
FAR = 2.0  # of a prior's sd: a value that moved so far is worth a second look


@dataclass(frozen=True)
class MovedParameter:
    """A fitted value: prior and sd of the model's file, value and sd after the fit; shift in sd of the prior."""

    name: str
    prior: float
    prior_sd: float
    value: float
    sd: float
    shift: float


def candidates(result: Result) -> Iterator[tuple[str, str, str, str]]:
    """Yield every explanation with its gain in ln L, p of the rest, and why it was named or not; the best first."""
    for tried, why in considered_explanations(result):
        words = ", ".join(map(words_of, tried.names)) or "none"
        gain = fixed(tried.delta_lnL, 0) if math.isfinite(tried.delta_lnL) else "-"
        yield words, gain, "-" if math.isnan(tried.p) else chance(tried.p), why


def considered_explanations(result: Result) -> list[tuple[Tried, str]]:
    """Return the effects that were tried, the best first, each with the reason why it was named or not."""
    named = {n.effect for n in result.named}
    chosen = next((t for t in result.tried if named and set(t.names) == named), None) or _named_explanation(result)
    shown = result.tried[:SHOWN]
    if chosen is not None and chosen not in shown:
        shown = (chosen, *shown)
    shown += tuple(t for t in result.tried[SHOWN:] if math.isnan(t.p) and t is not chosen)  # not evaluated
    return [
        (tried, f"not named: {tried.reason}" if tried.reason else _decision_words(tried, chosen, named, result))
        for tried in shown
    ]


def _named_explanation(result: Result) -> Tried | None:
    """Return a note on the named effects if the explanation first held others that proved to be unnecessary."""
    if not result.named or result.verdict != GapVerdict.EXPLAINED:
        return None
    gain = result.named[0].delta_lnL if len(result.named) == 1 else math.nan
    return Tried(tuple(n.effect for n in result.named), gain, result.p_after)


def _decision_words(tried: Tried, chosen: Tried | None, named: set[str], result: Result) -> str:
    if chosen is tried:
        return "named"
    rivals = {effect for one in result.ambiguous for effect in one.effects}
    if rivals and set(tried.names) & rivals:
        return "not named: cannot be distinguished from its rivals"
    if not tried.names:
        return "leaves the gap as it is"
    if chosen is None:
        return f"not named: leaves something over (p {chance(tried.p)})" if tried.p < POOR else NOT_KNOWN
    behind = chosen.delta_lnL - tried.delta_lnL
    if math.isnan(behind) and tried.p < POOR:
        return f"not named: leaves something over (p {chance(tried.p)})"
    if set(tried.names) > named:
        return "not named: what was named leaves nothing over without it" if -behind > ALIKE else NOTHING_MORE
    if behind > ALIKE:
        return f"not named: fits worse, by {behind:.0f} in ln L"
    if set(tried.names) < named:
        return "not named: part of what was named, and not enough alone"
    if len(tried.names) > len(named):
        return f"not named: needs {len(tried.names)} effects for the same gain"
    return "not named: explains no more than what was named"


def moved_parameters(result: Result) -> list[MovedParameter]:
    """Return the values of the model with a prior, those that the fit moved furthest first."""
    fit, sds = result.fit, result.fit.sds
    found = [
        MovedParameter(n, free.prior, free.sd, fit.at[n], sds[n], (fit.at[n] - free.prior) / free.sd)
        for free in fit.free
        if math.isfinite(free.sd) and free.sd > 0 and (n := free.name) in fit.at
    ]
    return sorted(found, key=lambda one: -abs(one.shift))


def shift_words(one: MovedParameter) -> str:
    """Return the shift of a value in its prior's sd, and a warning if that is far."""
    return f"{round(one.shift, 1) + 0.0:+.1f} sd" + (", far from the model's file" if abs(one.shift) > FAR else "")
