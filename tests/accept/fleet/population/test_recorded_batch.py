"""The recorded batch: learned from P-01 to P-05, the model answers P-06 to P-08 as `truth.json` says. It takes minutes
of one core: with ACCEPT_SOAK=1 only."""

import json
from pathlib import Path
from typing import Any

import pytest

from accept.fleet.population.learn import LearnedPopulation, learn, measured_units
from accept.fleet.population.report import document, write_population
from accept.gap.analyse_unit import run_gap
from accept.models.model_file import open_model_file
from tests.checks.model.units_model import DATA
from validation.model_files import write_model
from validation.sets import SETS

BATCH = DATA / "population"
LEARN = [f"P-0{i}" for i in range(1, 6)]
pytestmark = [
    pytest.mark.needs_data,
    pytest.mark.soak,
]


def truth(serial: str) -> dict[str, Any]:
    return json.loads((BATCH / "truth.json").read_text())[serial]


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LearnedPopulation]:
    out = tmp_path_factory.mktemp("learned")
    given = open_model_file(
        write_model(SETS["batch"], out)
    )  # the file of the recorded units, with scatter and a ruler of its own
    found = learn(measured_units([BATCH / s for s in LEARN], given), given, lambda words: None)
    write_population(out / "population.toml", found)
    return out / "population.toml", found


def answer(model: Path, serial: str) -> dict[str, Any]:
    return run_gap(BATCH / serial, model)


def test_units_without_an_effect_belong(learned: tuple[Path, LearnedPopulation]) -> None:
    assert [j.serial for j in learned[1].judged if not j.belongs] == []
    assert learned[1].holds


def test_the_ruler_is_found_where_it_is(learned: tuple[Path, LearnedPopulation]) -> None:
    """1 mm beside the head in every strut, which the file does not say: in the mean of the batch, within U."""
    p = document(learned[1])["parameters"]["encoder.ruler_arm_y_mm"]
    true = sum(truth(s)["nominal"]["arm_ruler_mm"][1] for s in LEARN) / len(LEARN)
    assert abs(p["mean"] - true) < p["U"] < 1.0


def test_a_misaligned_strut_is_named_with_an_interval_that_covers(learned: tuple[Path, LearnedPopulation]) -> None:
    """dx to 5 um and dy to 3, as asked of a learned model."""
    (named,) = answer(learned[0], "P-06")["named"]
    assert named["effect"] == "misalignment"
    for axis, most in (("dx_um", 5.0), ("dy_um", 3.0)):
        true, said = truth("P-06")["effects"]["misalignment"][axis], named["parameters"][axis]
        assert said["ci95"][0] <= true <= said["ci95"][1]
        assert abs(said["value"] - true) < most


def test_a_mode_of_the_bench_is_named(learned: tuple[Path, LearnedPopulation]) -> None:
    (named,) = answer(learned[0], "P-07")["named"]
    assert named["effect"] == "bench_mode"
    true = truth("P-07")["effects"]["bench_mode"]["f_Hz"]
    assert named["parameters"]["f_Hz"]["value"] == pytest.approx(true, rel=5e-3)


def test_what_is_outside_the_library_gets_no_name(learned: tuple[Path, LearnedPopulation]) -> None:
    said = answer(learned[0], "P-08")
    assert said["named"] == []
    assert said["verdict"] in ("unexplained", "partly_explained")
    assert {u["channel"] for u in said["unnamed"]} == {"Vs"}
