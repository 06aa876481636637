"""The library of effects: one file each, one line here. Other packages add theirs under `accept.effects`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from checks.errors import ModelError
from checks.gap.effects import (
    amplifier_bandwidth,
    amplifier_second_order,
    bench_mode,
    channel_latency,
    channel_lowpass,
    charge_highpass,
    creep,
    crosstalk,
    encoder_bracket_mode,
    encoder_mass,
    encoder_read_point,
    encoder_scale,
    hysteresis,
    joint_axial_compliance,
    loop_delay,
    misalignment,
    open_circuit_stiffening,
    payload_mass,
    sensor_highpass,
    sensor_polarity,
    support_mode,
)
from checks.gap.modelling.effect import Effect, Parameter
from checks.model.model import Model
from specs import plugins

_OWN: tuple[Effect, ...] = (
    misalignment.EFFECT,
    joint_axial_compliance.EFFECT,
    loop_delay.EFFECT,
    amplifier_bandwidth.EFFECT,
    sensor_highpass.EFFECT,
    crosstalk.EFFECT,
    bench_mode.EFFECT,
    encoder_bracket_mode.EFFECT,
    encoder_scale.EFFECT,
    encoder_mass.EFFECT,
    encoder_read_point.EFFECT,
    sensor_polarity.EFFECT,
    hysteresis.EFFECT,
    creep.EFFECT,
    open_circuit_stiffening.EFFECT,
    payload_mass.EFFECT,
    *channel_latency.EFFECTS,
    *channel_lowpass.EFFECTS,
    amplifier_second_order.EFFECT,
    charge_highpass.EFFECT,
    support_mode.EFFECT,
)


def effect_problem(effect: Any) -> str:
    """What is wrong with an effect of another package, "" for nothing."""
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


EFFECTS: dict[str, Effect] = {effect.name: effect for effect in _OWN}


def effect_named(name: str) -> Effect:
    """Raises ModelError naming the library."""
    if name not in EFFECTS:
        raise ModelError(f"unknown effect '{name}' (known: {', '.join(EFFECTS)})")
    return EFFECTS[name]


def with_effects(model: Model, effects: Sequence[tuple[str, Mapping[str, float]]]) -> Model:
    """The model with effects (name, parameters) built in, in order. Raises ModelError for an effect or a parameter
    that the model cannot hold."""
    for name, parameters in effects:
        effect = effect_named(name)
        if not effect.in_model:
            able = ", ".join(e.name for e in EFFECTS.values() if e.in_model)
            raise ModelError(f"effect '{name}': a model cannot hold it (effects that it can: {able})")
        model = model.with_values(effect.changes(model, parameters))
    return model


__all__ = ["EFFECTS", "Effect", "Parameter", "effect_named", "with_effects"]

EFFECTS |= plugins.plugins(plugins.EFFECTS, effect_problem, EFFECTS)
