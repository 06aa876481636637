"""The parameters of a model, each declared once: its key in a model file, its default, its bounds, the step of its
derivative, and what it acts on. Its flat name is its section and key, `sensor.pickup_us`; its unit ends the key."""

import math
from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from enum import Flag, auto
from typing import Any

CHANNELS = ("Vs", "de", "da")


class Acts(Flag):
    """What a parameter acts on, for derivatives: they are kept where the rest did not change."""

    IN_MECHANICS = 0  # on the matrices, in any way
    ON_MEASUREMENT = auto()  # on what is driven and measured, and not on the modes
    IN_PROPORTION = auto()  # stiffness, damping and mass matrices, or the reading of the motion, are proportional to it
    ON_THE_AXIS = auto()  # in proportion, but an offset is its lever
    OFFSET = auto()  # of the line of force
    TURNS_TIES = auto()  # where a rigid direction runs


SEEN, SCALES, OFFSET, TIES = Acts.ON_MEASUREMENT, Acts.IN_PROPORTION, Acts.OFFSET | Acts.TURNS_TIES, Acts.TURNS_TIES
ALONG = SCALES | Acts.ON_THE_AXIS


@dataclass(frozen=True)
class ModelParameter:
    """A number of a section of a model file.

    section: of the file, or the kind of APA that has it. default: its value if a file does not state it. needed: a file
    must state it; without either a file may leave it out, and `off` is then its value, None for none. lo, hi: bounds,
    lo excluded when `open`. step: of a derivative, absolute; None: a part of the value. each: a file states one number
    for each of these, in a list if they are axes. doc: what its name does not say.
    """

    section: str
    key: str
    default: float | None = None
    doc: str = ""
    _: KW_ONLY
    needed: bool = False
    off: float | None = None
    lo: float = 0.0
    hi: float = math.inf
    open: bool = False
    step: float | None = None
    acts: Acts = Acts.IN_MECHANICS
    each: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the last part of its flat names: `com_x_mm` and more of `com_mm`, `latency_Vs_us` of `latency_us`."""
        head, _, unit = self.key.partition("_")
        return tuple(f"{head}_{one}_{unit}" for one in self.each) or (self.key,)


def _free(section: str, key: str, default: float | None = None, doc: str = "", **more: Any) -> ModelParameter:
    """Return a parameter of either sign."""
    return ModelParameter(section, key, default, doc, **{"lo": -math.inf, **more})


def _above(section: str, key: str, default: float | None = None, doc: str = "", **more: Any) -> ModelParameter:
    """Return a parameter that is above zero."""
    return ModelParameter(section, key, default, doc, open=True, **more)


XYZ = ("x", "y", "z")
AMOUNT: dict[str, Any] = {"lo": -0.9, "hi": 10.0, "step": 1e-4, "acts": SCALES}
LATERAL: dict[str, Any] = {"lo": -5000.0, "hi": 5000.0, "step": 0.1, "acts": OFFSET}
LAG: dict[str, Any] = {"lo": -1e4, "hi": 1e5, "step": 0.01, "acts": SEEN}

PARAMETERS: tuple[ModelParameter, ...] = (
    ModelParameter("apa", "sensor_stiffening", 0.0, "by an open circuit, as a part of the stack's stiffness", **AMOUNT),
    ModelParameter("apa", "actuator_stiffening", 0.0, "as the sensor's", **AMOUNT),
    *(_free("apa", f"lopsided_{axis}_um", 0.0, "where it pushes, beside its middle", **LATERAL) for axis in "xy"),
    ModelParameter("apa of modes", "damping_ratio", 0.01, hi=0.5, acts=SCALES),
    _above("2dof", "k_N_per_um", 0.38, "[STB] 7.3, as all of this section"),
    _above("2dof", "ke_N_per_um", 1.75),
    _above("2dof", "ka_N_per_um", 30.0),
    ModelParameter("2dof", "c_N_s_per_m", 30.0, step=1e-2, acts=ALONG),
    ModelParameter("2dof", "ce_N_s_per_m", 20.0, step=1e-2),
    ModelParameter("2dof", "ca_N_s_per_m", 20.0, step=1e-2),
    ModelParameter("2dof", "height_mm", 30.0, step=1e-3, acts=TIES),
    *(_above("joint", f"kR{axis}_Nm_per_rad", needed=True, acts=SCALES) for axis in "xy"),
    _above("joint", "kRz_Nm_per_rad", acts=SCALES),
    *(_above("joint", f"k{axis}_N_per_um", acts=ALONG) for axis in "zxy"),
    ModelParameter("joint", "c_N_s_per_m", 10.0, step=1e-2, acts=ALONG),
    ModelParameter("joint", "cR_Nm_s_per_rad", 0.001, step=1e-6, acts=SCALES),
    ModelParameter("joint", "length_mm", 25.5, step=1e-3, acts=TIES),
    ModelParameter("joint", "mass_kg", 0.0292, step=1e-5),
    ModelParameter("joint", "half_inertia_kg_m2", 1e-6),
    _free("joint", "half_arm_mm", 6.4, step=1e-3),
    ModelParameter("encoder", "head_mass_kg", needed=True, step=1e-5, acts=SCALES),
    ModelParameter("encoder", "ruler_mass_kg", needed=True, step=1e-5, acts=SCALES),
    _free("encoder", "com_mm", needed=True, step=1e-3, each=XYZ),
    ModelParameter("encoder", "inertia_kg_m2", needed=True, each=XYZ),
    *(_free("encoder", f"arm_{axis}_mm", needed=True, step=1e-3, acts=SCALES) for axis in "xy"),
    *(_free("encoder", f"ruler_arm_{axis}_mm", doc="else at the head", step=1e-3, acts=SCALES) for axis in "xy"),
    ModelParameter("encoder", "scale", 0.0, lo=-1.0, step=1e-5, acts=SEEN),
    _above("encoder", "bracket_Hz", off=math.inf, acts=SEEN),
    ModelParameter("encoder", "bracket_damping_ratio", 0.01, hi=1.0, acts=SEEN),
    _above("bench", "payload_kg", needed=True, acts=SCALES),
    ModelParameter("bench", "guide_damping_N_s_per_m", 0.0, step=1e-2, acts=SCALES),
    _above("bench", "mode_Hz", 100.0, "of the bench, which de and da see alike", acts=SEEN),
    _free("bench", "mode_ratio", 0.0, step=1e-5, acts=SEEN),
    ModelParameter("bench", "mode_damping_ratio", 0.01, hi=1.0, acts=SEEN),
    _above("bench", "support_mode_Hz", 400.0, "of a guide or support that gives way", acts=SEEN),
    ModelParameter("bench", "support_mode_damping_ratio", 0.01, hi=1.0, acts=SEEN),
    *(_free("bench", f"support_mode_ratio_{c}", 0.0, "of the static response", step=1e-5, acts=SEEN) for c in CHANNELS),
    ModelParameter("bench", "latency_us", doc="against Va", off=0.0, each=CHANNELS, **LAG),
    _above("bench", "lowpass_Hz", doc="Butterworth, before the converter", off=math.inf, acts=SEEN, each=CHANNELS),
    ModelParameter("bench", "lowpass_order", off=2.0, lo=1.0, hi=8.0, acts=SEEN, each=CHANNELS),
    _above("constants", "amplifier_gain", 20.0, acts=SEEN),
    _free("constants", "ga_N_per_V", needed=True, acts=SEEN),
    _free("constants", "gs_V_per_m", doc="per elongation of the sensor stack", acts=SEEN),
    _free("constants", "gs_V_per_N", doc="per newton in ke of a 2-DoF APA", acts=SEEN),
    *(_free("misalignment", f"d{axis}_um", 0.0, "of the APA from the axis of the joints", **LATERAL) for axis in "xyz"),
    ModelParameter("delay", "tau_us", 0.0, "of the whole path from DAC to ADC", **LAG),
    _above("amplifier", "f_Hz", doc="bandwidth of first order", off=math.inf, acts=SEEN),
    _above("amplifier", "second_order_Hz", doc="bandwidth of second order", off=math.inf, acts=SEEN),
    ModelParameter("amplifier", "second_order_damping_ratio", 0.7, hi=0.999, open=True, acts=SEEN),
    ModelParameter("sensor", "highpass_Hz", 0.0, step=1e-4, acts=SEEN),
    ModelParameter("sensor", "charge_highpass_Hz", 0.0, "of second order: a charge amplifier's", step=1e-4, acts=SEEN),
    ModelParameter("sensor", "charge_highpass_damping_ratio", 0.7, hi=0.999, open=True, acts=SEEN),
    _free("sensor", "crosstalk_V_per_V", 0.0, step=1e-6, acts=SEEN),
    _free("sensor", "pickup_us", 0.0, "volts for each volt per us of the amplifier's output", step=1e-3, acts=SEEN),
    # of elements, whose section is `element.<place>.<direction>`
    *(_free("element", f"spring_{unit}", step=1e-3) for unit in ("N_per_um", "Nm_per_rad")),
    *(_free("element", f"damper_{unit}", step=1e-4) for unit in ("N_s_per_m", "Nm_s_per_rad")),
    *(_free("element", f"added_{unit}", step=1e-6) for unit in ("kg", "kg_m2")),
    *(_above("element", f"hung_{unit}") for unit in ("kg", "kg_m2", "Hz")),
    ModelParameter("element", "hung_damping_ratio", hi=1.0, step=1e-5),
    *(_free("element", f"point_{axis}_mm", step=1e-3) for axis in "xy"),
    _free("element", "read_share", 1.0, "of a payload that rocks: da is read there, 0 at its centre, 1 on the axis"),
)


def of_section(*sections: str) -> Iterator[ModelParameter]:
    """Yield the parameters of one section after the other."""
    return (p for section in sections for p in PARAMETERS if p.section == section)


def off_values(*sections: str) -> dict[str, float]:
    """Return the values at which what a file leaves out has no effect, by flat name."""
    return {f"{p.section}.{key}": p.off for p in of_section(*sections) if p.off is not None for key in p.keys}
