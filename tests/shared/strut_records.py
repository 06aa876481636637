"""Records of the built-in strut under band-limited noise, sampled exactly: every mode, delay and gain is known."""

from collections.abc import Mapping
from functools import cache

import numpy as np
from scipy import signal

from accept.models.model_file import open_model
from checks.model import Fractions
from checks.model.time.partial_fractions import paths
from checks.record import Record

FS, SECONDS = 10_000.0, 12.0
NOISE = {"Vs": 2e-4, "de": 2e-9, "da": 2e-9}  # V and m, as on the recorded benches
UNITS = {"Va": "V", "Vs": "V", "de": "m", "da": "m"}


@cache
def _paths() -> Mapping[str, Fractions]:
    return paths(open_model("strut"))


def drive(seed: int) -> np.ndarray:
    """0.3 V RMS up to 350 Hz."""
    band = signal.butter(4, 350.0, fs=FS, output="sos")
    u = signal.sosfilt(band, np.random.default_rng(seed).standard_normal(int(FS * SECONDS)))
    return 0.3 * u / np.std(u)


def strut_record(seed: int, faster: float = 1.0, gain: float = 1.0, Va: np.ndarray | None = None) -> Record:
    """faster: factor of every frequency of the strut; gain: of every output."""
    u, rng = drive(seed) if Va is None else Va, np.random.default_rng([seed, 1])
    outputs = {c: gain * _paths()[c].held(u, FS / faster) + n * rng.standard_normal(u.size) for c, n in NOISE.items()}
    return Record(np.arange(u.size) / FS, {"Va": u, **outputs}, UNITS, f"seed {seed}")
