"""The library of effects: one file each, found by listing this folder and its rooms. A file holds an `EFFECT`, or
`EFFECTS` of one kind. Other packages add theirs under `accept.effects`."""

from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from checks.errors import ModelError
from checks.gap.modelling.effect import Effect, Parameter
from checks.model.model import Model
from specs import plugins


def effect_problem(effect: Any) -> str:
    """Return the error in an effect of another package, or ""."""
    if not isinstance(effect, Effect):
        return f"is a {type(effect).__name__}, expected an Effect"
    if not effect.channels or not effect.sources:
        return f"effect '{effect.name}' names no {'sources' if effect.channels else 'channels'}"
    start = {p.name: p.start for p in effect.parameters}
    effect.say(start, start)
    if effect.factor is not None:
        s = 2j * np.pi * np.array([10.0, 100.0, 1000.0])
        out = np.asarray(effect.factor(start, s))
        if out.shape != s.shape or not np.isfinite(out).all():
            return f"effect '{effect.name}': its factor gives {out!r} for three frequencies"
    return ""


def _own() -> Iterator[Effect]:
    """Yield the effects of this folder, of one room after the other."""
    for name in plugins.listed(__name__):
        module = import_module(name)
        yield from getattr(module, "EFFECTS", None) or (module.EFFECT,)


EFFECTS: dict[str, Effect] = {effect.name: effect for effect in _own()}


def effect_named(name: str) -> Effect:
    """Return an effect by name. Raises ModelError listing the library if it has no such effect."""
    if name not in EFFECTS:
        raise ModelError(f"unknown effect '{name}' (known: {', '.join(EFFECTS)})")
    return EFFECTS[name]


def with_effects(model: Model, effects: Sequence[tuple[str, Mapping[str, float]]]) -> Model:
    """Return the model with effects (name, parameters) built in, in order. Raises ModelError for an effect or a
    parameter that the model cannot hold."""
    for name, parameters in effects:
        effect = effect_named(name)
        if not effect.in_model:
            able = ", ".join(e.name for e in EFFECTS.values() if e.in_model)
            raise ModelError(f"effect '{name}': a model cannot hold it (effects that it can: {able})")
        model = model.with_values(effect.changes(model, parameters))
    return model


__all__ = ["EFFECTS", "Effect", "Parameter", "effect_named", "with_effects"]

EFFECTS |= plugins.plugins(plugins.EFFECTS, effect_problem, EFFECTS)
