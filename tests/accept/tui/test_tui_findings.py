"""Findings of a step at 80 columns: one reason is read once, nothing is cut. Maps: rows have their names."""

import numpy as np

from accept.tui.widgets.findings import findings_text
from accept.tui.widgets.heat_map import map_text
from accept.workflow.state.step_judgement import StepJudgement
from checks.acceptance import CHECKS
from checks.cause import Cause, because
from checks.picture import Image, Panel
from checks.quantity import Quantity
from checks.verdict import judge
from specs.spec import Limit

MOVES = {"channel": "Vs", "reference": "Va", "found": "with", "expected": "against"}
ROOM = 59  # columns beside the list of steps in a terminal of 80


def judged(reversed_sensor: bool) -> StepJudgement:
    names = {"axial_resonance_Hz": 86.173, "x_bending_Hz": 191.963, "y_bending_Hz": 282.048, "z_torsion_Hz": 397.361}
    reason = because(Cause.CHANNEL_REVERSED, **MOVES) if reversed_sensor else None
    found = []
    for name, value in names.items():
        limit = Limit(
            lower=round(0.95 * value, 1), upper=round(1.05 * value, 1), unit="Hz", rule="guarded", source="test"
        )
        quantity = Quantity(name, float("nan"), None, (), reason) if reason else Quantity(name, value, 2e-4 * value)
        found.append(judge("frf", quantity, limit))
    return StepJudgement(1, "strut", "", tuple(found), (), ())


def test_a_reason_of_several_findings_is_read_once() -> None:
    text = findings_text(CHECKS["frf"], judged(reversed_sensor=True)).plain
    assert text.count("sensor stack Vs is reversed") == 1
    assert text.count("as above") == 3
    assert text.count("reverse the connection of sensor stack Vs") == 1


def test_a_row_of_many_findings_fits_beside_the_steps() -> None:
    lines = findings_text(CHECKS["frf"], judged(reversed_sensor=False)).plain.splitlines()
    assert len(lines) == 4
    assert max(map(len, lines)) <= ROOM


def test_rows_have_their_names_from_above_and_the_middle_of_a_logarithmic_axis_is_its_own() -> None:
    z = np.zeros((2, 41))
    z[0, 20:] = 4.0  # the first row, above 100 Hz
    image = Image(np.geomspace(10.0, 1000.0, 41), np.arange(2.0), z, "log10 of G")
    panel = Panel(
        "G", "frequency [Hz]", "", (image,), x_log=True, y_range=(1.5, -0.5), y_names=("de before", "de after")
    )
    lines = map_text(image, panel, width=41, height=4).plain.splitlines()
    assert lines[0].lstrip().startswith("de before")
    assert lines[2].lstrip().startswith("de after")
    assert lines[0].count("█") == 21
    assert "█" not in lines[2] + lines[3]
    assert lines[4].split() == ["10", "100", "1e+03"]
    assert "up:" not in lines[5]
