"""`accept model`, and models as files."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.analysis import model_fit
from accept.cli.main import app
from accept.gap.unit_responses import responses
from accept.models.model_file import AS_BUILT, open_model, open_model_file, write_model
from accept.units.unit_folder import UnitError
from checks.errors import ModelError
from checks.fitting import Dataset
from checks.model import Model
from checks.rounding import with_U
from specs.model import builtin_models, load_model
from specs.model_sections import FitRecord
from specs.strict import SpecError
from tests.accept.units.modelled_records import write_answers
from tests.checks.model.units_model import APA300ML, NOMINAL, needs_data, true_values
from tests.shared.recorded_units import RecordedUnits


def run(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["model", *(str(a) for a in arguments)])
    return done.exit_code, done.stdout, done.stderr


def unit_folder(tmp_path: Path, model: str, changes: dict[str, float]) -> Path:
    """A unit whose records are the model's answer."""
    write_answers(tmp_path, ("low", "high"), open_model(model), changes, seed=6, noise=1e-4)
    (tmp_path / "unit.toml").write_text(
        'serial = "T-1"\nkind = "apa"\n[frf]\nlow = "low.mat"\nhigh = "high.mat"\nmerge_Hz = 350.0\n'
    )
    return tmp_path


CHANGES = {"apa.ke_N_per_um": 1.8, "bench.payload_kg": 5.65, "constants.ga_N_per_V": -30.5, "apa.c_N_s_per_m": 38.0}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int, str, str]:
    folder = unit_folder(tmp_path_factory.mktemp("unit"), "apa-2dof", CHANGES)
    return (folder, *run("fit", folder, "--model", "apa-2dof", "--starts", 1, "--out", folder / "out"))


def test_fit_recovers_and_says_so(fitted: tuple[Path, int, str, str]) -> None:
    folder, code, out, err = fitted
    assert code == 0, err
    document = json.loads((folder / "out" / "fit.json").read_text())
    for name, value in CHANGES.items():
        found = document["parameters"][name]
        assert abs(found["value"] - value) < 2 * found["U"], name
    assert max(document["gap_after"].values()) < 1.1 < max(document["gap_before"].values())
    assert "apa.ke_N_per_um" in out
    assert "G before" in out
    ke = document["parameters"]["apa.ke_N_per_um"]
    assert with_U(ke["value"], ke["U"]) in out  # to two digits of its U, no further
    assert "apa-2dof, fitted, explains T-1: G of" in out
    assert (folder / "out" / "fit.pdf").read_bytes().startswith(b"%PDF")


def test_the_fitted_model_opens_again(fitted: tuple[Path, int, str, str]) -> None:
    folder = fitted[0]
    model, document = open_model(folder / "out" / "model.toml"), json.loads((folder / "out" / "fit.json").read_text())
    for name, found in document["parameters"].items():
        assert model.values[name] == found["value"]
        assert model.sds[name] == pytest.approx(found["U"] / 2, rel=1e-12)
    spec = load_model(folder / "out" / "model.toml")
    assert spec.fit is not None
    assert spec.fit.serial == "T-1"
    assert set(spec.fit.inputs) == {"low.mat", "high.mat"}
    sds = np.sqrt(np.diag(spec.fit.covariance))
    np.testing.assert_allclose(sds, [model.sds[n] for n in spec.fit.names], rtol=1e-12)
    assert run("show", "--model", folder / "out" / "model.toml")[0] == 0


def test_constants_stand_beside_the_fit(fitted: tuple[Path, int, str, str]) -> None:
    document = json.loads((fitted[0] / "out" / "fit.json").read_text())
    assert document["constants"]["ga_N_per_V"]["value"] == pytest.approx(-30.5, rel=2e-3)  # noise 1e-4 over 4 s
    # the published formula takes the gain at 10..20 Hz for the static one, 3 % more
    assert document["constants_by_the_seed"]["ga_N_per_V"] == pytest.approx(-30.5, rel=0.05)


def test_frf_writes_what_the_model_says(tmp_path: Path) -> None:
    code, out, _ = run("frf", "--model", "apa-2dof", "--points", 20)
    assert code == 0
    document = json.loads(out)
    f = np.array(document["f_Hz"])
    H = open_model("apa-2dof").frf(f)
    de = document["channels"]["de"]
    np.testing.assert_array_equal(np.array(de["real"]) + 1j * np.array(de["imag"]), H[:, 1])
    assert de["unit"] == "m/V"
    code, out, _ = run("frf", "--points", 50, "--csv", tmp_path / "h.csv", "--plot", tmp_path / "h.svg")
    assert code == 0
    assert out == ""
    table = np.genfromtxt(tmp_path / "h.csv", delimiter=",", names=True)
    assert table["da_real"].size == 50
    assert (tmp_path / "h.svg").read_text().startswith("<?xml")


def test_modes_and_sweep() -> None:
    code, out, _ = run("modes", "--model", "apa-2dof")
    assert code == 0
    assert "95.06 Hz" in out  # the pole of [STB] 7.3's figures
    assert "41.09 Hz" in out  # and its zero of Vs
    code, out, _ = run("modes", "--clamped")
    assert code == 0
    assert "zeros" not in out
    code, out, _ = run("sweep", "dy", "--value", -100, "--value", 100)
    assert code == 0
    assert "misalignment.dy_um" in out
    assert "0.42  0.4" in out  # damping of the first two poles in percent, as `modes` shows it
    code, out, _ = run("sweep", "bench.payload_kg", "--value", 5, "--model", "apa-2dof", "--channel", "Vs")
    assert code == 0
    assert "101.5" in out  # 95.06 Hz times sqrt(5.7 / 5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("show", "--model", "nope"), "no such model"),
        (("show", "--model", "nope.toml"), "cannot be read"),
        (("frf", "--f-lo", 6000, "--f-hi", 9000), "6000 Hz"),
        (("frf", "--f-lo", 20, "--f-hi", 10), "rising range"),
        (("sweep", "joint.kz"), "no values for 'joint.kz'"),
        (("sweep", "joint.kz", "--value", 3), "no parameter 'joint.kz'"),
        (("sweep", "dy", "--channel", "dz"), "no channel 'dz'"),
        (("fit", "/nowhere"), "/nowhere"),
        (("fit", "/nowhere", "--f-hi", 9000), "9000 Hz is outside"),
        (("frf", "--plot", "/tmp/x.gif"), "ends in .pdf, .svg or .png"),
    ],
)
def test_bad_input_ends_in_one_clear_line_and_exit_6(arguments: tuple, words: str) -> None:
    code, _, err = run(*arguments)
    assert code == 6
    assert words in err
    assert "Traceback" not in err


def test_a_unit_without_responses_is_refused(tmp_path: Path) -> None:
    (tmp_path / "unit.toml").write_text('serial = "T-2"\nkind = "apa"\n')
    with pytest.raises(UnitError, match=r"no section \[frf\]"):
        responses(tmp_path)


def test_effects_are_built_in_and_written(tmp_path: Path) -> None:
    spec = load_model("strut")
    effects = [("misalignment", {"dx_um": 20.0, "dy_um": -170.0}), ("hysteresis", {"relative_width": 0.1})]
    write_model(tmp_path / "m.toml", spec, {"encoder.com_x_mm": 0.5}, effects=effects, damping="modal", name="mine")
    again = open_model_file(tmp_path / "m.toml")
    assert again.model.values["misalignment.dy_um"] == -170.0
    assert again.model.values["encoder.com_x_mm"] == 0.5
    assert again.model.damping == "modal"
    assert again.spec.name == "mine"
    assert again.left_out == ("hysteresis",)
    more = write_model(tmp_path / "n.toml", again.spec, {}, effects=[("loop_delay", {"tau_us": 30.0})])
    assert [e.name for e in more.effects] == ["misalignment", "hysteresis", "loop_delay"]
    assert "# centre of rotation" in (tmp_path / "n.toml").read_text()  # comments stay


@pytest.mark.takes_data
def test_the_superelement_is_found_from_the_new_place(tmp_path: Path) -> None:
    written = write_model(tmp_path / "a" / "b" / "m.toml", load_model(NOMINAL), {"joint.kz_N_per_um": 88.5})
    assert written.apa_file is not None
    assert written.apa_file.resolve() == APA300ML.resolve()
    assert open_model(tmp_path / "a" / "b" / "m.toml").values["joint.kz_N_per_um"] == 88.5


RECORD = {"names": ["a", "b"], "covariance": [[1.0, 0.1], [0.1, 1.0]], "model": "m", "model_sha256": "0"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"names": ["a", "a"]}, "twice"),
        ({"covariance": [[1.0, 0.1]]}, "2 rows of 2"),
        ({"covariance": [[0.0, 0.1], [0.1, 1.0]]}, "expected above 0"),
        ({"covariance": [[float("nan"), 0.1], [0.1, 1.0]]}, "finite"),
        ({"surplus": 1}, "surplus"),
    ],
)
def test_a_record_of_a_fit_is_read_strictly(changes: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        FitRecord.model_validate(RECORD | changes)


def test_a_damaged_file_or_effect_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    write_model(path, load_model("strut"), {}, effects=[("misalignment", {"dx_um": 1.0, "dy_um": 2.0})])
    text = path.read_text()
    path.write_text(text.replace("dx_um = 1.0", 'dx_um = "one"'))
    with pytest.raises(ModelError, match="dx_um is 'one'"):
        open_model(path)
    path.write_text(text.replace("dx_um = 1.0", "dz = 1.0"))
    with pytest.raises(ModelError, match="expected"):
        open_model(path)
    path.write_text(text + "\n[surprise]\nx = 1\n")
    with pytest.raises(SpecError, match="surprise"):
        open_model(path)


def test_a_strut_is_fitted_with_the_modes_of_its_misalignment_as_far_as_they_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With exact modes and to 2 kHz a sound strut's kRy came out five standard deviations off."""
    seen = []

    def stop(model: Model, data: Dataset, *_: object, **__: object) -> None:
        seen.append((model.name, float(data.f[-1])))
        raise ModelError("seen enough")

    monkeypatch.setattr(model_fit.ModelFit, "of", stop)
    folder = unit_folder(tmp_path, "strut", {})
    toml = folder / "unit.toml"
    toml.write_text(
        toml.read_text().replace('"apa"', '"strut"\n[parts]\napa = "A"\njoint_bottom = "B"\njoint_top = "C"')
    )
    code, _, err = run("fit", folder)
    assert code == 6
    assert "fitted to 700 Hz only" in err
    ((name, f_hi),) = seen
    assert name == AS_BUILT
    assert 650.0 < f_hi <= 700.0


@needs_data
@pytest.mark.soak
def test_fit_of_a_recorded_strut_holds_the_truth(recorded_units: RecordedUnits) -> None:
    fitted = model_fit.fit_unit(recorded_units.folder("S-01"))
    kR = true_values(recorded_units.truth("S-01"))["joint.kRy_Nm_per_rad"]
    assert abs(fitted.fit.at["joint.kRy_Nm_per_rad"] - kR) < 2.0 * fitted.fit.sds["joint.kRy_Nm_per_rad"]
    assert max(g.G for g in fitted.held_out.values()) < 1.1


def test_the_list_of_models_says_what_each_is() -> None:
    code, out, _ = run("list")
    assert code == 0
    lines = out.splitlines()
    assert [line.split()[0] for line in lines if not line.startswith(" ")] == list(builtin_models())
    assert max(map(len, lines)) <= 80
    assert "strut-as-built  The strut as it is built" in out
