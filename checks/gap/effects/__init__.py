"""The library of effects: one file each, one line here."""

from checks.gap.effects import (
    amplifier_bandwidth,
    bench_mode,
    creep,
    crosstalk,
    encoder_bracket_mode,
    encoder_mass,
    encoder_scale,
    hysteresis,
    joint_axial_compliance,
    loop_delay,
    misalignment,
    open_circuit_stiffening,
    payload_mass,
    sensor_highpass,
    sensor_polarity,
)
from checks.gap.modelling.effect import Effect, Parameter

EFFECTS: dict[str, Effect] = {
    module.EFFECT.name: module.EFFECT
    for module in (
        misalignment,
        joint_axial_compliance,
        loop_delay,
        amplifier_bandwidth,
        sensor_highpass,
        crosstalk,
        bench_mode,
        encoder_bracket_mode,
        encoder_scale,
        encoder_mass,
        sensor_polarity,
        hysteresis,
        creep,
        open_circuit_stiffening,
        payload_mass,
    )
}

__all__ = ["EFFECTS", "Effect", "Parameter"]
