"""The offset of an APA as a target: a place lies in the cell of the scale, and the mechanic is told the way back."""

import numpy as np
import pytest

from accept.pictures.scale import scales
from accept.tui.widgets.plot import draw
from accept.tui.widgets.target import offset_panel, way_back
from checks.verdict import Finding, Verdict

WIDTH, HEIGHT, ABOVE, BELOW = 60, 30, 1, 2


def found(quantity: str, value: float | None, U: float | None, limit: float) -> Finding:
    inside = value is not None and abs(value) + (U or 0.0) <= limit
    verdict = Verdict.PASS if inside else Verdict.FAIL
    return Finding("misalignment", quantity, value, "um", U, -limit, limit, "guarded", verdict, 0.0, None)


def offset(x: float, y: float, U: tuple[float | None, float | None] = (28.0, 6.0)) -> tuple[Finding, Finding]:
    return found("dx_um", x, U[0], 50.0), found("dy_um", y, U[1], 100.0)


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.0, 149.8), (-120.0, 40.0), (33.0, -200.0), (600.0, 5.0)])
def test_the_offset_stands_in_the_cell_of_the_scale(x: float, y: float) -> None:
    panel = offset_panel(offset(x, y), [{"dx_um": 5.0, "dy_um": 20.0}])
    rows = draw(panel, WIDTH, HEIGHT).text().plain.splitlines()
    left = rows[-2].index("└") + 1
    along, up = scales(panel, WIDTH - left, 2.0 * (HEIGHT - ABOVE - BELOW))
    (at,) = [(row, line.index("◆")) for row, line in enumerate(rows) if "◆" in line]
    assert at[1] - left == pytest.approx(float(along.at(x)) * (WIDTH - left), abs=1.0)
    assert at[0] - ABOVE == pytest.approx((1.0 - float(up.at(y))) * (HEIGHT - ABOVE - BELOW), abs=1.0)
    # a um is as long both ways: a cell is twice as high as wide
    assert (along.hi - along.lo) / (WIDTH - left) == pytest.approx((up.hi - up.lo) / (HEIGHT - ABOVE - BELOW) / 2.0)


def test_the_box_is_that_of_the_limits_and_the_ellipse_that_of_U() -> None:
    lines = {line.label: line for line in offset_panel(offset(10.0, 149.8)).items if hasattr(line, "label")}
    box, ellipse = lines["allowed"], lines["± U"]
    assert (box.x.min(), box.x.max(), box.y.min(), box.y.max()) == (-50.0, 50.0, -100.0, 100.0)
    assert np.ptp(ellipse.x) == pytest.approx(56.0, rel=1e-2)
    assert np.ptp(ellipse.y) == pytest.approx(12.0, rel=1e-2)
    assert ellipse.role == "bad"


def test_units_before_are_there_if_the_store_has_them() -> None:
    before = [{"dx_um": 5.0, "dy_um": 20.0}, {"stroke_um": 1.0}, {"dx_um": -4.0, "dy_um": 3.0}]
    (points,) = [i for i in offset_panel(offset(0, 0), before).items if getattr(i, "style", "") == "points"]
    assert list(zip(points.x, points.y, strict=True)) == [(5.0, 20.0), (-4.0, 3.0)]
    assert points.label == "2 units before"
    assert not [i for i in offset_panel(offset(0, 0)).items if getattr(i, "style", "") == "points"]


@pytest.mark.parametrize(
    ("at", "words", "head"),
    [
        ((-0.1, 149.8), "Move the APA by 150 µm towards -y", "▼"),
        ((0.0, -149.8), "Move the APA by 150 µm towards +y", "▲"),
        ((-120.0, 40.0), "Move the APA by 120 µm towards +x and 40 µm towards -y", "▶"),
        ((10.0, 20.0), "", "◆"),  # allowed
        ((27.0, 97.0), "Move the APA by 97 µm towards -y", "▼"),  # dx lies within its U of the axis
    ],
)
def test_the_mechanic_is_told_the_way_back(at: tuple[float, float], words: str, head: str) -> None:
    assert way_back(offset(*at)) == words
    panel = offset_panel(offset(*at))
    said = [item.words for item in panel.items if getattr(item, "words", "").startswith("Move")]
    assert said == ([words] if words else [])
    drawn = {item.words for item in panel.items if len(getattr(item, "words", "")) == 1}
    assert drawn == {"◆", head}


def test_without_a_value_there_is_no_target_and_without_U_no_ellipse_and_no_way() -> None:
    assert offset_panel((found("dx_um", None, None, 50.0), found("dy_um", 3.0, 1.0, 100.0))) is None
    assert offset_panel((found("dy_um", 3.0, 1.0, 100.0),)) is None
    findings = offset(0.0, 149.8, (None, None))
    assert way_back(findings) == ""
    assert "± U" not in [getattr(i, "label", "") for i in offset_panel(findings).items]


def test_the_sentence_is_whole_where_there_is_little_room() -> None:
    drawn = draw(offset_panel(offset(-120.0, 140.0)), 34, 20).text().plain
    assert "Move the APA by 120" in drawn
    assert "towards -y" in " ".join(drawn.split())
