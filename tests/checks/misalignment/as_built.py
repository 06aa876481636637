"""Struts that scatter as real ones do, by the independent generator of `validation`, seen with the noise of the
recorded units: for proofs of what the misalignment says of them."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from accept.models.model_file import open_model
from checks.fitting import Dataset
from checks.fitting.dataset import simulated
from checks.misalignment.table import MisalignmentTable
from checks.model import Model
from tests.checks.misalignment.misaligned import noise_m_per_V, table_of
from validation.model_files import write_model
from validation.sets import SETS
from validation.shell import draw_bias, draw_shell
from validation.strut import draw, plant

F = np.arange(10.2, 750.0, 0.85)
CHANNELS = ("Vs", "de", "da")
PLANTS = (2, 0, 1)  # its order is de, da, Vs
NOISE_V = 2e-4  # of Vs, per volt
DAMPING = 0.2


@dataclass(frozen=True, eq=False)
class AsBuilt:
    """A strut with its true misalignment [um] and two realisations of its responses."""

    dx: float
    dy: float
    first: Dataset
    second: Dataset


def strut(
    rng: np.random.Generator, scatter: float, at_um: tuple[float, float], bias: float = 0.0, beside_mm: float = 0.0
) -> AsBuilt:
    """A strut of a frequency scatter, its modes off by a bias besides, its ruler read beside its head."""
    common = draw_bias(np.random.default_rng(4), bias) if bias else None
    drawn = replace(draw(rng), dx=1e-6 * at_um[0], dy=1e-6 * at_um[1], built=draw_shell(rng, scatter, DAMPING, common))
    drawn = replace(drawn, ruler_x=drawn.arm_x, ruler_y=drawn.arm_y + 1e-3 * beside_mm)
    drive = np.exp(-2j * np.pi * F * rng.uniform(0.0, 200e-6)) / (1.0 + 1j * F / rng.uniform(3e3, 2e4))
    H = (plant(drawn).at(2j * np.pi * F)[list(PLANTS)] * drive).T
    return AsBuilt(*at_um, *(measured(H, rng) for _ in range(2)))


def measured(H: np.ndarray, rng: np.random.Generator) -> Dataset:
    sd = np.array([np.full(F.size, NOISE_V), noise_m_per_V(F), noise_m_per_V(F)]).T
    return simulated(F, H, CHANNELS, (sd[:, :, None] * sd[:, None, :] * np.eye(3)).astype(complex), rng)


@lru_cache
def stated(scatter: float, beside: bool = False) -> tuple[Model, MisalignmentTable]:
    """The recorded units' model file with its modes uncertain, and a small table of it."""
    it = replace(SETS["scatter-1"], stated=scatter, beside=beside)
    with TemporaryDirectory() as folder:
        model = open_model(write_model(it, Path(folder)))
    return model, table_of(replace(model, damping="modal"), 9, 13)
