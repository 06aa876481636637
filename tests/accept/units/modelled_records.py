"""Noise records whose answer is a model's, periodic in the record so that no transient is left out."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from checks.model import Model
from hw.records import mat_bytes

FS, SECONDS = 10_000.0, 4.0


def write_answers(
    folder: Path, names: Sequence[str], model: Model, changes: Mapping[str, float], *, seed: int, noise: float,
    late_us: float = 0.0,
) -> None:  # fmt: skip
    """NAME.mat of each: Va of white noise, and every channel of the model. noise: of a channel's own scatter."""
    rng, n = np.random.default_rng(seed), int(FS * SECONDS)
    f = np.fft.rfftfreq(n, 1 / FS)
    H = model.frf(f, changes) * np.exp(-2j * np.pi * f * late_us * 1e-6)[:, None]
    for name in names:
        u = 0.3 * rng.standard_normal(n)  # a drive of 1 V would carry Vs beyond the converter
        channels = {"t": np.arange(n) / FS, "Va": u}
        for c, channel in enumerate(model.channels):
            y = np.fft.irfft(np.fft.rfft(u) * H[:, c], n)
            channels[channel] = y + noise * y.std() * rng.standard_normal(n)
        (folder / f"{name}.mat").write_bytes(mat_bytes(channels))
