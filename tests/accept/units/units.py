"""Small unit folders for tests."""

from pathlib import Path
from zlib import crc32

import numpy as np

DATA = Path(__file__).parents[4] / "shared" / "data"

GOOD = """
serial = "{serial}"
kind = "apa"
[flatness]
z_um = [0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46]
[capacitance]
sensor_uF = 5.10
actuator_uF = 10.03
[stroke]
stroke_um = 373.2
[stiffness]
k_N_per_um = 1.70
"""

LOOPS = """
name = "loops"
kind = "apa"
title = "Loops"
[checks.capacitance.limits.sensor_uF]
lower = 4.4
unit = "uF"
rule = "simple"
source = "test"
[checks.capacitance.uncertainty.sensor_uF]
U = 0.01
source = "test"
[checks.hysteresis.limits.hysteresis_percent]
upper = 20.0
unit = "percent"
rule = "guarded"
source = "test"
"""  # a spec of one recorded check
DRIVE = np.concatenate([a * np.sin(2 * np.pi * np.arange(3000) / 1000) for a in (0.5, 4.0)])  # of its record


def make_unit(folder: Path, serial: str = "T-01", text: str = GOOD, **replaced: str) -> Path:
    """Write a unit folder; `replaced`: pieces of the good text by what stands instead, keyed by any name. A stroke of
    its own for each serial: readings that are all another unit's are a copy."""
    folder.mkdir(parents=True, exist_ok=True)
    if serial != "T-01":
        text = text.replace("stroke_um = 373.2", f"stroke_um = 373.2000{crc32(serial.encode()) % 10**6:06d}")
    (folder / "unit.toml").write_text(text.replace("{serial}", serial))
    return folder


def save_mat(path: Path, **arrays: object) -> None:
    from scipy.io import savemat

    savemat(path, {k: np.asarray(v, dtype=float).reshape(-1, 1) for k, v in arrays.items()})
