"""What is left when a search ends, and whether a name beside it may stand."""

import os
from pathlib import Path

import pytest

from accept.gap.analyse_unit import run_gap
from checks.gap.decision.gates import BEYOND_CHANCE, matters_without_band
from checks.gap.modelling.thresholds import THRESHOLDS
from checks.gap.statistics.adequacy import Adequacy, ExcessBand
from validation.model_files import write_model
from validation.sets import SETS, draw_set

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
BAND = ExcessBand("de", 3, 7, 100.0, 120.0, 1e-6, 9.0)
CHANCE = BEYOND_CHANCE * THRESHOLDS.p_global


@pytest.mark.parametrize(
    ("p", "windows", "G_before", "weighs"),
    [
        (0.5 * CHANCE, (), 100.0, True),
        (2.0 * CHANCE, (), 100.0, False),  # one right explanation in a thousand leaves as much
        (2.0 * CHANCE, (), 0.9 * THRESHOLDS.G, True),  # the tolerance could have held it
        (
            0.5 * CHANCE,
            (BAND,),
            0.5,
            False,
        ),  # it lies somewhere, and another gate looks there
    ],
)
def test_what_lies_nowhere_weighs(p: float, windows: tuple[ExcessBand, ...], G_before: float, weighs: bool) -> None:
    assert matters_without_band(Adequacy(p, windows, {}), G_before, THRESHOLDS) is weighs


@pytest.mark.skipif(not SOAK, reason="ten seconds: runs in make soak")
def test_a_second_mass_on_the_encoder_is_no_misalignment(tmp_path: Path) -> None:
    """Of 7 um in dy, G 1.3 to 0.6: it was named so in a blind run."""
    case = next(c for b in draw_set("scatter-2", 20261129) for c in b.judge if c.serial == "scatter-2-026")
    assert "second_mass_on_encoder" in case.outside
    gap = run_gap(case.write(tmp_path), write_model(SETS["scatter-2"], tmp_path / "model"), None)
    assert not gap["named"]
