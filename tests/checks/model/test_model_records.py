"""The model against struts recorded on an independent bench simulation, all parameters and effects being known.

This is the check of signs, layout and units: another author's time-domain simulation, another estimator (scipy).
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from checks.fitting.constants import fit_constants, seed_constants
from checks.gap import with_effects
from checks.model.model import Model
from tests.checks.model.units_model import measured, nominal_model, true_values
from tests.shared.recorded_units import RecordedUnits

SERIALS = ("S-01", "S-02", "S-03", "S-04", "S-05", "S-06")
SEGMENTS = 39  # of 1 s with half overlap in 20 s


def as_recorded(truth: Mapping[str, Any]) -> Model:
    """The bench simulations integrate modes, each with its own damping."""
    model = replace(nominal_model(), damping="modal").with_values(true_values(truth))
    return with_effects(model, list(truth["effects"].items()))


def outside(truth: Mapping[str, Any], channel: str, f: np.ndarray) -> np.ndarray:
    """What truth.json says was put in that no effect of the library is."""
    what = truth.get("outside_the_library")
    if what is None or channel != "Vs":
        return np.ones(f.size)
    x = 1j * f / what["f_Hz"]
    return 1 + what["ratio"] / (x * x + 2 * what["damping_ratio"] * x + 1)


def clean(f: np.ndarray, coherence: np.ndarray, lo: float, hi: float) -> np.ndarray:
    """Bins that leakage leaves alone: at sharp peaks and zeros a window of 1 s costs coherence."""
    return (f > lo) & (f < hi) & (coherence > 0.998)


@pytest.mark.parametrize("serial", SERIALS)
@pytest.mark.parametrize(("record", "lo", "hi"), [("frf_noise", 12.0, 345.0), ("frf_noise_hf", 355.0, 1900.0)])
def test_agrees_with_the_record(serial: str, record: str, lo: float, hi: float, recorded_units: RecordedUnits) -> None:
    f, H, coherence = measured(recorded_units.folder(serial), record)
    truth = recorded_units.truth(serial)
    model = as_recorded(truth)
    for channel in ("Vs", "de", "da"):
        good = clean(f, coherence[channel], lo, hi)
        ratio = H[channel][good] / model.frf(f[good], channels=(channel,))[:, 0] / outside(truth, channel, f[good])
        assert good.sum() > 30
        # coherence 0.998 over 39 segments: 0.5 % per bin at worst, the median far below
        assert abs(np.median(ratio.real) - 1) < 0.003
        assert abs(np.median(ratio.imag)) < 0.003
        assert np.percentile(np.abs(ratio - 1), 95) < 0.02


@pytest.mark.parametrize("wrong", ["misalignment.dx_um", "misalignment.dy_um", "encoder.arm_x_mm", "encoder.com_y_mm"])
def test_a_turned_sign_would_show(wrong: str, recorded_units: RecordedUnits) -> None:
    """S-02 is misaligned along both axes: each sign matters in de, so the agreement above is no accident."""
    f, H, coherence = measured(recorded_units.folder("S-02"), "frf_noise")
    model = as_recorded(recorded_units.truth("S-02"))
    good = clean(f, coherence["de"], 12.0, 345.0)
    turned = model.frf(f[good], {wrong: -model.values[wrong]}, ("de",))[:, 0]
    assert np.percentile(np.abs(H["de"][good] / turned - 1), 95) > 0.05


@pytest.mark.parametrize("serial", ["S-01", "S-02", "S-03", "S-04"])  # S-05 and S-06 have an effect on Vs
def test_constants(serial: str, recorded_units: RecordedUnits) -> None:
    truth = recorded_units.truth(serial)
    model, true = as_recorded(truth), true_values(truth)
    f, H, coherence = merged(recorded_units.folder(serial))
    variance = {c: np.abs(H[c]) ** 2 * (1 - coherence[c]) / coherence[c] / (SEGMENTS - 5) for c in H}
    fit = fit_constants(model, f, H, variance)
    for name in ("ga_N_per_V", "gs_V_per_m"):
        assert fit[name].value == pytest.approx(true[f"constants.{name}"], rel=2e-3)  # 16 bit converters, 1 s windows
        assert fit[name].lo < fit[name].value < fit[name].hi
    by_seed = seed_constants(model, f, H["de"], H["Vs"])
    # [STB] 4.2.3 takes the static gain for that at 10..20 Hz (3 % more) and the gain at 1 kHz for that at 400..500 Hz.
    assert by_seed["ga_N_per_V"] == pytest.approx(true["constants.ga_N_per_V"], rel=0.05)
    assert by_seed["gs_V_per_m"] == pytest.approx(true["constants.gs_V_per_m"], rel=0.05)


def merged(folder: Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    f, H, coherence = measured(folder, "frf_noise")
    _, H_high, coherence_high = measured(folder, "frf_noise_hf")
    low = f <= 350
    pick = {c: np.where(low, H[c], H_high[c]) for c in H}
    return f, pick, {c: np.where(low, coherence[c], coherence_high[c]) for c in H}
