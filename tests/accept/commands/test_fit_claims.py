"""What `accept model fit` claims: only values that the file allows explain, and it never ends worse than it began."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import accept
from accept.analysis import model_fit
from accept.cli.main import app
from accept.models.model_file import open_model
from checks.fitting import Calibration, Dataset
from checks.fitting import model_fit as fitting
from checks.model import Model
from tests.shared.recorded_units import RecordedUnits


@pytest.fixture(scope="module")
def misaligned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A strut that the masses and arms of an impossible encoder imitate."""
    folder = tmp_path_factory.mktemp("fit") / "S-Y"
    accept.simulate_unit(folder, seed=5, values={"misalignment.dy_um": -134.0})
    return folder


def test_values_that_the_file_does_not_allow_explain_nothing(misaligned: Path) -> None:
    out = misaligned / "out"
    done = CliRunner().invoke(app, ["model", "fit", str(misaligned), "--out", str(out), "--starts", "1"])
    assert done.exit_code == 4, done.output
    said = " ".join((done.stdout + done.stderr).split())
    assert "the responses do not fit this model: it allows" in said
    assert "standard deviations" in said
    assert ", fitted, explains" not in said
    document = json.loads((out / "fit.json").read_text())
    assert max(document["gap_after"].values()) < 1.1  # the responses alone would have passed
    assert document["explains"] is False
    assert document["doubt"]
    record = tomllib.loads((out / "model.toml").read_text())["fit"]
    assert record["doubt"] == document["doubt"]
    assert record["G_not_fitted"] == pytest.approx(document["gap_held_out"])


def test_one_convention_of_uncertainty_throughout(misaligned: Path) -> None:
    done = CliRunner().invoke(app, ["model", "fit", str(misaligned), "--starts", "1"], env={"COLUMNS": "160"})
    assert "prior ± U (k = 2)" in done.stdout
    assert "fitted ± U (k = 2)" in done.stdout
    sd = open_model("strut-as-built").sds["bench.payload_kg"]
    (row,) = (line for line in done.stdout.splitlines() if "bench.payload_kg" in line)
    assert f"± {2 * sd:.3f}"[:6] in row


def test_a_search_that_goes_astray_is_not_written_as_a_fit(recorded_units: RecordedUnits) -> None:
    """This strut is misaligned by 212 um: the search for other values ended at a G 50 times as large, "converged"."""
    found = model_fit.fit_unit(recorded_units.folder("S-02"), starts=1)
    assert not found.explains
    for channel, gap in found.after.items():
        assert gap.G <= found.before[channel].G
    if not found.fit.converged:
        assert found.model.values == {**found.start.values, **found.fit.at}


def test_a_worse_end_is_given_up_for_the_start(monkeypatch: pytest.MonkeyPatch, recorded_units: RecordedUnits) -> None:
    def astray(model: Model, data: Dataset, **_: object) -> Calibration:
        good = real(model, data, starts=1)
        values = good.fit.values + 3.0 * np.array([0.1 * p.sd for p in good.fit.free])
        H = good.model.frf(data.f, dict(zip(good.fit.names, values, strict=True)), data.channels)
        return replace(good, fit=replace(good.fit, values=values, residuals=(data.H - H,), prior_cost=1e9))

    real = fitting.calibrate
    monkeypatch.setattr(fitting, "calibrate", astray)
    found = model_fit.fit_unit(recorded_units.folder("S-01"), starts=1)
    assert not found.fit.converged
    assert "farther" in found.fit.message
    assert found.fit.at == pytest.approx({p.name: p.prior for p in found.fit.free})


def test_G_is_that_of_the_fitted_model(recorded_units: RecordedUnits) -> None:
    """About the model itself, not about the response of some earlier step."""
    found = model_fit.fit_unit(recorded_units.folder("S-01"), starts=1)
    data = found.measured.first
    H = found.model.frf(data.f, channels=data.channels)
    for c, channel in enumerate(data.channels):
        own = np.abs(data.H[:, c] - H[:, c]) ** 2 / (data.noise[:, c] + (0.01 * np.abs(H[:, c])) ** 2)
        assert found.after[channel].G == pytest.approx(own.mean(), rel=0.2), channel  # less what was determined
    residual = found.panels["de residual"]
    fitted = next(line for line in residual.items if getattr(line, "label", "") == "model fitted")
    expected = np.abs(data.H[:, 1] - H[:, 1]) / np.abs(H[:, 1])
    np.testing.assert_allclose(fitted.y, np.maximum(expected, 1e-4), rtol=1e-9)
