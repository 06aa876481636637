"""The recorded struts and the matrices behind them, for tests of the model; where they are not beside the repository,
those that stand for them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from scipy import signal

from accept.models.model_file import open_model
from checks.model.model import Model
from validation.model_files import write_model
from validation.sets import SETS
from validation.shell import matrices

ROOT = Path(__file__).parents[3]
DATA = ROOT.parent / "shared" / "data"
APA300ML = matrices()
FLEXOR = DATA / "superelements" / "flexor_025.mat"
RECORDED_MODEL = DATA / "units" / "model.toml"
NOMINAL = RECORDED_MODEL if RECORDED_MODEL.exists() else write_model(SETS["exact"], ROOT / "build" / "blind")

needs_data = pytest.mark.needs_data

# what truth.json calls it -> what the model calls it
TRUTH_NAMES = {
    "kz_N_per_um": ("joint.kz_N_per_um",),
    "kR_Nm_per_rad": ("joint.kRx_Nm_per_rad", "joint.kRy_Nm_per_rad"),
    "kRz_Nm_per_rad": ("joint.kRz_Nm_per_rad",),
    "cR": ("joint.cR_Nm_s_per_rad",),
    "payload_kg": ("bench.payload_kg",),
    "head_mass_kg": ("encoder.head_mass_kg",),
    "ruler_mass_kg": ("encoder.ruler_mass_kg",),
    "guide_damping": ("bench.guide_damping_N_s_per_m",),
    "damping_ratio": ("apa.damping_ratio",),
    "ga_N_per_V": ("constants.ga_N_per_V",),
    "gs_V_per_m": ("constants.gs_V_per_m",),
}
MISALIGNED = ("misalignment", {"dx_um": 15.0, "dy_um": -40.0})
EVERYTHING: list[tuple[str, dict[str, float]]] = [
    MISALIGNED,
    ("sensor_highpass", {"f_Hz": 3.0}),
    ("crosstalk", {"V_per_V": 0.01}),
    ("amplifier_bandwidth", {"f_Hz": 3000.0}),
    ("bench_mode", {"f_Hz": 110.0, "ratio": 0.03, "damping_ratio": 0.01}),
    ("encoder_bracket_mode", {"f_Hz": 800.0, "damping_ratio": 0.01}),
    ("encoder_scale", {"relative": 0.03}),
    ("loop_delay", {"tau_us": 130.0}),
]


def true_values(truth: Mapping[str, Any]) -> dict[str, float]:
    """The model's parameters as they were when a strut was recorded, without its effects."""
    nominal = truth["nominal"]
    arm_x, arm_y = nominal["arm_mm"]
    named = {name: nominal[key] for key, names in TRUTH_NAMES.items() for name in names}
    return named | {"encoder.arm_x_mm": arm_x, "encoder.arm_y_mm": arm_y}


def nominal_model() -> Model:
    return open_model(NOMINAL)


def measured(folder: Path, record: str, nperseg: int = 10_000) -> tuple[np.ndarray, dict[str, np.ndarray], Mapping]:
    """f, channel -> H1, channel -> coherence, by scipy alone: independent of this project's estimators."""
    content = scipy.io.loadmat(folder / f"{record}.mat")
    t, Va = content["t"].ravel(), content["Va"].ravel()
    fs = (t.size - 1) / (t[-1] - t[0])
    f, Suu = signal.welch(Va, fs, nperseg=nperseg)
    H, coherence = {}, {}
    for channel in ("Vs", "de", "da"):
        y = content[channel].ravel()
        H[channel] = signal.csd(Va, y, fs, nperseg=nperseg)[1] / Suu
        coherence[channel] = signal.coherence(Va, y, fs, nperseg=nperseg)[1]
    return f, H, coherence
