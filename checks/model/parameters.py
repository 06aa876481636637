"""Parameters by flat name: their bounds, and their values in SI."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

from checks.errors import ModelError
from checks.model.structure.attached import ELEMENT
from specs.units import unit_of


@dataclass(frozen=True)
class Rule:
    """lo, hi: bounds, lo excluded when `open`. step: of a derivative, absolute; None: a part of the value."""

    lo: float = -math.inf
    hi: float = math.inf
    open: bool = False
    step: float | None = None


POSITIVE = Rule(lo=0.0, open=True)
NOT_NEGATIVE = Rule(lo=0.0)
_RULES = {
    "damping_ratio": Rule(lo=0.0, hi=0.5),
    "bracket_damping_ratio": Rule(lo=0.0, hi=1.0),
    "mode_damping_ratio": Rule(lo=0.0, hi=1.0),
    "sensor_stiffening": Rule(lo=-0.9, hi=10.0, step=1e-4),
    "actuator_stiffening": Rule(lo=-0.9, hi=10.0, step=1e-4),
    "c_N_s_per_m": Rule(lo=0.0, step=1e-2),
    "ce_N_s_per_m": Rule(lo=0.0, step=1e-2),
    "ca_N_s_per_m": Rule(lo=0.0, step=1e-2),
    "cR_Nm_s_per_rad": Rule(lo=0.0, step=1e-6),
    "guide_damping_N_s_per_m": Rule(lo=0.0, step=1e-2),
    "head_mass_kg": Rule(lo=0.0, step=1e-5),
    "ruler_mass_kg": Rule(lo=0.0, step=1e-5),
    "mass_kg": Rule(lo=0.0, step=1e-5),
    "half_inertia_kg_m2": NOT_NEGATIVE,
    "inertia_x_kg_m2": NOT_NEGATIVE,
    "inertia_y_kg_m2": NOT_NEGATIVE,
    "inertia_z_kg_m2": NOT_NEGATIVE,
    "half_arm_mm": Rule(step=1e-3),
    "length_mm": Rule(lo=0.0, step=1e-3),
    "height_mm": Rule(lo=0.0, step=1e-3),
    "com_x_mm": Rule(step=1e-3),
    "com_y_mm": Rule(step=1e-3),
    "com_z_mm": Rule(step=1e-3),
    "arm_x_mm": Rule(step=1e-3),
    "arm_y_mm": Rule(step=1e-3),
    "ruler_arm_x_mm": Rule(step=1e-3),
    "ruler_arm_y_mm": Rule(step=1e-3),
    "lopsided_x_um": Rule(lo=-5000.0, hi=5000.0, step=0.1),
    "lopsided_y_um": Rule(lo=-5000.0, hi=5000.0, step=0.1),
    "scale": Rule(lo=-1.0, step=1e-5),
    "dx_um": Rule(lo=-5000.0, hi=5000.0, step=0.1),
    "dy_um": Rule(lo=-5000.0, hi=5000.0, step=0.1),
    "dz_um": Rule(lo=-5000.0, hi=5000.0, step=0.1),
    "tau_us": Rule(lo=-1e4, hi=1e5, step=0.01),
    "highpass_Hz": Rule(lo=0.0, step=1e-4),
    "crosstalk_V_per_V": Rule(step=1e-6),
    "pickup_us": Rule(step=1e-3),
    "mode_ratio": Rule(step=1e-5),
    "support_mode_damping_ratio": Rule(lo=0.0, hi=1.0),
    **{f"support_mode_ratio_{c}": Rule(step=1e-5) for c in ("Vs", "de", "da")},
    **{f"latency_{c}_us": Rule(lo=-1e4, hi=1e5, step=0.01) for c in ("Vs", "de", "da")},
    **{f"lowpass_{c}_order": Rule(lo=1.0, hi=8.0) for c in ("Vs", "de", "da")},
    "charge_highpass_Hz": Rule(lo=0.0, step=1e-4),
    "charge_highpass_damping_ratio": Rule(lo=0.0, hi=0.999, open=True),
    "second_order_damping_ratio": Rule(lo=0.0, hi=0.999, open=True),
    **{f"spring_{unit}": Rule(step=1e-3) for unit in ("N_per_um", "Nm_per_rad")},
    **{f"damper_{unit}": Rule(step=1e-4) for unit in ("N_s_per_m", "Nm_s_per_rad")},
    **{f"added_{unit}": Rule(step=1e-6) for unit in ("kg", "kg_m2")},
    "hung_damping_ratio": Rule(lo=0.0, hi=1.0, step=1e-5),
    **{f"point_{axis}_mm": Rule(step=1e-3) for axis in "xy"},
    "gs_V_per_m": Rule(),
    "gs_V_per_N": Rule(),
    "ga_N_per_V": Rule(),
}
RELATIVE_STEP = 1e-4  # truncation 1e-8 and round-off 1e-11 / 1e-4 of a central difference are both small

# Parameters to which the stiffness, damping and mass matrices, or the reading of the motion, are proportional.
_IN_PROPORTION = frozenset(
    {
        *("kx_N_per_um", "ky_N_per_um", "kz_N_per_um", "kRx_Nm_per_rad", "kRy_Nm_per_rad", "kRz_Nm_per_rad"),
        *("c_N_s_per_m", "cR_Nm_s_per_rad", "guide_damping_N_s_per_m", "damping_ratio"),
        *("head_mass_kg", "ruler_mass_kg", "payload_kg", "arm_x_mm", "arm_y_mm"),
        *("ruler_arm_x_mm", "ruler_arm_y_mm", "sensor_stiffening", "actuator_stiffening"),
    }
)
_OFFSET = frozenset({"dx_um", "dy_um", "dz_um", "lopsided_x_um", "lopsided_y_um"})
_ON_THE_AXIS = frozenset({"kx_N_per_um", "ky_N_per_um", "kz_N_per_um", "c_N_s_per_m"})  # the offset is their lever
TURNS_TIES = _OFFSET | {"length_mm", "height_mm"}  # where a rigid direction runs

MODE_STIFFNESS, MODE_DAMPING = "apa.mode_stiffness_", "apa.mode_damping_"  # and the number of the mode, from 1
DAMPING_RATIO = "apa.damping_ratio"
OFF_AT_INFINITY = frozenset(
    {
        *("amplifier.f_Hz", "amplifier.second_order_Hz", "encoder.bracket_Hz"),
        *("bench.lowpass_Vs_Hz", "bench.lowpass_de_Hz", "bench.lowpass_da_Hz"),
    }
)
_SEEN_ONLY = (
    "constants.",
    "delay.",
    "amplifier.",
    "sensor.",
    "bench.mode_",
    "bench.support_mode_",
    "bench.latency_",
    "bench.lowpass_",
    "encoder.scale",
    "encoder.bracket_",
    "unidentified.",
)
_TO_SI = {"um": 1e-6, "mm": 1e-3, "us": 1e-6, "N_per_um": 1e6}


@lru_cache(maxsize=4096)
def rule(name: str) -> Rule:
    """Return the rule of a parameter by the last part of its flat name; unlisted parameters must be positive."""
    return _RULES.get(last(name), POSITIVE)


@lru_cache(maxsize=4096)
def last(name: str) -> str:
    """Return the last part of a flat name: `kz_N_per_um` of `joint.bottom.kz_N_per_um`."""
    return name.rpartition(".")[2]


def matters(changes: Mapping[str, float]) -> dict[str, float]:
    """Return the changed values, sorted by name, that derivatives of the matrices may depend on. A factor on a mode of
    the APA changes one entry of its own, so of these only damping matters: for the damping of all."""
    found = [n for n in changes if is_mechanical(n) and not n.startswith(MODE_STIFFNESS)]
    return {n: changes[n] for n in sorted(found)}


def depends_on(name: str, mattering: Mapping[str, float], tied: bool) -> tuple[tuple[str, float], ...]:
    """Return those of the changed values that the derivative of the matrices by a mechanical parameter depends on.
    tied: there are rigid directions, and the coordinates turn with the offset."""
    no_matter: frozenset[str] = frozenset()
    if last(name) in _IN_PROPORTION:
        no_matter = _IN_PROPORTION if tied or last(name) in _ON_THE_AXIS else _IN_PROPORTION | _OFFSET
    of_all = name == DAMPING_RATIO
    return tuple(
        (n, value)
        for n, value in mattering.items()
        if (of_all or not is_mode_factor(n)) and not (no_matter and (last(n) in no_matter or n.startswith(ELEMENT)))
    )


@lru_cache(maxsize=4096)
def is_of_body(name: str) -> bool:
    """Return whether a mechanical parameter changes the APA's own matrices, not only those of parts fastened to it."""
    return name.startswith("apa.") and last(name) not in _OFFSET and not last(name).endswith("_stiffening")


@lru_cache(maxsize=4096)
def is_mode_factor(name: str) -> bool:
    """Return whether a parameter is a factor on a free mode of the APA: it changes one entry of the matrices."""
    return name.startswith((MODE_STIFFNESS, MODE_DAMPING))


def si(values: Mapping[str, float], name: str) -> float:
    """Return the value of a parameter in SI units, from the unit at the end of its name."""
    for suffix in ("N_per_um", "um", "mm", "us"):
        if name.endswith("_" + suffix):
            return values[name] * _TO_SI[suffix]
    return values[name]


def known(names: Iterable[str], allowed: Iterable[str]) -> None:
    """Raise ModelError naming the first parameter that a model does not have."""
    have = allowed if isinstance(allowed, Mapping) else set(allowed)
    for name in names:
        if name not in have:
            raise ModelError(f"no parameter '{name}' (has: {', '.join(sorted(have))})")


@lru_cache(maxsize=4096)
def is_mechanical(name: str) -> bool:
    """Return whether a parameter changes the modes, and not only their measurement."""
    return not name.startswith(_SEEN_ONLY)


def in_range(values: Mapping[str, float]) -> None:
    """Raise ModelError naming the first value that is not a number or out of its bounds."""
    for name, value in values.items():
        r = rule(name)
        if r.lo < value < r.hi and math.isfinite(value):
            continue
        infinite_is_off = name in OFF_AT_INFINITY and value == math.inf
        below = value <= r.lo if r.open else value < r.lo
        if not infinite_is_off and (not math.isfinite(value) or below or value > r.hi):
            least = f"above {r.lo:g}" if r.open else f"{r.lo:g} or more"
            most = "" if math.isinf(r.hi) else f", at most {r.hi:g}"
            raise ModelError(f"{name} is {value:g} {unit_of(name)}; expected a number {least}{most}")


def derivative_step(name: str, value: float) -> float:
    """Return the step of a central difference in the parameter's unit. Raises ModelError for an effect that is off."""
    if not math.isfinite(value):
        raise ModelError(f"{name} is {value:g}: the effect is off and has no derivative; give it a value")
    r = rule(name)
    return r.step if r.step is not None else RELATIVE_STEP * abs(value) if value else RELATIVE_STEP
