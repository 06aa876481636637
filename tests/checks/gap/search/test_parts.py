"""Parts that are not what they were, by the independent generator: calibrated values explain them, and must not pass
for an agreement where they leave what a part may have."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.gap.decision.result import NO_MISSING, Result
from checks.gap.workflow import Inputs, run
from tests.checks.misalignment.as_built import PLANTS, F, measured
from validation.shell import draw_shell
from validation.strut import Attached, Strut, nominal, plant

MEASURED = {"constants.ga_N_per_V": 0.6, "bench.payload_kg": 0.003}  # by capacitance and stroke; on a balance


def half_dead(strut: Strut) -> Strut:
    return replace(strut, dead=0.5)


def stiff_joints(strut: Strut) -> Strut:
    """By a third in bending at either end: another alloy, or glue in the neck."""
    return replace(strut, kRx=1.35 * strut.kRx, kRy=1.35 * strut.kRy)


def clamped(strut: Strut) -> Strut:
    return replace(strut, attached=(Attached("payload", m=0.04),))


def sound(strut: Strut) -> Strut:
    return strut


@cache
def analysed(hide: Callable[[Strut], Strut], seed: int = 1) -> Result:
    rng = np.random.default_rng(seed)
    strut = hide(replace(nominal(), built=draw_shell(rng, 0.01, 0.2)))
    H = plant(strut).at(2j * np.pi * F)[list(PLANTS)].T
    model = open_model("strut-as-built")
    model = replace(model, sds={**model.sds, **MEASURED})
    A, B = (replace(measured(H, rng).band(0.0, model.up_to_Hz), tolerance=model.tolerance) for _ in range(2))
    return run(Inputs(model=model, A=A, B=B, fs=1e4), lambda _: None)


@pytest.mark.parametrize("hide", [half_dead, clamped])
def test_values_that_no_part_has_are_no_agreement(hide: Callable[[Strut], Strut]) -> None:
    found = analysed(hide)
    assert found.verdict != NO_MISSING
    assert any("measure the part" in each.words for each in found.unnamed)


def test_a_sound_strut_of_measured_parts_agrees() -> None:
    assert analysed(sound).verdict == NO_MISSING
