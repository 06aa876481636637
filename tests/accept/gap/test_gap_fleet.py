"""What several units have in common belongs to the bench; what one has to that strut."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.gap.fleet import common, lines
from tests.checks.gap.shared.gap_units import make_strut
from tests.soak import SOAK


def unit(serial: str, verdict: str = "explained", **effects: tuple[float, float]) -> dict[str, Any]:
    """gap.json of a unit: effect = (value, half of its 95 % interval)."""
    named = [
        {"effect": e, "parameters": {"x": {"value": v, "ci95": [v - half, v + half]}}}
        for e, (v, half) in effects.items()
    ]
    return {"serial": serial, "verdict": verdict, "named": named}


def names(rows: list[dict[str, Any]]) -> list[str]:
    return [row["effect"] for row in rows]


class TestCommon:
    def test_one_value_in_all_is_the_benchs(self) -> None:
        found = common([unit(s, bench_mode=(110.0 + d, 0.5)) for s, d in (("A", 0.1), ("B", -0.2), ("C", 0.0))])
        assert names(found["common"]) == ["bench_mode"]
        x = found["common"][0]["parameters"]["x"]
        assert x["value"] == pytest.approx(109.967, abs=1e-3)  # the mean: all weigh the same
        assert x["hi"] - x["value"] == pytest.approx(0.5 / 3**0.5, rel=1e-3)

    def test_another_value_in_each_is_the_struts(self) -> None:
        found = common([unit("A", misalignment=(100.0, 3.0)), unit("B", misalignment=(-40.0, 3.0))])
        assert (names(found["common"]), names(found["single"])) == ([], ["misalignment"])
        assert "values differ" in lines(found)[1]

    def test_an_explained_unit_without_it_clears_the_bench(self) -> None:
        units = [unit(s, bench_mode=(110.0, 1.0)) for s in "AB"] + [unit("C", "no_missing_effect")]
        found = common(units)
        assert names(found["single"]) == ["bench_mode"]
        assert found["single"][0]["without"] == ["C"]

    def test_an_unexplained_unit_says_nothing(self) -> None:
        found = common([unit(s, bench_mode=(110.0, 1.0)) for s in "AB"] + [unit("C", "unexplained")])
        assert names(found["common"]) == ["bench_mode"]
        assert found["common"][0]["undecided"] == ["C"]
        assert any("C" in line and "undecided" in line for line in lines(found))

    @pytest.mark.parametrize("silent", [2, 3])
    def test_more_than_half_must_have_it(self, silent: int) -> None:
        units = [unit(s, bench_mode=(110.0, 1.0)) for s in "AB"] + [unit(str(n), "unexplained") for n in range(silent)]
        assert not common(units)["common"]

    def test_one_unit_has_nothing_in_common(self) -> None:
        assert not common([unit("A", bench_mode=(110.0, 1.0))])["common"]
        assert lines(common([unit("A")])) == ["fleet of 1: A", "  no effect was named"]


@pytest.mark.slow
def test_fleet_of_simulated_struts(tmp_path: Path) -> None:
    """The bench's high-pass is in both, a delay in one."""
    shared = ("sensor_highpass", {"f_Hz": 4.0})
    make_strut(tmp_path / "units" / "F-1", "F-1", shared, seed=1)
    make_strut(tmp_path / "units" / "F-2", "F-2", shared, *([("loop_delay", {"tau_us": 150.0})] * SOAK), seed=2)
    model = ("--model", "strut")  # they are made of it; the quicker search does for what a fleet is about
    done = CliRunner().invoke(app, ["gap", "--fleet", str(tmp_path / "units"), *model, "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "out" / "fleet.json").read_text())
    assert found["units"] == ["F-1", "F-2"]
    assert names(found["common"]) == ["sensor_highpass"]
    shown = found["common"][0]["parameters"]["f_Hz"]
    assert shown["lo"] <= 4.0 <= shown["hi"] or abs(shown["value"] - 4.0) < shown["hi"] - shown["lo"]
    assert names(found["single"]) == (["loop_delay"] if SOAK else [])
    assert "of the bench: sensor highpass" in done.stdout
    assert (tmp_path / "out" / "F-2" / "model.toml").is_file()
