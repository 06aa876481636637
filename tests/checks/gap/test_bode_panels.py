"""Bode plots of a gap analysis: bands hold what they should, phases do not jump, axes are shared."""

import numpy as np
import pytest

from checks.gap.decision.bode_panels import _broken, _covariance, _cut, _from, bode_panels
from checks.gap.decision.result import Result
from checks.picture import Band, Line
from tests.shared.gap_run import GapRun


@pytest.fixture(scope="module")
def result(gap_run: GapRun) -> Result:
    return gap_run.done.result


def test_three_panels_of_a_channel_stand_on_one_axis(result: Result) -> None:
    drawn = bode_panels(result)
    for c in result.before.data.channels:
        of = [drawn[f"{c} {kind}"] for kind in ("magnitude", "phase", "deviation")]
        assert len({panel.x_range for panel in of}) == 1
        assert all(panel.x_log for panel in of)


def test_the_band_of_the_model_holds_95_of_100_draws_of_its_fitted_values(result: Result) -> None:
    """Draws about the fit, tolerance left out of both: 300 draws, so 95 +- 4 % at three standard errors; linear."""
    fitted, f = result.after, result.after.data.f
    names, L = _covariance(fitted)
    rng, size = np.random.default_rng(4), np.abs(fitted.modelled)
    D = fitted.response.jacobian(f, names, fitted.at, fitted.data.channels) * np.exp(-1j * np.angle(fitted.modelled))
    along = np.sqrt((np.einsum("pq,pfc->qfc", L, D).real ** 2).sum(0))
    inside = []
    for z in rng.standard_normal((300, L.shape[1])):
        moved = {**fitted.at, **dict(zip(names, [fitted.at[n] for n in names] + 0.1 * (L @ z), strict=True))}
        H = fitted.response.frf(f, moved, fitted.data.channels)
        inside.append(np.abs(np.abs(H) - size) < 0.196 * along)  # a tenth of the way: linear
    assert 0.91 < np.mean(inside) < 0.99


def test_units_of_the_model_file_hold_the_unit_and_the_noise_band_the_measurement(result: Result) -> None:
    for c in result.before.data.channels:
        items = {i.label: i for i in bode_panels(result)[f"{c} magnitude"].items if isinstance(i, Band | Line)}
        measured, noise = items["measured"], items["95 % of the measurement"]
        assert np.all((noise.lo <= measured.y) & (measured.y <= noise.hi))
        after, band = items["model after"], items["95 % of the model after"]
        assert np.all((band.lo <= after.y) & (after.y <= band.hi))
        units = items["95 % of units, model file"]
        wide = np.log(units.hi / units.lo) > np.log(band.hi / band.lo)
        assert wide.mean() > 0.7  # what all units may be is more than what is known of this one


def test_a_phase_near_half_a_turn_does_not_jump() -> None:
    f = np.geomspace(1.0, 100.0, 200)
    noisy = 180.0 + np.random.default_rng(1).normal(0.0, 2.0, 200)
    wrapped = (noisy + 180.0) % 360.0 - 180.0
    assert np.count_nonzero(np.abs(np.diff(wrapped)) > 180.0) > 10
    shown = _from(wrapped, _cut([wrapped]))
    assert np.ptp(shown) < 20.0
    whole_turns = np.linspace(0.0, -720.0, 200)  # a delay: two jumps that no cut avoids, each an interruption
    _, broken, _ = _broken(f, _from(whole_turns, _cut([whole_turns])))
    assert np.isnan(broken).sum() == 2
