"""The quick look at the library: where a fit begins, on struts of which something else is missing as well."""

import pytest

from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from checks.gap.search.screen import screen
from checks.gap.statistics.projected_residual import project
from checks.gap.workflow import run
from tests.checks.gap.gap_cases import drawn, inputs, recorded, strut


@pytest.mark.parametrize("f_Hz", [480.0, 626.0, 860.0])
def test_a_tall_mode_of_the_bracket_beside_a_delay_and_soft_joints(f_Hz: float) -> None:
    """A damping ratio of 0.006 makes a response eighty times as large in two bins, and above it ten times smaller in
    a hundred: what is left is largest there, and a fit that begins there ends in a mode that is damped to death."""
    hidden = {
        "encoder_bracket_mode": {"f_Hz": f_Hz, "damping_ratio": 0.006},
        "loop_delay": {"tau_us": 70.0},
        "joint_axial_compliance": {"kz_N_per_um": 47.0},
    }
    for seed in (3, 4):
        model = strut()
        response = Augmented(model)
        data = recorded(drawn(seed), seed, hidden)
        at = {p.name: p.prior for p in response.free()}
        found = screen(project(response, data, at), EFFECTS["encoder_bracket_mode"])
        # within two bins and what the strut's own modes pull; a fit begins at each
        assert any(start["f_Hz"] == pytest.approx(f_Hz, rel=0.03) for start in found.starts)


@pytest.mark.parametrize(("f_Hz", "damping_ratio"), [(596.0, 0.009), (581.0, 0.006)])
def test_a_mode_of_the_bracket_beside_one_of_the_struts_own(f_Hz: float, damping_ratio: float) -> None:
    """It takes the place of the strut's mode at 610 Hz in a calibration of all channels, and no start finds it."""
    found = run(inputs(3, {"encoder_bracket_mode": {"f_Hz": f_Hz, "damping_ratio": damping_ratio}}), lambda _: None)
    (name,) = found.named
    assert name.effect == "encoder_bracket_mode"
    assert name.parameters["f_Hz"].value == pytest.approx(f_Hz, rel=1e-3)  # a tenth of the mode's half-width, and noise
