"""Struts of a learned batch whose units are misaligned alike: the gap names none for it, and the one that lies off."""

from dataclasses import replace

import numpy as np
import pytest

from checks.gap.decision.result import EXPLAINED, NO_MISSING, Result
from checks.gap.workflow import Inputs, run
from checks.model import Model
from checks.model.joint_prior import JointPrior
from tests.checks.gap.shared.gap_cases import FS, TOLERANCE, drawn, recorded, strut

DX, DY = "misalignment.dx_um", "misalignment.dy_um"
COMMON = {DX: -39.0, DY: 61.0}
SCATTER = {DX: 6.0, DY: 10.0}


def learned() -> Model:
    """The built-in strut as a batch would be learned that lies where its file says, but for the misalignment."""
    model = replace(strut(), tolerance=TOLERANCE)
    values, sds = {**model.values, **COMMON}, {**model.sds, **SCATTER}
    joint = JointPrior(tuple(sds), np.array([values[n] for n in sds]), np.diag([sd**2 for sd in sds.values()]))
    return replace(model, values=values, sds=sds, joint=joint)


def analysed(model: Model, dx: float, dy: float) -> Result:
    truth = drawn(5).with_values({DX: dx, DY: dy})
    return run(Inputs(model=model, A=recorded(truth, 10), B=recorded(truth, 11), fs=FS), lambda _: None)


@pytest.mark.parametrize("away", [0.0, 1.0])
def test_what_a_batch_has_in_common_is_no_name_of_a_unit(away: float) -> None:
    """Nor is a unit that lies one scatter off it. Red before: "misaligned by (-39, 61) um" in every unit."""
    found = analysed(learned(), *(COMMON[n] + away * SCATTER[n] for n in COMMON))
    assert (found.verdict, found.named) == (NO_MISSING, ())
    alone = analysed(replace(strut(), tolerance=TOLERANCE), *COMMON.values())
    assert [n.effect for n in alone.named] == ["misalignment"]


def test_a_unit_off_its_batch_is_named_with_the_common_part_in_its_interval() -> None:
    """The common part may be the model's own error, which no record of a unit shows."""
    truth = {"dx_um": COMMON[DX] + 70.0, "dy_um": COMMON[DY] - 150.0}
    found = analysed(learned(), *truth.values())
    assert found.verdict == EXPLAINED
    (named,) = found.named
    for (name, value), common in zip(truth.items(), COMMON.values(), strict=True):
        given = named.parameters[name]
        assert given.lo < value < given.hi
        assert given.lo < value - common < given.hi
