"""From flat parameter values (in their own units) to the parts of the strut (in SI)."""

from collections.abc import Mapping

import numpy as np

from checks.arrays import Array
from checks.model.parameters import si
from checks.model.structure.fastened import RIGID, Bench, Encoder, Joint

Values = Mapping[str, float]


def joints_of(values: Values) -> tuple[Joint, Joint] | None:
    """Return the bottom and the top joint, twice the same if the model names one; None without joints."""
    if "joint.kRx_Nm_per_rad" in values:
        both = _joint(values, "joint")
        return both, both
    if "joint.bottom.kRx_Nm_per_rad" in values:
        return _joint(values, "joint.bottom"), _joint(values, "joint.top")
    return None


def _joint(values: Values, prefix: str) -> Joint:
    """Return the joint whose parameters begin with the prefix; unnamed stiffnesses are rigid."""
    names = ("kx_N_per_um", "ky_N_per_um", "kz_N_per_um", "kRx_Nm_per_rad", "kRy_Nm_per_rad", "kRz_Nm_per_rad")
    full = (f"{prefix}.{name}" for name in names)
    k = np.array([si(values, name) if name in values else RIGID for name in full])
    c, cR = values[f"{prefix}.c_N_s_per_m"], values[f"{prefix}.cR_Nm_s_per_rad"]
    return Joint(
        k=k,
        c=np.array([c, c, c, cR, cR, cR]),
        arm=si(values, f"{prefix}.length_mm") / 2.0,
        half_mass=values[f"{prefix}.mass_kg"] / 2.0,
        half_inertia=values[f"{prefix}.half_inertia_kg_m2"],
        half_arm=si(values, f"{prefix}.half_arm_mm"),
    )


def encoder_of(values: Values) -> Encoder | None:
    """Return the encoder that a model's values describe; None without one."""
    if "encoder.head_mass_kg" not in values:
        return None
    return Encoder(
        head_mass=values["encoder.head_mass_kg"],
        ruler_mass=values["encoder.ruler_mass_kg"],
        com=_vector(values, "encoder.com_{}_mm"),
        inertia=_vector(values, "encoder.inertia_{}_kg_m2"),
        arm=_arm(values, "arm"),
        ruler_arm=_arm(values, "ruler_arm"),
    )


def _arm(values: Values, which: str) -> Array:
    """Return the reading point (2,) [m] of `which`: that of the head, unless the file names another."""
    names = (f"encoder.{which}_{axis}_mm" for axis in "xy")
    heads = (f"encoder.arm_{axis}_mm" for axis in "xy")
    return np.array([si(values, own if own in values else head) for own, head in zip(names, heads, strict=True)])


def bench_of(values: Values, held: bool) -> Bench:
    """Return the bench that a model's values describe, with the payload held or free."""
    return Bench(values["bench.payload_kg"], values["bench.guide_damping_N_s_per_m"], held)


def offset_of(values: Values) -> Array:
    """Return the offset (3,) [m] of the line of force from the joints' axis: the APA's, plus the force's from its
    middle."""
    lopsided = [si(values, f"apa.lopsided_{axis}_um") for axis in "xy"]
    offset: Array = _vector(values, "misalignment.d{}_um") + np.array([*lopsided, 0.0])
    return offset


def _vector(values: Values, pattern: str) -> Array:
    return np.array([si(values, pattern.format(axis)) for axis in "xyz"])
