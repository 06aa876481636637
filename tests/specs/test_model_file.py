"""Model files: read strictly, every number a value or a value with its spread, names as in the design."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from accept.models.model_file import KEPT_MODELS, open_model, open_model_file
from checks.errors import ModelError
from checks.model import build_model, file_nodes
from checks.model.structure.superelement import Nodes
from specs.model import ModelSpec, builtin_models, load_model, parse_model
from specs.strict import SpecError
from tests.checks.model.units_model import APA300ML, NOMINAL

SMALL = """
name = "small"
[apa]
type = "2dof"
[joint]
type = "2dof"
kRx_Nm_per_rad = 5
kRy_Nm_per_rad = { value = 5.0, sd = 0.3 }
[bench]
payload_kg = 5.7
[constants]
ga_N_per_V = -32.2
gs_V_per_N = 0.088
"""


def parse(text: str) -> ModelSpec:
    return parse_model(text.encode(), "small.toml", Path())


def test_numbers_are_values_or_values_with_a_spread() -> None:
    spec = parse(SMALL)
    assert spec.values["joint.kRx_Nm_per_rad"] == 5.0
    assert spec.values["joint.kRy_Nm_per_rad"] == 5.0
    assert spec.sds == {"joint.kRy_Nm_per_rad": 0.3}
    calibrated = build_model(spec).calibrated
    assert calibrated.names == ("joint.kRy_Nm_per_rad",)
    assert (calibrated.values, calibrated.sds) == (np.array([5.0]), np.array([0.3]))


def test_what_a_file_leaves_out_does_nothing() -> None:
    values = build_model(parse(SMALL)).values
    for off in (
        "misalignment.dx_um",
        "delay.tau_us",
        "sensor.highpass_Hz",
        "sensor.crosstalk_V_per_V",
        "bench.mode_ratio",
    ):
        assert values[off] == 0.0
    assert values["amplifier.f_Hz"] == np.inf
    assert "encoder.scale" not in values


def test_joints_may_differ() -> None:
    joint = SMALL[SMALL.index("[joint]") : SMALL.index("[bench]")]
    two = joint.replace("[joint]", "[joint.bottom]") + joint.replace("[joint]", "[joint.top]").replace("= 5\n", "= 9\n")
    model = build_model(parse(SMALL.replace(joint, two)))
    assert model.values["joint.bottom.kRx_Nm_per_rad"] == 5.0
    assert model.values["joint.top.kRx_Nm_per_rad"] == 9.0
    same = joint.replace("[joint]", "[joint.bottom]") + joint.replace("[joint]", "[joint.top]")
    f = np.linspace(10, 2000, 50)
    np.testing.assert_allclose(
        build_model(parse(SMALL.replace(joint, same))).frf(f), build_model(parse(SMALL)).frf(f), rtol=1e-9
    )


def test_effects_are_kept_as_they_are_and_in_order() -> None:
    more = """
[[effects]]
name = "misalignment"
dx_um = 20.0
dy_um = -170.0
[[effects]]
name = "creep"
per_decade = 0.02
"""
    effects = parse(SMALL + more).effects
    assert [e.name for e in effects] == ["misalignment", "creep"]
    assert effects[0].parameters == {"dx_um": 20.0, "dy_um": -170.0}


def test_hash_follows_the_bytes() -> None:
    assert build_model(parse(SMALL)).sha256 == build_model(parse(SMALL)).sha256
    assert build_model(parse(SMALL)).sha256 != build_model(parse(SMALL + "# again")).sha256


@pytest.mark.parametrize("name", sorted(builtin_models()))
def test_models_travel_to_other_cores(name: str) -> None:
    model = open_model(name)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).frf([50.0]), model.frf([50.0]))


@pytest.mark.parametrize("name", sorted(builtin_models()))
def test_built_in_models_read_and_say_their_name(name: str) -> None:
    assert load_model(name).name == name


def test_the_built_in_models_of_the_design() -> None:
    assert set(builtin_models()) == {"apa-2dof", "apa-frame", "strut-2dof", "strut", "strut-as-built", "strut-plates"}


@pytest.mark.takes_data
def test_the_nominal_strut() -> None:
    spec = load_model(NOMINAL)
    assert spec.apa_file is not None
    assert spec.apa_file.resolve() == APA300ML.resolve()
    assert file_nodes(spec) == Nodes(0, 1, (2, 3), (4, 6))
    assert spec.tolerance.relative == 0.01
    assert spec.values["encoder.com_y_mm"] == 11.5
    assert spec.values["encoder.inertia_z_kg_m2"] == 2.6e-5
    assert len(spec.sds) == 14


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("payload_kg", "payload_g", r"\[bench\.payload_g\] unknown key"),
        ("= 5.7", '= "heavy"', r"\[bench\.payload_kg\.value\].*'heavy'"),
        ("= 5.7", "= nan", r"\[bench\.payload_kg\.value\].*nan"),
        ("sd = 0.3", "sd = 0.0", r"sd\].*greater than 0"),
        ("sd = 0.3", "spread = 0.3", r"spread\] unknown key"),
        ("= 5.7", "= true", r"\[bench\.payload_kg\.value\]"),
        ('name = "small"', "", r"\[name\]"),
        ('type = "2dof"\nkRx', 'type = "4dof"\nkRx', "a joint of type '4dof' needs kRz_Nm_per_rad"),
        ("kRx_Nm_per_rad = 5\n", "kRx_Nm_per_rad = 5\nkz_N_per_um = 90\n", "a joint of type '2dof' has no kz_N_per_um"),
        ("gs_V_per_N = 0.088", "", "exactly one of gs_V_per_m and gs_V_per_N"),
        ('[apa]\ntype = "2dof"', '[apa]\ntype = "frame"', "gs_V_per_N is for apa.type '2dof'"),
        ('[apa]\ntype = "2dof"', '[apa]\ntype = "3dof"', r"\[apa\]"),
        ('[apa]\ntype = "2dof"', '[apa]\ntype = "superelement"', r"\[apa\.superelement\.file\]"),
        ("[bench]", "[bench", "is not TOML"),
        ('name = "small"', 'name = "small"\nsha256 = "x"', r"\[sha256\] unknown key"),
    ],
)
def test_refused_with_the_key(old: str, new: str, words: str) -> None:
    assert old in SMALL
    with pytest.raises(SpecError, match=words):
        parse(SMALL.replace(old, new))


def test_encoder_needs_a_strut() -> None:
    text = Path(builtin_models()["strut"]).read_text()
    without = text[: text.index("[joint]")] + text[text.index("[encoder]") :]
    with pytest.raises(SpecError, match=r"\[encoder\] without \[joint\]"):
        parse(without)


def test_unknown_model_and_missing_file(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"no such model .*strut-2dof"):
        load_model("strut-3dof")
    with pytest.raises(SpecError, match=r"absent\.toml: cannot be read"):
        load_model(tmp_path / "absent.toml")


def test_impossible_value_in_a_file_is_named() -> None:
    with pytest.raises(ModelError, match=r"bench\.payload_kg is -5\.7 kg; expected a number above 0"):
        build_model(parse(SMALL.replace("= 5.7", "= -5.7")))


def test_superelement_file_that_is_not_there(tmp_path: Path) -> None:
    text = Path(builtin_models()["strut"]).read_text()
    nodes = "nodes = { bottom = 1, top = 2, sensor = [3, 4], actuator = [5, 7] }"
    path = tmp_path / "m.toml"
    path.write_text(text.replace('type = "frame"', f'type = "superelement"\nfile = "no.mat"\n{nodes}'))
    with pytest.raises(ModelError, match=r"no\.mat: no such file"):
        open_model(path)
    with pytest.raises(ModelError, match=r"needs the superelement of .*no\.mat"):
        build_model(load_model(path))


class TestFrameGeometry:
    TEXT = Path(builtin_models()["apa-frame"]).read_text()

    def read(self, geometry: str) -> ModelSpec:
        return parse(self.TEXT.replace("[bench]", f"[apa.geometry]\n{geometry}\n[bench]"))

    def test_a_thicker_arm_is_stiffer(self) -> None:
        thick = build_model(self.read("arm_thickness = [1.9e-3, 2.0e-3]"))
        assert abs(thick.poles()[0]) > 1.05 * abs(open_model("apa-frame").poles()[0])

    def test_parts_within_parts(self) -> None:
        heavy = build_model(self.read("ceramic = { rho = 16000.0 }"))
        assert abs(heavy.poles()[1]) < abs(open_model("apa-frame").poles()[1])

    @pytest.mark.parametrize(
        ("geometry", "words"),
        [
            ("arm_thicknes = [1e-3, 1e-3]", r"\[apa\.geometry\] has no 'arm_thicknes'"),
            ("arm_thickness = [1e-3]", r"\[apa\.geometry\.arm_thickness\] is \[0\.001\]"),
            ("arm_width = 'wide'", r"arm_width\] is 'wide'"),
            ("ceramic = { density = 1.0 }", r"\[apa\.geometry\.ceramic\] has no 'density'"),
            ("arm_width = -1.0", "arm_width"),
        ],
    )
    def test_refused(self, geometry: str, words: str) -> None:
        with pytest.raises(ModelError, match=words):
            build_model(self.read(geometry))


def test_an_opened_model_is_kept_for_the_same_bytes_only(tmp_path: Path) -> None:
    """Built once for a file as it is, anew when a number in it changed."""
    path = tmp_path / "one.toml"
    text = load_model("strut-2dof").text
    path.write_text(text)
    first = open_model_file(path)
    for payload in range(10, 10 + KEPT_MODELS):  # more files than are kept, this one in use between them
        path.write_text(text)
        assert open_model_file(path) is first
        path.write_text(text.replace("payload_kg = { value = 5.7,", f"payload_kg = {{ value = {payload},"))
        assert open_model_file(path).model.values["bench.payload_kg"] == payload
    path.write_text(text)
    assert open_model_file(path) is first
