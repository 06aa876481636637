"""Datasets for tests of the gap workflow, drawn in the frequency domain: quick, with noise and truth that are known."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from accept.models.model_file import open_model
from checks.fitting import Dataset
from checks.gap.effects import EFFECTS, with_effects
from checks.gap.workflow import Inputs
from checks.model import Model
from tests.soak import SOAK

F = np.geomspace(8.0, 1900.0, 350)
CHANNELS = ("Vs", "de", "da")
FS = 1e4
# V and m per volt of Va: a tenth of the tolerance to ten times it, as in the recorded struts
NOISE = np.array([2e-3, 3e-9, 3e-9])
TOLERANCE = 0.01


@cache
def strut() -> Model:
    return open_model("strut")


def drawn(seed: int) -> Model:
    """The built-in strut with every uncertain value drawn from its prior."""
    rng = np.random.default_rng(seed)
    model = strut()
    prior = model.calibrated
    values = prior.values + prior.sds * np.clip(rng.standard_normal(len(prior.names)), -2.0, 2.0)
    values = np.where(prior.values > 0, np.maximum(values, 0.1 * prior.values), values)
    return model.with_values(dict(zip(prior.names, values.tolist(), strict=True)))


def recorded(model: Model, seed: int, effects: Mapping[str, Mapping[str, float]] | None = None) -> Dataset:
    """One realisation of a model's responses with effects in it, or multiplied by their factors."""
    hidden = list((effects or {}).items())
    H = with_effects(model, [each for each in hidden if EFFECTS[each[0]].factor is None]).frf(F, channels=CHANNELS)
    for name, values in hidden:
        if (factor := EFFECTS[name].factor) is not None:
            H[:, [CHANNELS.index(c) for c in EFFECTS[name].channels]] *= factor(values, 2j * np.pi * F)[:, None]
    rng = np.random.default_rng([seed, 7])
    noise = (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2.0) * NOISE
    cov = np.broadcast_to(np.diag(NOISE**2).astype(complex), (F.size, 3, 3)).copy()
    return Dataset(F, H + noise, CHANNELS, cov, np.full(F.size, 30.0), TOLERANCE, f"drawn {seed}")


def inputs(
    seed: int, effects: Mapping[str, Mapping[str, float]] | None = None, without: tuple[str, ...] = ()
) -> Inputs:
    """Two realisations of a drawn strut, and the built-in model to start from, with a tolerance of 1 %."""
    truth = drawn(seed)
    model = replace(strut(), tolerance=TOLERANCE)
    A, B = recorded(truth, 2 * seed, effects), recorded(truth, 2 * seed + 1, effects)
    return Inputs(model=model, A=A, B=B, fs=FS, without=frozenset(without))


def fewer(given: Inputs) -> Inputs:
    """With 150 bins, in the heavy lane with all: for searches of what is far above noise that do not end by their
    budget, which with fewer bins lasts longer."""
    return given if SOAK else replace(given, A=given.A.thinned(150), B=given.B.thinned(150))
