"""The gap analysis and the estimate of the misalignment agree on value and U; where U differs, both say what they were
fitted to."""

from dataclasses import replace

import pytest

import accept
from accept.gap.report import summary
from accept.gap.text import data_words
from accept.models.model_file import open_model
from checks.gap import Inputs, Result, run
from checks.misalignment import MisalignmentEstimate, estimate_misalignment
from tests.checks.gap.shared.gap_cases import fewer, inputs
from tests.checks.misalignment.misaligned import table_of
from tests.checks.model.units_model import DATA, NOMINAL, needs_data

HIDDEN = {"misalignment": {"dx_um": -60.0, "dy_um": -90.0}}


def estimated(case: Inputs) -> MisalignmentEstimate:
    return estimate_misalignment(case.model, case.A, table_of(case.model, 11, 13), case.B)


def compared(found: Result, off: MisalignmentEstimate) -> list[tuple[float, float]]:
    """For dx and dy: their difference in U of the estimate, and the half-width of the gap's interval in it."""
    (named,) = (n for n in found.named if n.effect == "misalignment")
    both = ((named.parameters["dx_um"], off.dx), (named.parameters["dy_um"], off.dy))
    return [(abs(p.value - along.value) / along.U, (p.hi - p.lo) / 2.0 / along.U) for p, along in both]


def test_on_the_same_data_they_agree() -> None:
    """Both are the fit's standard uncertainty, times 2 and times 1.96; the rest are priors on the drive, which the
    estimate has none of."""
    case = fewer(inputs(6, HIDDEN))
    case = replace(case, A=case.A.select(("de", "da")).band(10, 1000), B=case.B.select(("de", "da")).band(10, 1000))
    off, found = estimated(case), run(case, lambda _: None)
    assert data_words(found.fit) == data_words(off.fit)
    for apart, width in compared(found, off):
        assert apart < 0.1
        assert width == pytest.approx(1.0, abs=0.1)


def test_what_more_data_make_narrower_is_said() -> None:
    case = inputs(6, HIDDEN)
    off, found = estimated(case), run(case, lambda _: None)
    for apart, width in compared(found, off):
        assert apart < 1.0
        assert 0.4 < width < 1.02
    assert data_words(off.fit).startswith("de, da from 10 to ")
    assert data_words(found.fit).startswith("Vs, de, da from 8 to ")
    assert f"fitted to {data_words(found.fit)}" in " ".join(" ".join(summary("X-1", found)).split())


@needs_data
@pytest.mark.parametrize("model", [str(NOMINAL), "strut-as-built"])
def test_a_recorded_unit(model: str) -> None:
    """Red before as a wish only: U differed twofold without a word; tenfold for an axis that hardly shows."""
    unit = accept.read_unit(DATA / "units" / "S-02")
    off, found = accept.estimate_misalignment(unit, model), accept.analyse_gap(unit, model)
    same = open_model(model).scatters
    for apart, width in compared(found.result, off):
        assert apart < 1.0
        assert 0.4 < width < 1.1
        assert not same or width > 0.8
