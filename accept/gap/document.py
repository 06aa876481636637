"""gap.json of an analysis."""

import math
from collections.abc import Mapping
from typing import Any

from accept.base.documents.gap import (
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
from accept.gap.reasons import considered_explanations
from checks.gap import Result


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
