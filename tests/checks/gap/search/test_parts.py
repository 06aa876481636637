"""Parts that are not what they were, by the independent generator: calibrated values explain them, and must not pass
for an agreement where they leave what a part may have."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from accept.models.model_file import open_model
from checks.gap.decision.result import NO_MISSING, Result
from checks.gap.workflow import Inputs, run
from tests.checks.misalignment.as_built import PLANTS, F, measured
from validation.shell import draw_shell
from validation.strut import Strut, nominal, plant

MEASURED = {"constants.ga_N_per_V": 0.6, "bench.payload_kg": 0.003}  # by capacitance and stroke; on a balance


def half_dead(strut: Strut) -> Strut:
    return replace(strut, dead=0.5)


@cache
def analysed(hide: Callable[[Strut], Strut], seed: int = 1) -> Result:
    rng = np.random.default_rng(seed)
    strut = hide(replace(nominal(), built=draw_shell(rng, 0.01, 0.2)))
    H = plant(strut).at(2j * np.pi * F)[list(PLANTS)].T
    model = open_model("strut-as-built")
    model = replace(model, sds={**model.sds, **MEASURED})
    A, B = (replace(measured(H, rng).band(0.0, model.up_to_Hz), tolerance=model.tolerance) for _ in range(2))
    return run(Inputs(model=model, A=A, B=B, fs=1e4), lambda _: None)


def test_half_a_dead_stack_is_no_agreement_with_parts_that_were_measured() -> None:
    assert analysed(half_dead).verdict != NO_MISSING
