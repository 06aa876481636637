"""Where a fit of an effect begins when the calibration without it is far off."""

from dataclasses import replace

import numpy as np
import pytest

from accept.models.model_file import open_model
from checks.fitting.calibrate import quicker
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from checks.gap.modelling.thresholds import THRESHOLDS
from checks.gap.search.candidates import MOVES, Search
from checks.gap.search.explanation import GROSS, Explanation
from checks.model import Model
from tests.checks.gap.shared.gap_cases import recorded


def as_built() -> Model:
    return quicker(replace(open_model("strut-as-built"), tolerance=0.003))


def drawn_as_built(seed: int) -> Model:
    """Every uncertain value from its prior, those of the APA's modes too."""
    rng, model = np.random.default_rng(seed), as_built()
    prior = model.calibrated
    values = prior.values + prior.sds * np.clip(rng.standard_normal(len(prior.names)), -2.0, 2.0)
    return model.with_values(dict(zip(prior.names, values.tolist(), strict=True)))


MORE = [pytest.param(*at, marks=pytest.mark.soak) for at in ((-15.0, 95.0), (30.0, 160.0))]


@pytest.mark.parametrize(("dx_um", "dy_um"), [(-55.0, -130.0), (10.0, 280.0), *MORE])
def test_a_misaligned_strut_is_explained_from_far_away(dx_um: float, dy_um: float) -> None:
    """From the priors, in one round; on both sides of x, because from the wrong one no way leads back. (Modes that
    scatter by 3 % are much: of eighteen such draws eight need a second round.)"""
    truth = drawn_as_built(2)
    A, B = (
        replace(recorded(truth, seed, {"misalignment": {"dx_um": dx_um, "dy_um": dy_um}}), tolerance=0.003)
        for seed in (1, 2)
    )
    effect = EFFECTS["misalignment"]
    search = Search(A, B, (effect,), THRESHOLDS, lambda _: None)
    response = Augmented(as_built())
    at = {p.name: p.begin for p in response.free()}
    base = Explanation(response, at, 0.0, B, THRESHOLDS)
    assert base.worst_G > GROSS
    (found,) = search.add_one(base)
    assert found.adequate
    # the model file's tolerance lets dx be off by some 10 um, dy by a third of it
    assert found.at["misalignment.dx_um"] == pytest.approx(dx_um, abs=25.0)
    assert found.at["misalignment.dy_um"] == pytest.approx(dy_um, abs=8.0)


@pytest.mark.slow
def test_modes_that_are_misplaced_are_moved_one_after_the_other() -> None:
    """From 3 % beside a large dy: the second mode shows at the residual's peak when the first is in its place."""
    truth = drawn_as_built(3)
    offset = {"misalignment": {"dx_um": -20.0, "dy_um": 200.0}}
    A, B = (replace(recorded(truth, seed, offset), tolerance=0.003) for seed in (1, 2))
    search = Search(A, B, (), THRESHOLDS, lambda _: None)
    response = Augmented(as_built(), (EFFECTS["misalignment"],))
    begin = {"misalignment.dx_um": -20.0, "misalignment.dy_um": 194.0}
    astray = search._with_shrinking_tolerance(response, response.own_values(begin))
    astray = search.refit(response, astray.at)
    assert not any(c.adequate for c in (astray, *search.with_moved_modes(astray)))
    found = min(search.with_moved_modes(astray, MOVES), key=lambda c: c.cost)
    assert found.adequate
    assert found.at["misalignment.dy_um"] == pytest.approx(200.0, abs=8.0)
