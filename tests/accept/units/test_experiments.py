"""`[[experiments]]` of a unit's folder: read strictly, hashed, copies found, simulated as ordered."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from accept.commands.bench.simulate import SimulateOptions, experiment_of, request_of
from accept.judging import judge_unit
from accept.models.model_file import open_model
from accept.simulate import SimulatedUnit, UnitRequestError, simulate, write
from accept.units import unit_folder
from accept.units.loaded_unit import LoadedUnit, loaded
from accept.units.unit_folder import UnitError
from checks.errors import RecordError
from checks.gap import EXPERIMENT_KINDS, under_experiment
from checks.model.build import FixedBody
from specs.spec import load
from tests.accept.units.units import save_mat

HEAD = 'serial = "S-1"\nkind = "strut"\n[frf]\nlow = "low.mat"\nhigh = "high.mat"\n'
MASS = '[[experiments]]\nkind = "added_mass"\nmass_kg = 0.5\nlow = "m_low.mat"\nhigh = "m_high.mat"\n'
FS, N = 10_000.0, 4_000


def columns(seed: int) -> Mapping[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {"t": np.arange(N) / FS} | {c: rng.standard_normal(N) for c in ("Va", "Vs", "de", "da")}


def folder(tmp_path: Path, text: str = HEAD + MASS, **seeds: int) -> Path:
    wanted = {"low": 1, "high": 2, "m_low": 3, "m_high": 4} | seeds
    for stem, seed in wanted.items():
        save_mat(tmp_path / f"{stem}.mat", **columns(seed))
    (tmp_path / "unit.toml").write_text(text)
    return tmp_path


def held(path: Path) -> LoadedUnit:
    return loaded(path)


class TestRead:
    def test_records_value_and_hashes(self, tmp_path: Path) -> None:
        unit = held(folder(tmp_path))
        (one,) = unit.folder.experiments.values()
        assert (one.declared.name, one.number("mass_kg")) == ("added_mass", 0.5)
        assert unit.hashes.keys() == {"unit.toml", "low.mat", "high.mat", "m_low.mat", "m_high.mat"}
        values = unit.experiment("added_mass")
        np.testing.assert_array_equal(values["low"]["de"], columns(3)["de"])

    def test_two_of_a_kind_have_names_of_their_own(self, tmp_path: Path) -> None:
        more = MASS.replace("m_", "n_").replace("0.5", "2.0")
        unit = held(folder(tmp_path, HEAD + MASS + more, n_low=5, n_high=6))
        assert list(unit.folder.experiments) == ["added_mass", "added_mass_2"]

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            (
                '"added_mass"',
                '"mass"',
                "kind = 'mass': expected one of added_mass, drive_level, other_resistor, turned",
            ),
            ('kind = "added_mass"\n', "", "[[experiments]] 1: kind is missing"),
            ("mass_kg = 0.5\n", "", "mass_kg is missing: added_mass needs low, high, mass_kg"),
            ("mass_kg = 0.5", 'mass_kg = "0.5"', "mass_kg = '0.5': expected a number in kg"),
            ("mass_kg = 0.5", "resistor_ohm = 5", "resistor_ohm: unknown key (known of added_mass: kind, low, high"),
            ('"m_high.mat"', "4", "high = 4: expected a file name"),
            ('high = "m_high.mat"', 'high = "m_high.mat"\nhigh_repeat = "x.mat"', "high_repeat without low_repeat"),
            ('"m_low.mat"', '"unit.toml"', "a certificate keeps this name for itself"),
        ],
    )
    def test_what_is_wrong_is_said_with_its_place(self, tmp_path: Path, old: str, new: str, said: str) -> None:
        with pytest.raises(UnitError) as e:
            unit_folder.read(folder(tmp_path, HEAD + MASS.replace(old, new, 1)))
        assert said in str(e.value)

    def test_no_list(self, tmp_path: Path) -> None:
        with pytest.raises(UnitError, match=r"expected sections \[\[experiments\]\]"):
            unit_folder.read(folder(tmp_path, "experiments = 3\n" + HEAD))

    def test_a_number_that_cannot_be_makes_the_experiment_unusable_not_the_unit(self, tmp_path: Path) -> None:
        unit = held(folder(tmp_path, HEAD + MASS.replace("0.5", "-2.0")))
        with pytest.raises(RecordError, match=r"mass_kg = -2 kg is not plausible"):
            unit.experiment("added_mass")
        assert unit.values("frf")["low"].fs == pytest.approx(FS)


class TestCopies:
    def test_a_record_of_the_unit_given_as_an_experiment(self, tmp_path: Path) -> None:
        unit = held(folder(tmp_path, m_low=1))
        with pytest.raises(RecordError, match=r"low \(low.mat\) and added mass low \(m_low.mat\) hold the same"):
            unit.values("frf")

    def test_within_an_experiment(self, tmp_path: Path) -> None:
        unit = held(folder(tmp_path, m_high=3))
        with pytest.raises(RecordError, match="hold the same recording"):
            unit.experiment("added_mass")

    def test_no_finding_of_copied_responses_passes(self, tmp_path: Path) -> None:
        result = judge_unit(unit_folder.read(folder(tmp_path, m_low=1)), load("strut"))
        findings = [f for f in result.findings if f.check == "frf"]
        assert findings
        assert all(f.verdict == "no_result" and "same recording" in str(f.reason) for f in findings)
        assert "m_low.mat" in result.inputs

    def test_a_broken_experiment_does_not_take_the_responses_with_it(self, tmp_path: Path) -> None:
        path = folder(tmp_path)
        (path / "m_low.mat").write_bytes(b"no record")
        unit = held(path)
        assert "low" in unit.values("frf")
        with pytest.raises(RecordError, match=r"m_low\.mat"):
            unit.experiment("added_mass")


ORDERED = ("added_mass:mass_kg=0.5", "drive_level:level=0.5", "other_resistor:resistor_ohm=20000", "turned")


class TestSimulated:
    @pytest.fixture(scope="class")
    def unit(self) -> SimulatedUnit:
        wanted = SimulateOptions(out=Path(), dx_um=30.0, dy_um=90.0, experiment=list(ORDERED), low_s=2.0, high_s=2.0)
        return simulate(request_of(wanted))

    def test_the_folder_can_be_read_and_no_record_is_a_copy(self, unit: SimulatedUnit, tmp_path: Path) -> None:
        held = loaded(write(unit, tmp_path / "S"))
        assert list(held.folder.experiments) == ["added_mass", "drive_level", "other_resistor", "turned"]
        for experiment in held.folder.experiments:
            assert {"low", "high", "low_repeat", "high_repeat"} <= held.experiment(experiment).keys()
        held.values("frf")  # refuses copies

    def test_the_truth_says_what_was_changed(self, unit: SimulatedUnit) -> None:
        mass, level, resistor, turned = unit.truth["experiments"]
        assert mass["parameters"] == {"bench.payload_kg": pytest.approx(6.2)}
        assert level["parameters"] == {}
        assert resistor["parameters"] == {"sensor.highpass_Hz": pytest.approx(1.560, rel=1e-3)}  # 1 / (2 pi R 5.1 uF)
        assert turned == {"kind": "turned", "parameters": {}}

    def test_the_drive_is_as_large_as_ordered(self, unit: SimulatedUnit, tmp_path: Path) -> None:
        held = loaded(write(unit, tmp_path / "S"))
        usual = held.values("frf")["low"]["Va"].std()
        half = held.experiment("drive_level")["low"]["Va"].std()
        assert half / usual == pytest.approx(0.5, rel=0.02)  # two draws of 2 s of noise

    def test_a_strut_turned_answers_as_before(self) -> None:
        """[STB] 6.1: the bench has no x and no y. All that is across the axis turned, the APA's matrices with it."""
        strut = open_model("strut").with_values({"misalignment.dx_um": 80.0, "misalignment.dy_um": -150.0})
        across = ("dx_um", "dy_um", "arm_x_mm", "arm_y_mm", "com_x_mm", "com_y_mm")
        turned = {n: -v for n, v in strut.values.items() if n.rpartition(".")[2] in across}
        body, R = strut.apa(strut.values), np.diag([-1.0, -1.0, 1.0, -1.0, -1.0, 1.0])
        apa = FixedBody(replace(body, bottom=R @ body.bottom, top=R @ body.top))
        f = np.geomspace(10.0, 700.0, 60)
        H = strut.frf(f)
        np.testing.assert_allclose(replace(strut, apa=apa).with_values(turned).frf(f), H, rtol=1e-6)
        one_not = {n: v for n, v in turned.items() if n != "encoder.arm_y_mm"}
        assert np.max(np.abs(replace(strut, apa=apa).with_values(one_not).frf(f) / H - 1.0)) > 0.01
        assert under_experiment(strut, EXPERIMENT_KINDS["turned"], None) is strut

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("mass:mass_kg=1", "experiment 'mass': expected one of added_mass"),
            ("added_mass", "is given with nothing; expected mass_kg"),
            ("turned:mass_kg=1", "is given with mass_kg; expected nothing"),
            ("added_mass:mass_kg=-1", "mass_kg = -1: expected 0.001 to 100"),
        ],
    )
    def test_what_cannot_be_ordered(self, text: str, said: str) -> None:
        with pytest.raises(UnitRequestError) as e:
            experiment_of(text)
        assert said in str(e.value)
