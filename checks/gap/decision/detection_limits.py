"""How small an effect could still have been seen: detection limits at a stated power, from the calibrated residual."""

from collections.abc import Iterable

import numpy as np

from checks import distributions as stats
from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.element import SPRING, element
from checks.gap.modelling.slow_sines import Slow
from checks.gap.modelling.thresholds import Thresholds
from checks.gap.search.screen import directions
from checks.gap.statistics.projected_residual import Projected

SPRINGS_AT = ("payload", "top_interface")
STEPS = 60  # halvings of an interval on a logarithmic scale


def detection_limits(
    projected: Projected, effects: Iterable[Effect], slow: Slow | None, table: Thresholds
) -> dict[str, dict[str, float]]:
    """Return the detection limits: effect -> parameter -> size that would be seen with the stated power at the level of
    the global test; of an effect that needs a channel which was not measured, what slow sines show alone."""
    needed = _noncentrality(table)
    out = {}
    for effect in effects:
        limits = dict(effect.slow.limit(slow, table)) if slow is not None else {}
        if effect.fits(projected.response.model) and set(effect.channels) & set(projected.data.channels):
            limits |= _limits(projected, effect, needed)
        if limits:
            out[effect.name] = limits
    return out


def spring_limits(projected: Projected, table: Thresholds) -> dict[str, float]:
    """Return the smallest spring [N/um] from some places to ground, along z, that would be seen in the same way."""
    springs = [element(place, "z", SPRING) for place in SPRINGS_AT]
    absent = [e for e in springs if not projected.response.model.elements.keys() & {t for p in e.sizes for t in p.sets}]
    return {e.place: _limits(projected, e, _noncentrality(table))["k_N_per_um"] for e in absent}


def _noncentrality(table: Thresholds) -> float:
    """Return the squared shift of a standard normal that a two-sided test sees with the stated power."""
    return float((stats.norm.isf(table.p_global / 2) + stats.norm.ppf(table.power)) ** 2)


def _limits(projected: Projected, effect: Effect, needed: float) -> dict[str, float]:
    linear = [p for p in effect.parameters if p.linear]
    stated = {p.name: p.limit_at for p in effect.parameters if p.limit_at is not None}
    if linear:
        D = directions(projected, effect, {**stated, **{p.name: 0.0 for p in linear}})
        sizes = [float(np.sqrt(needed / max(float(d @ d), 1e-300))) for d in D]
        # an effect beyond its physical bounds cannot be seen at all
        return stated | {p.name: min(x, max(abs(p.lo), abs(p.hi))) for p, x in zip(linear, sizes, strict=True)}
    return _searched(projected, effect, effect.parameters[0], needed)


def _searched(projected: Projected, effect: Effect, p: Parameter, needed: float) -> dict[str, float]:
    """Return the value nearest to no effect that would be seen, for a parameter in which the response is not linear."""
    others = {q.name: q.start for q in effect.parameters if q is not p}
    nothing = effect.off(projected.response.model)[p.name]
    if np.isfinite(nothing) and nothing != 0.0:
        small = 0.05 * p.scale
        seen = _seen(projected, effect, {**others, p.name: nothing + small})
        return {p.name: float(nothing + small * np.sqrt(needed / max(seen, 1e-300)))}
    near, far = (p.hi, p.lo if p.lo > 0 else p.scale) if not np.isfinite(nothing) else (p.scale * 1e-4, p.hi)
    if _seen(projected, effect, {**others, p.name: far}) < needed:
        return {p.name: float(far)}
    for _ in range(STEPS):
        middle = float(np.sqrt(near * far))
        near, far = (near, middle) if _seen(projected, effect, {**others, p.name: middle}) > needed else (middle, far)
    return {p.name: float(far)}


def _seen(projected: Projected, effect: Effect, values: dict[str, float]) -> float:
    d = directions(projected, effect, values)[0]
    return float(d @ d)
