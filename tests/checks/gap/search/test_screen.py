"""Modes that are missing: where a fit of one begins, and where one that was found says nothing."""

import pytest

from checks.gap.decision.evidence import on_a_mode
from checks.gap.effects import EFFECTS
from checks.gap.modelling.augmented import Augmented
from checks.gap.search.screen import screen
from checks.gap.statistics.projected_residual import project
from checks.gap.workflow import run
from checks.model import frequency_and_damping
from tests.checks.gap.shared.gap_cases import drawn, inputs, recorded, strut


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


@pytest.mark.parametrize(
    ("f_Hz", "damping_ratio"), [(596.0, 0.009), pytest.param(581.0, 0.006, marks=pytest.mark.soak)]
)
def test_a_mode_of_the_bracket_beside_one_of_the_struts_own(f_Hz: float, damping_ratio: float) -> None:
    """It takes the place of the strut's mode at 610 Hz in a calibration of all channels, and no start finds it."""
    found = run(inputs(3, {"encoder_bracket_mode": {"f_Hz": f_Hz, "damping_ratio": damping_ratio}}), lambda _: None)
    (name,) = found.named
    assert name.effect == "encoder_bracket_mode"
    assert name.parameters["f_Hz"].value == pytest.approx(f_Hz, rel=1e-3)  # a tenth of the mode's half-width, and noise


def test_a_mode_on_one_of_the_struts_own_has_no_name() -> None:
    """Modes of a lopsided APA are coupled otherwise, and a mode of the bench of 1e-4 upon one of them explains it."""
    model, bench = strut(), EFFECTS["bench_mode"]
    response = Augmented(model).with_member(bench)
    own = [float(f) for f in frequency_and_damping(model.poles())[0] if 50.0 < f < 1000.0]
    for f_Hz in own:
        at = {p.name: p.prior for p in response.free()} | {"bench_mode.ratio": 1e-4, "bench_mode.damping_ratio": 0.004}
        assert on_a_mode(bench, response, at | {"bench_mode.f_Hz": 1.002 * f_Hz})
        beside = at | {"bench_mode.f_Hz": 1.05 * f_Hz}
        assert on_a_mode(bench, response, beside) == any(abs(1.05 * f_Hz / f - 1) < 0.02 for f in own)
    bracket = EFFECTS["encoder_bracket_mode"]  # multiplies de: another thing than a mode that is coupled otherwise
    response = Augmented(model).with_member(bracket)
    at = {p.name: p.prior for p in response.free()} | {"encoder_bracket_mode.damping_ratio": 0.01}
    assert not on_a_mode(bracket, response, at | {"encoder_bracket_mode.f_Hz": own[4]})
