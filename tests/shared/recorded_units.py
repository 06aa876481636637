"""The recorded units or, where they are not beside the repository, units of the same kinds: struts by the blind
generator, sound actuators by `accept simulate`. Each is made once for a run, when a test first asks for it."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from accept.models.model_file import open_model
from accept.simulate import UnitRequest, simulate, write
from accept.simulate.unit_request import on_bench
from accept.units.unit_folder import UNIT_FILE
from tests.shared.once import once
from validation import strut as struts
from validation.bench import Setting, World, write_unit
from validation.effects import LIBRARY, OUTSIDE

UNITS = Path(__file__).parents[3] / "shared" / "data" / "units"
SEED = 50
EFFECTS: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    "S-01": {},
    "S-02": {"misalignment": {"dx_um": 50.0, "dy_um": 210.0}},
    "S-03": {"amplifier_bandwidth": {"f_Hz": 3900.0}},
    "S-04": {"bench_mode": {"f_Hz": 110.0, "ratio": 0.03, "damping_ratio": 0.014}},
    "S-05": {"misalignment": {"dx_um": 10.0, "dy_um": -110.0}, "sensor_highpass": {"f_Hz": 3.9}},
    "S-06": {},
}
BESIDE = {"S-06": {"f_Hz": 750.0, "ratio": 0.033, "damping_ratio": 0.01}}  # a resonance of Vs that no library has
NOMINAL = {  # key of truth.json -> field of Strut, factor from SI
    "kz_N_per_um": ("kz", 1e-6), "kR_Nm_per_rad": ("kRx", 1.0), "kRz_Nm_per_rad": ("kRz", 1.0), "cR": ("cR", 1.0),
    "payload_kg": ("payload", 1.0), "head_mass_kg": ("head", 1.0), "ruler_mass_kg": ("ruler", 1.0),
    "guide_damping": ("guide", 1.0), "damping_ratio": ("zeta", 1.0), "ga_N_per_V": ("ga", 1.0),
    "gs_V_per_m": ("gs", 1.0),
}  # fmt: skip
FIGURES = {  # key of truth.json -> that of a simulated actuator
    "k_closed": "k_closed_N_per_um", "k_open": "k_open_N_per_um", "fc_Hz": "sensor_highpass_Hz", "modes_Hz": "modes_Hz",
    "stroke_um": "stroke_um", "flatness_um": "flatness_um", "sensor_uF": "sensor_uF", "actuator_uF": "actuator_uF",
}  # fmt: skip
AXIAL = 2  # of a simulated actuator's modes: what was recorded has bending in x and y, and torsion


@dataclass(frozen=True)
class RecordedUnits:
    """Unit folders and what is true of them, in the form of the recorded truth.json."""

    folders: pytest.TempPathFactory

    def folder(self, serial: str) -> Path:
        """Return the folder of a unit. Nothing may be written there."""
        return UNITS / serial if UNITS.is_dir() else self._made(serial)[0]

    def truth(self, serial: str) -> dict[str, Any]:
        if UNITS.is_dir():
            return json.loads((UNITS / "truth.json").read_text())[serial]
        return self._made(serial)[1]

    def _made(self, serial: str) -> tuple[Path, dict[str, Any]]:
        return once(self.folders, serial, lambda place: (_strut if serial in EFFECTS else _apa)(place / serial, serial))


@pytest.fixture(scope="session")
def recorded_units(tmp_path_factory: pytest.TempPathFactory) -> RecordedUnits:
    return RecordedUnits(tmp_path_factory)


def _strut(folder: Path, serial: str) -> tuple[Path, dict[str, Any]]:
    """Write a strut whose parts scatter as its model file says; its modes are damped one by one."""
    seed = int(serial[-2:])
    drawn = struts.draw(np.random.default_rng([SEED, seed]))
    world = World(replace(drawn, kRy=drawn.kRx, modal=True))
    nominal = {key: factor * asdict(world.strut)[field] for key, (field, factor) in NOMINAL.items()}
    nominal["arm_mm"] = [1e3 * world.strut.arm_x, 1e3 * world.strut.arm_y]
    truth = {"kind": "strut", "effects": EFFECTS[serial], "nominal": nominal}
    for name, parameters in EFFECTS[serial].items():
        world = LIBRARY[name].add(world, parameters)
    if beside := BESIDE.get(serial):
        world = OUTSIDE["channel_resonance"].add(world, {**beside, "channel": 2.0})
        truth["outside_the_library"] = beside
    return write_unit(folder, serial, world, Setting(), seed), truth


def _apa(folder: Path, serial: str) -> tuple[Path, dict[str, Any]]:
    """Write a sound actuator, without the mark of a simulated unit, as it stands for a measured one."""
    made = simulate(UnitRequest(serial, "apa", on_bench(open_model("apa-frame"), "apa"), int(serial[-2:])))
    unmarked = made.files[UNIT_FILE].replace(b"simulated = true\n", b"")
    truth = {key: made.truth["figures"][name] for key, name in FIGURES.items()}
    truth["modes_Hz"] = [f for n, f in enumerate(truth["modes_Hz"]) if n != AXIAL]
    return write(replace(made, files={**made.files, UNIT_FILE: unmarked}), folder), truth
