"""What an effect of the gap workflow means in the model's own parameters ([DESIGN] 6).

Hysteresis is not linear and creep has no rational response, so those two are not here: whoever needs them adds them
to the response. `payload_mass` and `encoder_mass` count from the model's value, the others stand for it.
"""

from collections.abc import Iterable, Mapping, Sequence

from checks.errors import ModelError
from checks.model.model import Model

Changes = dict[str, float]

# effect -> its parameter -> the model's parameters that take its value
SETS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "misalignment": {"dx_um": ("misalignment.dx_um",), "dy_um": ("misalignment.dy_um",)},
    "joint_axial_compliance": {
        "kz_N_per_um": ("joint.kz_N_per_um", "joint.bottom.kz_N_per_um", "joint.top.kz_N_per_um")
    },
    "loop_delay": {"tau_us": ("delay.tau_us",)},
    "amplifier_bandwidth": {"f_Hz": ("amplifier.f_Hz",)},
    "sensor_highpass": {"f_Hz": ("sensor.highpass_Hz",)},
    "crosstalk": {"V_per_V": ("sensor.crosstalk_V_per_V",)},
    "bench_mode": {
        "f_Hz": ("bench.mode_Hz",),
        "ratio": ("bench.mode_ratio",),
        "damping_ratio": ("bench.mode_damping_ratio",),
    },
    "encoder_bracket_mode": {"f_Hz": ("encoder.bracket_Hz",), "damping_ratio": ("encoder.bracket_damping_ratio",)},
    "encoder_scale": {"relative": ("encoder.scale",)},
    "open_circuit_stiffening": {"ratio": ("apa.sensor_stiffening",)},
}
ADDS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "payload_mass": {"kg": ("bench.payload_kg",)},
    "encoder_mass": {"kg": ("encoder.head_mass_kg", "encoder.ruler_mass_kg")},
}
TURNS: Mapping[str, tuple[str, ...]] = {"sensor_polarity": ("constants.gs_V_per_m", "constants.gs_V_per_N")}


def effect_changes(model: Model, name: str, parameters: Mapping[str, float]) -> Changes:
    """Changes of the model's values that an effect amounts to. Raises ModelError for an effect or a parameter that
    the model cannot hold."""
    if name in TURNS:
        return {p: -model.values[p] for p in _held(model, name, TURNS[name])}
    table = SETS.get(name) or ADDS.get(name)
    if table is None:
        raise ModelError(f"effect '{name}': none that a model holds (those: {', '.join((*SETS, *ADDS, *TURNS))})")
    if parameters.keys() != table.keys():
        raise ModelError(f"effect '{name}' is given with {_listed(parameters)}; expected {_listed(table)}")
    start = model.values if name in ADDS else {}
    return {
        p: start.get(p, 0.0) + float(value) for key, value in parameters.items() for p in _held(model, name, table[key])
    }


def _listed(names: Iterable[str]) -> str:
    return ", ".join(sorted(names)) or "nothing"


def with_effects(model: Model, effects: Sequence[tuple[str, Mapping[str, float]]]) -> Model:
    """The model with effects (name, parameters) built in, in order."""
    for name, parameters in effects:
        model = model.with_values(effect_changes(model, name, parameters))
    return model


def _held(model: Model, effect: str, names: tuple[str, ...]) -> list[str]:
    held = [name for name in names if name in model.values]
    if not held:
        raise ModelError(f"effect '{effect}' needs {' or '.join(names)}, which model '{model.name}' does not have")
    return held
