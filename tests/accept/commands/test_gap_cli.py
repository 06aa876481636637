"""`accept gap` as a script sees it: exit codes, messages, gap.json by its contract, and the improved model reloaded."""

import json
import math
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from accept.analysis import misalignment
from accept.gap import analyse_unit
from accept.gap.improved_model import write_improved
from accept.models.lookup_cache import table_for
from accept.models.model_file import open_model, open_model_file, with_moved_paths
from checks.gap import EFFECTS, GapRefused
from checks.gap.modelling.augmented import Augmented
from tests.accept.units.units import GOOD, make_unit
from tests.checks.gap.shared.gap_units import make_strut
from tests.checks.model.units_model import NOMINAL, needs_data
from tests.shared.command_line import accept
from tests.shared.gap_run import GapRun
from tests.shared.recorded_units import RecordedUnits

F = np.geomspace(8.0, 1900.0, 60)


def numbers(value: Any) -> list[float]:
    """Every number of a document."""
    if isinstance(value, dict | list):
        inside = value.values() if isinstance(value, dict) else value
        return [n for v in inside for n in numbers(v)]
    return [float(value)] if isinstance(value, int | float) and not isinstance(value, bool) else []


class TestFiles:
    def test_named_and_written(self, gap_run: GapRun) -> None:
        assert gap_run.exit_code == 0
        assert {p.name for p in gap_run.out.iterdir()} == {"gap.html", "gap.json", "gap.pdf", "model.toml"}
        assert b'id="plot-3"' in (gap_run.out / "gap.html").read_bytes()  # the map and three channels
        document = json.loads((gap_run.out / "gap.json").read_text())
        assert [n["effect"] for n in document["named"]] == ["sensor_highpass"]
        found = document["named"][0]["parameters"]["f_Hz"]
        assert abs(found["value"] - 4.0) < found["ci95"][1] - found["ci95"][0]  # twice its half-width: 1 in 10,000
        lines = gap_run.stdout.splitlines()
        assert len(lines) <= 24
        assert max(map(len, lines)) <= 80
        assert document["named"][0]["sentence"] in " ".join(" ".join(lines).split())
        assert "calibrating the model" in gap_run.stderr  # progress

    def test_gap_json_is_what_the_design_says(self, gap_run: GapRun) -> None:
        document = json.loads((gap_run.out / "gap.json").read_text())
        assert all(math.isfinite(n) for n in numbers(document))
        for key, kind in {
            "serial": str, "model": str, "verdict": str, "gap_before": dict, "gap_after": dict, "where": list,
            "named": list, "ambiguous": list, "unnamed": list, "detection_limits": dict,
            "candidates": list, "steps": list,
        }.items():  # fmt: skip
            assert isinstance(document[key], kind), key
        assert document["serial"] == "X-1"
        assert document["model"] == "strut"
        assert document["verdict"] in {
            "no_missing_effect", "explained", "ambiguous", "partly_explained", "unexplained",
        }  # fmt: skip
        for key in ("gap_before", "gap_after"):
            assert isinstance(document[key]["G"], float)
            assert set(document[key]["channels"]) == {"Vs", "de", "da"}
            assert all(isinstance(G, float) and G >= 0 for G in document[key]["channels"].values())
        for one in document["candidates"]:
            assert one.keys() == {"effect", "delta_lnL", "p", "reason"}
            assert one["reason"]
        assert {"named"} <= {one["reason"] for one in document["candidates"] if one["effect"] == "sensor_highpass"}
        assert [s["effect"] for s in document["steps"]] == [None, "sensor_highpass"]
        assert document["steps"][-1]["channels"].keys() == document["gap_after"]["channels"].keys()
        for window in document["where"]:
            assert window.keys() == {"channel", "f_lo_Hz", "f_hi_Hz", "p", "excess_dB"}
            assert window["channel"] in {"Vs", "de", "da"}
            assert window["f_lo_Hz"] <= window["f_hi_Hz"]
            assert 0.0 <= window["p"] <= 1.0
        for named in document["named"]:
            assert {"effect", "parameters", "evidence"} <= named.keys()
            assert named["evidence"].keys() == {"delta_lnL", "p"}
            assert set(named["parameters"]) == {p.name for p in EFFECTS[named["effect"]].parameters}
            for value in named["parameters"].values():
                lo, hi = value["ci95"]
                assert lo <= value["value"] <= hi

    def test_what_is_told_and_not_told_by_contract(self, gap_run: GapRun) -> None:
        """The parts that this unit has none of, from an answer that has them."""
        from dataclasses import replace

        from checks.gap.decision.result import Ambiguous, Nameless

        more = replace(
            gap_run.done.result,
            verdict="partly_explained",
            ambiguous=(Ambiguous(("loop_delay", "amplifier_bandwidth"), "drive a dummy"),),
            unnamed=(Nameless("Vs", (620.3,), (625.1,), False, "near", ((619.8, 620.8),), False),),
            detection_limits={"loop_delay": {"tau_us": 1.9}},
        )
        document = json.loads(json.dumps(analyse_unit.to_json("X-1", more), allow_nan=False))
        assert document["ambiguous"] == [
            {"effects": ["loop_delay", "amplifier_bandwidth"], "experiment": "drive a dummy"}
        ]
        unnamed = document["unnamed"][0]
        assert (unnamed["channel"], unnamed["poles_Hz"], unnamed["zeros_Hz"]) == ("Vs", [620.3], [625.1])
        assert unnamed["level_dependent"] is False
        assert (unnamed["poles_ci95"], unnamed["at_edge"]) == ([[619.8, 620.8]], False)
        assert document["detection_limits"] == {"loop_delay": {"tau_us": 1.9}}


def test_without_a_model_it_is_the_strut_as_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def refused(_: object, model: object, *__: object, **___: object) -> None:
        asked.append(model)
        raise GapRefused("not today")

    monkeypatch.setattr(analyse_unit, "analyse", refused)
    unit = make_unit(tmp_path / "S-1", "S-1", GOOD)
    (unit / "unit.toml").write_text((unit / "unit.toml").read_text().replace('kind = "apa"', 'kind = "strut"'))
    done = accept("gap", unit, "--out", tmp_path / "out")
    assert done.exit_code == 6, done.output  # what the search refuses is no verdict
    assert asked == ["strut-as-built"]


class TestImprovedModel:
    def test_its_response_is_the_fitted_one(self, gap_run: GapRun) -> None:
        after = gap_run.done.result.after
        f, channels = after.data.f, after.data.channels
        again = open_model(gap_run.out / "model.toml").frf(f, channels=channels)
        # written with every digit; the factors of the frame's modes are built in again, which rounds
        np.testing.assert_allclose(again, after.response.frf(f, after.at, channels), rtol=1e-6)

    def test_where_it_comes_from(self, gap_run: GapRun) -> None:
        spec = open_model_file(gap_run.out / "model.toml").spec
        assert [e.name for e in spec.effects] == ["sensor_highpass"]
        assert spec.fit is not None
        assert spec.fit.serial == "X-1"
        assert spec.fit.model == "strut"
        assert "sensor_highpass.f_Hz" in spec.fit.names
        assert "frf_noise.mat" in spec.fit.inputs
        assert spec.name == "strut-X-1"

    def test_every_command_takes_it(self, gap_run: GapRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        model = gap_run.out / "model.toml"
        for words in (("show",), ("modes",), ("frf", "--csv", tmp_path / "H.csv")):
            assert accept("model", *words, "--model", model).exit_code == 0, words
        assert accept("lookup", "build", "--model", model, "--nx", 3, "--ny", 3, "--workers", 1).exit_code == 0
        simulated = ("simulate", "unit", "--model", model, "--low-s", 3, "--high-s", 3, "--no-repeats")
        assert accept(*simulated, "--out", tmp_path / "again").exit_code == 0
        # the whole table takes 8 s and says no more of this than a coarse one
        monkeypatch.setattr(misalignment, "table_for", lambda m, say, workers: table_for(m, say, 9, 13, 1))
        done = accept("misalign", gap_run.unit, "--model", model, "--json", tmp_path / "m.json")
        assert done.exit_code == 0, done.output
        found = json.loads((tmp_path / "m.json").read_text())
        for axis in ("dx_um", "dy_um"):  # the strut is aligned
            assert abs(found[axis]["value"]) <= 1.5 * found[axis]["U"]  # three standard uncertainties

    def test_nothing_is_missing_from_it(self, gap_run: GapRun, tmp_path: Path) -> None:
        done = accept("gap", gap_run.unit, "--model", gap_run.out / "model.toml", "--out", tmp_path)
        assert done.exit_code == 0
        assert "X-1: Model and data agree" in done.stdout
        assert json.loads((tmp_path / "gap.json").read_text())["verdict"] == "no_missing_effect"

    @pytest.mark.parametrize("name", sorted(n for n, e in EFFECTS.items() if e.in_model))
    def test_no_effect_counts_twice(self, name: str, tmp_path: Path, gap_run: GapRun) -> None:
        """A model written with any effect answers as the fit did, also where a calibrated value says the same thing."""
        effect = EFFECTS[name]
        models = (
            open_model_file(model) for model in ("strut", "strut-as-built")
        )  # the first that has what the effect changes
        given = next(m for m in models if all(p.targets(m.model) for p in effect.parameters if p.sets or p.adds))
        response = Augmented(given.model, (effect,))
        at = {p.name: p.begin for p in response.free()}
        at |= {f"{name}.{p.name}": p.start + 0.5 * p.scale for p in effect.parameters}
        values = {p.name: SimpleNamespace(value=at[f"{name}.{p.name}"]) for p in effect.parameters}
        fit = SimpleNamespace(names=tuple(at), at=at, sds=dict.fromkeys(at, 1e-3), cov=np.eye(len(at)))
        result = SimpleNamespace(
            fit=fit, named=(SimpleNamespace(effect=name, parameters=values),), gap_after=SimpleNamespace(channels={}),
            written_G={}, bench_latency={}, damping=given.model.damping, after=SimpleNamespace(response=response),
            elements=(),
        )  # fmt: skip
        write_improved(tmp_path / "m.toml", given, gap_run.done.measured, result)
        again = open_model(tmp_path / "m.toml").frf(F)
        expected = response.frf(F, at, given.model.channels)
        if name == "sensor_polarity":  # found before the fit, which saw Vs turned back
            expected = expected * np.array([-1.0 if c == "Vs" else 1.0 for c in given.model.channels])
        np.testing.assert_allclose(again, expected, rtol=1e-9)


def estimated(unit: Path, model: object, place: Path) -> dict[str, tuple[float, float]] | None:
    """Axis -> (value, U) by `accept misalign`, None for no result."""
    done = accept("misalign", unit, "--model", model, "--json", place / "m.json")
    found = json.loads((place / "m.json").read_text())
    assert (done.exit_code == 0) == (found["verdict"] == "pass")
    axes = {axis: (found[axis]["value"], found[axis]["U"]) for axis in ("dx_um", "dy_um")}
    return axes if done.exit_code == 0 else None


@pytest.mark.slow
@pytest.mark.parametrize("model", ["strut", pytest.param("strut-as-built", marks=pytest.mark.soak)])
def test_misalignment_is_estimated_again_on_the_improved_model(
    model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The effect's values are replaced, not added to: what `gap` named and what `misalign` finds are one thing. On the
    model that the unit is made of: its search is the quicker one."""
    monkeypatch.setattr(misalignment, "table_for", lambda m, say, workers: table_for(m, say, 9, 13, 1))
    true = {"dx_um": 25.0, "dy_um": -140.0}
    unit = make_strut(tmp_path / "M-1", "M-1", ("misalignment", true), repeats=False)
    assert accept("gap", unit, "--model", model, "--out", tmp_path / "out").exit_code == 0
    named = json.loads((tmp_path / "out" / "gap.json").read_text())["named"]
    assert [n["effect"] for n in named] == ["misalignment"]
    found = estimated(unit, tmp_path / "out" / "model.toml", tmp_path)
    assert found is not None
    for axis, (value, U) in found.items():
        lo, hi = named[0]["parameters"][axis]["ci95"]
        assert abs(value - named[0]["parameters"][axis]["value"]) <= max(U, hi - lo)
        assert abs(value - true[axis]) <= 1.5 * U  # three standard uncertainties


@needs_data
@pytest.mark.soak
@pytest.mark.parametrize("model", ["strut-as-built", NOMINAL], ids=["as built", "finite elements"])
@pytest.mark.parametrize("serial", ["S-02", "S-04", "S-05"])
def test_recorded_misalignment_on_the_improved_model(
    serial: str, model: object, tmp_path: Path, recorded_units: RecordedUnits
) -> None:
    """On S-04 a mode of the bench allows no estimate before it is in the model."""
    unit = recorded_units.folder(serial)
    true = {"dx_um": 0.0, "dy_um": 0.0} | recorded_units.truth(serial)["effects"].get("misalignment", {})
    assert accept("gap", unit, "--model", model, "--out", tmp_path).exit_code == 0
    before, after = (estimated(unit, m, tmp_path) for m in (model, tmp_path / "model.toml"))
    assert (before is None) == (serial == "S-04")
    assert after is not None
    for axis, (value, U) in after.items():
        assert abs(value - true[axis]) <= 1.5 * U + 0.5


def test_an_improved_model_names_its_matrices_from_where_it_finally_lies(tmp_path: Path) -> None:
    old, new = tmp_path / "worker", tmp_path / "far" / "away" / "out"
    text = b'name = "m"\n[apa]  # of the batch\ntype = "superelement"\nfile = "../matrices/A.mat"\n'
    there = with_moved_paths(text, old, new).decode()
    file = tomllib.loads(there)["apa"]["file"]
    assert (new / file).resolve() == (tmp_path / "matrices" / "A.mat").resolve()
    assert "# of the batch" in there  # nothing else is touched
    plain = b'[apa]\ntype = "frame"\n'
    assert with_moved_paths(plain, old, new) == plain


class TestRefused:
    """Exit 6 and one line that names what is wrong."""

    def refused(self, *arguments: object) -> str:
        done = accept("gap", *arguments)
        assert done.exit_code == 6
        assert done.stdout == ""
        return str(done.stderr)

    def test_no_responses(self, tmp_path: Path) -> None:
        make_unit(tmp_path / "U", "U-1", GOOD.replace('"apa"', '"strut"').split("[flatness]")[0])
        assert "[frf]" in self.refused(tmp_path / "U", "--out", tmp_path / "out")

    def test_unreadable_record(self, gap_run: GapRun, tmp_path: Path) -> None:
        unit = copy(gap_run.unit, tmp_path / "X")
        whole = (unit / "frf_noise.mat").read_bytes()
        (unit / "frf_noise.mat").write_bytes(whole[: len(whole) // 2])
        assert "frf_noise.mat" in self.refused(unit, "--out", tmp_path / "out")

    def test_channel_that_is_not_there(self, gap_run: GapRun, tmp_path: Path) -> None:
        unit = copy(gap_run.unit, tmp_path / "X")
        text = (unit / "unit.toml").read_text()
        (unit / "unit.toml").write_text(text + '\n[channels]\nVa = "nobody"\n')
        assert "nobody" in self.refused(unit, "--out", tmp_path / "out")

    def test_no_such_model_or_unit_or_effect(self, gap_run: GapRun, tmp_path: Path) -> None:
        assert "strut-2dof" in self.refused(gap_run.unit, "--model", "nope", "--out", tmp_path)
        assert "does not exist" in self.refused(tmp_path / "nowhere", "--out", tmp_path)
        assert "misalignment" in self.refused(gap_run.unit, "--without", "misalignmnt", "--out", tmp_path)

    def test_where_nothing_can_be_written(self, gap_run: GapRun, tmp_path: Path) -> None:
        """Said at once, not after the search."""
        (tmp_path / "file").write_text("")
        words = self.refused(gap_run.unit, "--out", tmp_path / "file" / "out")
        assert str(tmp_path / "file") in words
        assert "calibrating" not in words

    def test_two_units_of_one_serial(self, gap_run: GapRun, tmp_path: Path) -> None:
        copy(gap_run.unit, tmp_path / "a")
        copy(gap_run.unit, tmp_path / "b")
        assert "must be unique" in self.refused(tmp_path, "--out", tmp_path / "out")

    @pytest.mark.soak
    @pytest.mark.parametrize("model", ["strut-2dof", "apa-frame"])
    def test_wrong_model_gives_no_name(self, gap_run: GapRun, tmp_path: Path, model: str) -> None:
        done = accept("gap", gap_run.unit, "--model", model, "--out", tmp_path)
        assert done.exit_code == 4
        assert not json.loads((tmp_path / "gap.json").read_text())["named"]


def test_one_realisation_is_said(tmp_path: Path) -> None:
    done = accept("gap", make_strut(tmp_path / "S", "S-1", repeats=False), "--out", tmp_path / "out")
    assert done.exit_code == 0
    assert "so the sensitivity is reduced" in " ".join(done.stdout.split())
    document = json.loads((tmp_path / "out" / "gap.json").read_text())
    assert document["verdict"] == "no_missing_effect"
    assert any("single realisation" in note for note in document["notes"])
    assert "tau_us" in document["detection_limits"]["loop_delay"]


def copy(unit: Path, folder: Path) -> Path:
    folder.mkdir(parents=True)
    for file in unit.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    return folder


@pytest.mark.parametrize(
    ("value", "U", "said"),
    [(0.0822, 2.7, "0.1"), (-0.04, 2.7, "0"), (-133.72, 4.5, "-134"), (53.35, 0.02, "53.4"), (8.0, float("nan"), "8")],
)
def test_a_sentence_tells_no_digit_that_is_not_known(value: float, U: float, said: str):
    values = {"dx_um": value, "dy_um": 1234.5}
    words = EFFECTS["misalignment"].say(values, {"dx_um": U, "dy_um": 0.0})
    assert words == f"The APA sits {said} um (x) and 1234 um (y) beside the axis of the joints."
