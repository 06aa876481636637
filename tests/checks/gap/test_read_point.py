"""A ruler that is read beside its place, by more than its prior allows, on struts of the independent simulation."""

from dataclasses import replace
from pathlib import Path

import pytest

from accept.gap.analyse_unit import run_gap
from validation.model_files import write_model
from validation.sets import SETS, draw_set

OFF_MM = (-4.0, 5.0)  # from where the drawing has it; the prior's sd are 0.5 and 1 mm


@pytest.mark.needs_data
def test_a_ruler_read_beside_its_place_is_named(tmp_path: Path) -> None:
    case = next(c for b in draw_set("batch", 21, 40) for c in b.judge if not c.effects and not c.outside)
    strut = case.strut
    assert strut.ruler_x is not None
    assert strut.ruler_y is not None
    x, y = strut.ruler_x + 1e-3 * OFF_MM[0], strut.ruler_y + 1e-3 * OFF_MM[1]
    folder = replace(case, strut=replace(strut, ruler_x=x, ruler_y=y)).write(tmp_path)
    gap = run_gap(folder, write_model(SETS["batch"], tmp_path / "model"), None)
    assert gap["verdict"] == "explained"
    (named,) = gap["named"]
    assert named["effect"] == "encoder_read_point"
    for key, metres, stated in (("x_mm", x, 4.0), ("y_mm", y, 15.0)):
        lo, hi = named["parameters"][key]["ci95"]
        assert lo < 1e3 * metres - stated < hi
        assert hi - lo < 6.0  # four prior sd of y, which the effect is told from
