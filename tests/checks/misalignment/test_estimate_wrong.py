"""Data that are not what they are said to be give no misalignment, never a wrong one: fitted by the model that they
come from and by one that is another, which has more freedom to bend."""

import os
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from checks.cause import Cause, NoResult
from checks.fitting import Dataset
from checks.misalignment.estimate import estimate_misalignment
from tests.checks.misalignment import misaligned
from tests.checks.misalignment.misaligned import draw

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
DRAWS = 15 if SOAK else 1
PAIRS = ["builtin by itself", pytest.param("finite elements by the frame", marks=pytest.mark.takes_data)]


def answer(pair: str, seed: int, wrong: Callable[[Dataset], Dataset], kg: float | None = None) -> Cause | None:
    """Why there is no result from a drawn strut; None when there is one."""
    itself = pair == "builtin by itself"
    source = misaligned.builtin() if itself else misaligned.exact()
    source = source if kg is None else source.with_values({"bench.payload_kg": kg})
    strut = draw(source, seed)
    model = misaligned.sharp() if itself else misaligned.builtin()
    try:
        found = estimate_misalignment(
            model, wrong(strut.first), misaligned.small_table("builtin"), wrong(strut.second)
        ).reason
    except NoResult as e:
        found = e.reason
    return None if found is None else found.cause


def turned(de: float, da: float) -> Callable[[Dataset], Dataset]:
    sign = np.array([de, da])
    return lambda d: replace(d, H=d.H * sign, cov=d.cov * np.outer(sign, sign))


def exchanged(d: Dataset) -> Dataset:
    return replace(d, H=d.H[:, ::-1], cov=d.cov[:, ::-1, ::-1])


def without(lo: float, hi: float) -> Callable[[Dataset], Dataset]:
    return lambda d: d.at((d.f < lo) | (d.f > hi))


def noisy(d: Dataset) -> Dataset:
    """From 150 to 240 Hz nothing but noise, and it is known."""
    inside = (d.f > 150.0) & (d.f < 240.0)
    loud = np.where(inside, 1e6, 1.0)[:, None, None]
    rng = np.random.default_rng(8)
    e = 1e-5 * (rng.standard_normal(d.H.shape) + 1j * rng.standard_normal(d.H.shape))
    return replace(d, H=d.H + e * inside[:, None], cov=d.cov * loud)


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("kg", [5.0, 5.3, 6.1, 6.4, 10.0])
def test_a_wrong_payload(pair: str, kg: float) -> None:
    """Said to be 5.7 kg. A frame whose modes are free could be softened until it rings where the data do."""
    for seed in range(3000, 3000 + DRAWS):
        reason = answer(pair, seed, lambda d: d, kg)
        assert reason in {Cause.AXIAL_STIFFNESS, Cause.MODEL_MISFIT, Cause.PRIOR_EXCEEDED}, seed


_NO_MODEL = {Cause.MODEL_MISFIT, Cause.PRIOR_EXCEEDED, Cause.AXIAL_STIFFNESS, Cause.RATIO_UNKNOWN}


@pytest.mark.parametrize("pair", PAIRS if SOAK else PAIRS[:1])
@pytest.mark.parametrize(
    ("wrong", "causes"),
    [
        (turned(-1.0, 1.0), {Cause.CHANNEL_REVERSED}),
        (turned(1.0, -1.0), {Cause.CHANNEL_REVERSED}),
        (
            turned(-1.0, -1.0),
            {Cause.DRIVE_REVERSED},
        ),  # the ratio is the same, but the drive pushes where it should pull
        (turned(-2.0, -1.0), {Cause.DRIVE_REVERSED, Cause.RATIO_UNKNOWN}),  # twice the noise, too
        (exchanged, _NO_MODEL),  # where de had a zero, da now has one
        (without(10.0, 40.0), {Cause.RATIO_UNKNOWN}),
        (without(60.0, 90.0), {Cause.RATIO_UNKNOWN}),
        (without(150.0, 240.0), {Cause.RATIO_UNKNOWN}),
        (without(270.0, 300.0), {Cause.RATIO_UNKNOWN}),
        (without(300.0, 1100.0), {Cause.RATIO_UNKNOWN}),
        (noisy, {Cause.RATIO_UNKNOWN}),
    ],
)
def test_turned_exchanged_or_missing(pair: str, wrong: Callable[[Dataset], Dataset], causes: set[Cause]) -> None:
    for seed in range(1000, 1000 + DRAWS):
        reason = answer(pair, seed, wrong)
        assert reason in causes, seed
