"""Struts with drawn parameters and misalignment, seen with the noise of the recorded units, for tests."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from accept.models.model_file import open_model
from checks.fitting import Dataset
from checks.fitting.dataset import simulated
from checks.misalignment.table import MisalignmentTable, grid, table_frequencies
from checks.model import Model
from checks.model.parameters import is_mode_factor
from tests.checks.model.units_model import NOMINAL

F = np.arange(10.2, 1000.0, 0.85)  # bins of 20 s records, one window in 17 bins
CHANNELS = ("de", "da")


def noise_m_per_V(f: np.ndarray) -> np.ndarray:
    """Standard deviation of de and da as recorded on the struts: the drive fades towards the merging frequency."""
    return np.where(f <= 350.0, 8e-9 * (1.0 + 0.7 * (f / 350.0) ** 6), 2.4e-9)


@dataclass(frozen=True, eq=False)
class Drawn:
    """A strut: its true misalignment [um] and two realisations of its responses."""

    dx: float
    dy: float
    first: Dataset
    second: Dataset


def draw(model: Model, seed: int, dx_max: float = 100.0, dy_max: float = 350.0) -> Drawn:
    """A strut with every uncertain parameter of the model but its modes drawn from its prior, its damping of either
    form, behind an amplifier and a delay."""
    rng = np.random.default_rng(seed)
    dx, dy = rng.uniform(-dx_max, dx_max), rng.uniform(-dy_max, dy_max)
    sds = {n: sd for n, sd in model.sds.items() if not is_mode_factor(n)}
    values = {n: abs(rng.normal(model.values[n], sd)) * np.sign(model.values[n]) for n, sd in sds.items()}
    values |= {"misalignment.dx_um": dx, "misalignment.dy_um": dy}
    values |= {"amplifier.f_Hz": rng.uniform(3e3, 2e4), "delay.tau_us": rng.uniform(0.0, 200.0)}
    strut = replace(model, damping=str(rng.choice(["full", "modal"])))
    H = strut.frf(F, values, CHANNELS)
    return Drawn(dx, dy, *(seen(H, rng) for _ in range(2)))


def seen(H: np.ndarray, rng: np.random.Generator) -> Dataset:
    """Responses (F, 2) with noise."""
    cov = noise_m_per_V(F)[:, None, None] ** 2 * np.eye(2)
    return simulated(F, H, CHANNELS, cov.astype(complex), rng)


def table_of(model: Model, nx: int = 21, ny: int = 21) -> MisalignmentTable:
    """A small table, in memory."""
    f, (dx, dy) = table_frequencies(), grid(model, nx, ny)
    return MisalignmentTable(
        dx, dy, f, np.array([MisalignmentTable.row(model, x, dy, f) for x in dx]), model.name, model.sha256
    )


@lru_cache
def builtin() -> Model:
    return open_model("strut-as-built")


@lru_cache
def exact() -> Model:
    """Of the finite-element matrices."""
    return open_model(NOMINAL)


def sharp() -> Model:
    """The built-in model as one that is right to 1 % and knows its modes: for data that are its own."""
    return replace(builtin(), sds={n: sd for n, sd in builtin().sds.items() if not is_mode_factor(n)})


@lru_cache
def small_table(of: str) -> MisalignmentTable:
    """Of "builtin" or "exact"."""
    model = {"builtin": builtin, "exact": exact}[of]()
    return table_of(replace(model, damping="modal"), 11, 13)
