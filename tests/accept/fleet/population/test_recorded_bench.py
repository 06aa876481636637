"""The recorded bench L: what it adds is learned from its struts, and a misaligned one is then measured."""

import json
from pathlib import Path

import pytest

from accept.analysis.misalignment import estimate_unit
from accept.fleet.population.bench import latencies
from accept.fleet.population.learn import LearnedPopulation, learn, measured_units
from accept.fleet.population.report import write_population
from accept.models.model_file import open_model_file
from accept.units.unit_folder import read
from tests.checks.model.units_model import DATA
from validation.model_files import write_model
from validation.sets import SETS

LABORATORY = DATA / "laboratory"
MATES = ("L-01", "L-02", "L-03", "L-05")  # of L-04; L-05 has an effect of its own
pytestmark = [
    pytest.mark.needs_data,
    pytest.mark.slow,
]


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LearnedPopulation]:
    out = tmp_path_factory.mktemp("bench")
    given = open_model_file(write_model(SETS["scatter-1"], out))
    found = learn(measured_units([LABORATORY / s for s in MATES], given), given, lambda _: None)
    write_population(out / "population.toml", found)
    return out / "population.toml", found


def test_latencies_are_those_of_converters_amplifier_and_filter(learned: tuple[Path, LearnedPopulation]) -> None:
    """Lags of first order far above the band delay by 1/(2 pi f). That is true up to a tenth of their corner: at
    2 kHz of 12 kHz the delay is a hundredth less."""
    bench = json.loads((LABORATORY / "truth.json").read_text())["L-01"]["bench"]
    late = {c: tau + 1e6 / (2 * 3.14159265 * bench["amplifier_Hz"]) for c, tau in bench["skew_us"].items()}
    late["Vs"] += 1e6 / (2 * 3.14159265 * bench["antialias_Vs_Hz"])
    for channel, (tau, U, _) in latencies(learned[1]).items():
        assert abs(tau - late[channel]) < U + 0.01 * late[channel], channel
        assert U < 2.0, channel


def test_the_one_with_an_effect_does_not_belong(learned: tuple[Path, LearnedPopulation]) -> None:
    assert [j.serial for j in learned[1].judged if not j.belongs] == ["L-05"]
    for unit in learned[1].judged:
        if unit.belongs:
            assert max(unit.G_before.values()) > 100.0
            assert max(unit.G_left_out.values()) < 1.5, unit.serial


def test_a_misaligned_strut_is_measured_within_U(learned: tuple[Path, LearnedPopulation]) -> None:
    truth = json.loads((LABORATORY / "truth.json").read_text())["L-04"]["effects"]["misalignment"]
    found = estimate_unit(read(LABORATORY / "L-04"), str(learned[0]))
    for name, along in (("dx_um", found.dx), ("dy_um", found.dy)):
        assert abs(along.value - truth[name]) < along.U < 15.0, name
