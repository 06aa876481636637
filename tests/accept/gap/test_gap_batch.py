"""What batch and report make of responses that do not fit their model: told everywhere, verdicts untouched."""

import csv
import io
import json
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from pypdf import PdfReader

from accept.gap import attach_to_result
from accept.gap.analyse_unit import GapAnalysis
from accept.models.model_file import open_model
from accept.units.loaded_unit import LoadedUnit
from tests.checks.gap.shared.gap_units import make_strut
from tests.checks.model.units_model import DATA, needs_data
from tests.shared.command_line import accept
from tests.shared.gap_run import GapRun

BASIC = Path(__file__).parents[3] / "specs" / "strut-basic.toml"  # without the check that fits a model: quick


def spec_with_gap(folder: Path, model: object = "strut") -> Path:
    path = folder / "spec.toml"
    path.write_text(
        BASIC.read_text().replace('name = "strut-basic"', 'name = "mine"') + f'\n[gap]\nmodel = "{model}"\n'
    )
    return path


def entries(out: Path) -> dict[str, dict[str, Any]]:
    return {u["serial"]: u for u in json.loads((out / "results.json").read_text())["units"]}


@pytest.fixture(scope="module")
def units(gap_run: GapRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two struts, one of them with a high-pass, and one without responses."""
    place = tmp_path_factory.mktemp("units")
    shutil.copytree(gap_run.unit, place / "X-1")
    make_strut(place / "S-1", "S-1", seed=2)  # of its own: equal noise would be a copy
    make_strut(place / "N-1", "N-1", seed=3)
    text = (place / "N-1" / "unit.toml").read_text()
    (place / "N-1" / "unit.toml").write_text(text.split("[frf]")[0])
    return place


@pytest.fixture
def searched_before(gap_run: GapRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """X-1 was searched by the same model before; others are searched."""
    monkeypatch.setattr(attach_to_result.analyse_unit, "analyse", known_of_X_1(gap_run))


def known_of_X_1(gap_run: GapRun) -> Callable[..., GapAnalysis]:
    search = attach_to_result.analyse_unit.analyse

    def analyse(unit: LoadedUnit, *arguments: object, **options: object) -> GapAnalysis:
        return gap_run.done if unit.folder.serial == "X-1" else search(unit, *arguments, **options)

    return analyse


@pytest.fixture(scope="module")
def judged(units: Path, gap_run: GapRun, tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    place = tmp_path_factory.mktemp("batch")
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACCEPT_HOME", str(home))
        patch.setenv("ACCEPT_PASSPHRASE", "correct horse")
        patch.setenv("ACCEPT_OPERATOR", "Test Technician")  # whom the tests' own environment names
        patch.setattr(attach_to_result.analyse_unit, "analyse", known_of_X_1(gap_run))
        run = accept("batch", units, "--spec", spec_with_gap(place), "--out", place / "out", "--workers", 1)
    return SimpleNamespace(run=run, out=place / "out", home=home, spec=place / "spec.toml")


class TestResults:
    def test_found_and_named(self, judged: SimpleNamespace) -> None:
        found = entries(judged.out)
        assert found["S-1"]["gap"]["verdict"] == "no_missing_effect"
        assert [n["effect"] for n in found["X-1"]["gap"]["named"]] == ["sensor_highpass"]
        assert found["X-1"]["gap"]["start"] == "strut"
        assert found["X-1"]["gap"]["model_sha256"] == open_model("strut").sha256
        assert "gap" not in found["N-1"]
        assert "X-1: does not fit model strut; cause found: sensor highpass (f " in judged.run.stdout

    def test_no_verdict_comes_of_it(self, judged: SimpleNamespace) -> None:
        found = entries(judged.out)
        assert {s: u["verdict"] for s, u in found.items()} == {
            "S-1": "accepted", "X-1": "accepted", "N-1": "incomplete",
        }  # fmt: skip
        assert not any(f["check"] == "gap" for u in found.values() for f in u["findings"])

    def test_table_and_build_server(self, judged: SimpleNamespace) -> None:
        rows = list(csv.DictReader(io.StringIO((judged.out / "results.csv").read_text())))
        assert all(("sensor highpass" in row["gap"]) == (row["serial"] == "X-1") for row in rows)
        suites = {s.get("name"): s for s in ET.parse(judged.out / "junit.xml").getroot()}
        assert "sensor highpass" in (suites["X-1"].findtext("system-out") or "")
        assert suites["N-1"].find("system-out") is None
        assert (suites["X-1"].get("failures"), suites["X-1"].get("errors")) == ("0", "0")

    def test_improved_model(self, judged: SimpleNamespace) -> None:
        assert entries(judged.out)["X-1"]["gap"]["improved"] == "models/X-1.toml"
        assert open_model(judged.out / "models" / "X-1.toml").values["sensor.highpass_Hz"] == pytest.approx(
            4.0, rel=0.1
        )
        assert not (judged.out / "models" / "S-1.toml").exists()

    def test_certificate(self, judged: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
        path = judged.out / "certificates" / "X-1.pdf"
        text = " ".join(" ".join(page.extract_text() for page in PdfReader(path).pages).split())
        found = entries(judged.out)["X-1"]["gap"]
        assert found["named"][0]["sentence"] in text
        assert "Responses against model strut, for information" in text
        assert all(f"{c} " in text for c in ("Vs", "de", "da"))
        monkeypatch.setenv("ACCEPT_HOME", str(judged.home))
        done = accept("verify", path)
        assert done.exit_code == 0, done.output
        assert "identical to the byte" in done.stderr
        assert "was not searched for again" in done.stderr


class TestAgain:
    def test_unchanged_and_resumed(
        self, judged: SimpleNamespace, units: Path, searched_before: None, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The finding is stored with the verdict; only what is lost is searched for again."""
        monkeypatch.setenv("ACCEPT_HOME", str(judged.home))
        files = [judged.out / name for name in ("results.json", "results.csv", "junit.xml")]
        before = [file.read_bytes() for file in files]
        order = ("batch", units, "--spec", judged.spec, "--out", judged.out, "--workers", 1)
        with monkeypatch.context() as patch:
            patch.setattr(attach_to_result.analyse_unit, "analyse", forbidden)
            assert "3 of 3 units unchanged" in accept(*order).stderr
        assert [file.read_bytes() for file in files] == before
        (judged.out / "models" / "X-1.toml").unlink()
        assert "2 of 3 units unchanged" in accept(*order).stderr
        assert (judged.out / "models" / "X-1.toml").is_file()

    def test_stopped_in_the_middle(self, units: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """Ctrl-C while the second unit is searched: the first is not judged again."""
        order = ("batch", units, "--spec", spec_with_gap(tmp_path), "--out", tmp_path / "out", "--workers", 1)
        searched: list[str] = []

        def stop_at_the_second(unit: LoadedUnit, *_: object, **__: object) -> object:
            searched.append(unit.folder.serial)
            if len(searched) == 2:
                raise KeyboardInterrupt
            raise attach_to_result.GapRefused("not today")

        monkeypatch.setattr(attach_to_result.analyse_unit, "analyse", stop_at_the_second)
        stopped = accept(*order)
        assert stopped.exit_code == 130
        assert "run the command again to continue" in stopped.stderr
        accept(*order)
        assert searched == ["S-1", "X-1", "X-1"]
        assert set(entries(tmp_path / "out")) == {"N-1", "S-1", "X-1"}

    def test_another_model_is_another_question(self, units: Path, tmp_path: Path, monkeypatch) -> None:
        monkeypatch.setattr(attach_to_result.analyse_unit, "analyse", refused)
        model = tmp_path / "m.toml"
        builtin = Path(__file__).parents[3] / "specs" / "models" / "strut.toml"
        model.write_text(builtin.read_text())
        order = ("batch", units / "S-1", "--spec", "strut-basic", "--no-certificates", "--out", tmp_path / "out")
        assert "unchanged" not in accept(*order).stderr
        assert "unchanged" not in accept(*order, "--model", model).stderr  # now there is one to compare with
        assert "1 of 1 units unchanged" in accept(*order, "--model", model).stderr
        text = builtin.read_text()
        changed = text.replace("relative = 0.03", "relative = 0.02")
        assert changed != text
        model.write_text(changed)
        assert "unchanged" not in accept(*order, "--model", model).stderr


class TestFails:
    @pytest.mark.parametrize(
        "error", [RuntimeError("singular matrix"), attach_to_result.GapRefused("coherence is too low")]
    )
    @pytest.mark.slow
    def test_the_unit_is_judged_all_the_same(
        self, units: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
    ) -> None:
        def broken(*_: object, **__: object) -> object:
            raise error

        monkeypatch.setattr(attach_to_result.analyse_unit, "analyse", broken)
        done = accept("report", units / "X-1", "--spec", spec_with_gap(tmp_path), "--out", tmp_path / "X.pdf")
        assert done.exit_code == 0, done.output
        text = " ".join(" ".join(page.extract_text() for page in PdfReader(tmp_path / "X.pdf").pages).split())
        assert "Not compared" in text
        assert str(error) in text
        assert accept("verify", tmp_path / "X.pdf").exit_code == 0

    def test_no_such_model(self, units: Path, tmp_path: Path) -> None:
        spec = spec_with_gap(tmp_path, tmp_path / "gone.toml")
        accept("batch", units / "S-1", "--spec", spec, "--no-certificates", "--out", tmp_path / "out")
        found = entries(tmp_path / "out")["S-1"]
        assert found["verdict"] == "accepted"
        assert found["gap"]["verdict"] == "refused"
        assert "gone.toml" in found["gap"]["reason"]

    def test_unreadable_records(self, units: Path, tmp_path: Path) -> None:
        shutil.copytree(units / "X-1", tmp_path / "X-1")
        (tmp_path / "X-1" / "frf_noise.mat").write_bytes(b"nothing")
        accept(
            "batch", tmp_path / "X-1", "--spec", spec_with_gap(tmp_path), "--no-certificates", "--out", tmp_path / "o"
        )
        found = entries(tmp_path / "o")["X-1"]
        assert found["verdict"] == "incomplete"
        assert found["gap"]["verdict"] == "refused"
        assert "frf_noise.mat" in found["gap"]["reason"]


@needs_data
@pytest.mark.soak
def test_recorded_struts_by_the_strut_spec(tmp_path: Path) -> None:
    """Built-in spec and model against records of finite elements: what is there is named, and nothing else."""
    names = ("S-01", "S-02", "S-04", "S-05")
    accept("batch", *(DATA / "units" / s for s in names), "--spec", "strut", "--out", tmp_path, "--workers", 1)
    found = {s: {n["effect"] for n in u["gap"]["named"]} for s, u in entries(tmp_path).items()}
    assert found == {
        "S-01": set(),
        "S-02": {"misalignment"},
        "S-04": {"bench_mode"},
        "S-05": {"misalignment", "sensor_highpass"},
    }


def forbidden(*_: object, **__: object) -> object:
    raise AssertionError("searched for again")


def refused(*_: object, **__: object) -> object:
    raise attach_to_result.GapRefused("not today")
