"""Parts that are not what they were, by the independent generator: calibrated values explain them, and must not pass
for an agreement where they leave what a part may have."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from accept.models.model_file import AS_BUILT, as_weighed, open_model, open_model_file
from checks.gap.calibrate import calibrate, search_on
from checks.gap.decision.build_result import fit_all_bins
from checks.gap.decision.result import NO_MISSING, UNEXPLAINED, Result
from checks.gap.decision.unidentified import all_channels_agree, beyond_parts
from checks.gap.modelling.thresholds import THRESHOLDS
from checks.gap.preparation.inputs import prepare
from checks.gap.search.candidates import Effort
from checks.gap.workflow import Inputs, run
from tests.checks.misalignment.as_built import PLANTS, F, measured
from tests.soak import SOAK
from validation.shell import draw_shell
from validation.strut import Loose, Strut, draw, nominal, plant

Hide = Callable[[Strut], Strut]
# By capacitance and stroke; on a balance; each joint on its own.
MEASURED = {"constants.ga_N_per_V": 0.6, "bench.payload_kg": 0.003, "joint.kz_N_per_um": 2.0}


def half_dead(strut: Strut) -> Strut:
    return replace(strut, dead=0.5)


def stiff_joint(strut: Strut) -> Strut:
    return replace(strut, loose=Loose(1, 1.6, 1.0, 0.0, 0.0))


def clamp(strut: Strut) -> Strut:
    """15 g that were left on the encoder's head."""
    return replace(strut, head=strut.head + 0.015)


def inputs(strut: Strut, sds: Mapping[str, float], rng: np.random.Generator) -> Inputs:
    H = plant(replace(strut, built=draw_shell(rng, 0.01, 0.2))).at(2j * np.pi * F)[list(PLANTS)].T
    model = open_model(AS_BUILT)
    model = replace(model, sds={**model.sds, **sds})
    A, B = (replace(measured(H, rng).band(0.0, model.up_to_Hz), tolerance=model.tolerance) for _ in range(2))
    return Inputs(model=model, A=A, B=B, fs=1e4)


@cache
def analysed(hide: Hide) -> Result:
    return run(inputs(hide(nominal()), MEASURED, np.random.default_rng(1)), lambda _: None)


def said(given: Inputs) -> list[str]:
    """Return what is said of the calibrated values of a unit, if every channel agrees with them."""
    problem = prepare(given, THRESHOLDS)
    base = calibrate(search_on(problem, lambda _: None, Effort(THRESHOLDS.effort)), problem)
    fit, full = fit_all_bins(problem, base)
    return [n.words for n in beyond_parts(full, fit)] if all_channels_agree(full) else []


def test_half_a_dead_stack_is_no_agreement_with_parts_that_were_measured() -> None:
    result = analysed(half_dead)
    assert result.verdict == UNEXPLAINED
    assert not result.named
    assert "actuator constant ga 0.7" in result.unnamed[0].words, result.unnamed[0].words


def test_a_clamp_is_said_although_every_channel_agrees() -> None:
    (words,) = said(inputs(clamp(nominal()), {}, np.random.default_rng(1)))
    assert "head mass 1." in words


def test_one_stiff_joint_is_no_agreement_if_the_joints_were_measured() -> None:
    result = analysed(stiff_joint)
    assert result.verdict != NO_MISSING
    assert {n.effect for n in result.named} <= {"joint_axial_compliance"}
    assert all(e.kind == "joint" for e in result.elements)


@pytest.mark.parametrize("seed", range(10 if SOAK else 3))
def test_a_sound_strut_is_an_agreement(seed: int) -> None:
    rng = np.random.default_rng([seed, 3])
    assert not said(inputs(draw(rng), {}, rng))


@pytest.mark.parametrize("seed", [150, 208])
def test_a_mode_that_was_missed_on_the_way_is_put_in_its_place(seed: int) -> None:
    """Red while it was looked for only where the fit had ended: gains fallen by half hide its peak there, and G of de
    and da is above a thousand."""
    rng = np.random.default_rng(seed)
    problem = prepare(inputs(draw(rng), {}, rng), THRESHOLDS)
    assert calibrate(search_on(problem, lambda _: None, Effort(THRESHOLDS.effort)), problem).adequate


def test_the_payload_of_a_folder_is_as_sure_as_its_uncertainty() -> None:
    weighed = as_weighed(open_model_file(AS_BUILT), "S-01", 5.74, 0.006).model
    assert (weighed.values["bench.payload_kg"], weighed.sds["bench.payload_kg"]) == (5.74, 0.003)
    assert as_weighed(open_model_file(AS_BUILT), "S-01", 5.74).model.sds["bench.payload_kg"] == 0.06
