"""Findings of a step at 80 columns: one reason is read once, nothing is cut. Maps: rows have their names."""

import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from rich.text import Text
from textual.app import App, ComposeResult
from textual.containers import Horizontal

from accept.base.documents.results import Information
from accept.store.payloads import StepJudged
from accept.tui.widgets.findings import findings_text, note_line
from accept.tui.widgets.hanging import Hung
from accept.tui.widgets.heat_map import map_text, side_by_side
from accept.tui.widgets.plan import height_words, plan
from accept.tui.widgets.plot import PanelPlot, PanelView, apart, draw, thin
from checks.acceptance import CHECKS
from checks.cause import Cause, because
from checks.picture import Band, Heights, Image, Line, Panel, PanelKind
from checks.quantity import Quantity
from checks.verdict import judge
from specs.spec import Limit
from specs.units import model_label, with_unit
from tests.accept.tui.tui_help import at_rest

MOVES = {"channel": "Vs", "reference": "Va", "found": "with", "expected": "against"}
ROOM = 59  # columns beside the list of steps in a terminal of 80


def judged(reversed_sensor: bool) -> StepJudged:
    names = {"axial_resonance_Hz": 86.173, "x_bending_Hz": 191.963, "y_bending_Hz": 282.048, "z_torsion_Hz": 397.361}
    reason = because(Cause.CHANNEL_REVERSED, **MOVES) if reversed_sensor else None
    found = []
    for name, value in names.items():
        limit = Limit(
            lower=round(0.95 * value, 1), upper=round(1.05 * value, 1), unit="Hz", rule="guarded", source="test"
        )
        quantity = Quantity(name, float("nan"), None, (), reason) if reason else Quantity(name, value, 2e-4 * value)
        found.append(judge("frf", quantity, limit))
    return StepJudged("frf", 1, tuple(found), (), ())


def test_a_reason_of_several_findings_is_read_once() -> None:
    text = findings_text(CHECKS["frf"], judged(reversed_sensor=True)).plain
    assert text.count("sensor stack Vs is reversed") == 1
    assert text.count("as above") == 3
    assert text.count("reverse the connection of sensor stack Vs") == 1


def test_notes_have_signs_of_units_and_roots() -> None:
    assert note_line("200 um, lower by a factor of sqrt 2, at 5 ohm") == "200 µm, lower by a factor of √2, at 5 Ω"


def test_a_row_of_many_findings_fits_beside_the_steps() -> None:
    more = (Information.of("frf", Quantity("k_resonance_N_per_um", 1.186, 0.012)),)  # its words are long
    judgement = replace(judged(reversed_sensor=False), information=more)
    lines = findings_text(CHECKS["frf"], judgement, whole=True).plain.splitlines()
    assert len(lines) == 5
    assert max(map(len, lines)) <= ROOM
    assert "1 more value" in findings_text(CHECKS["frf"], judgement).plain


def test_a_limit_without_room_stands_whole_on_the_next_line() -> None:
    long = replace(judged(reversed_sensor=False).findings[0], value=-181.234567, U=0.000012)
    judgement = replace(judged(reversed_sensor=False), findings=(long,) * 4)
    lines = findings_text(CHECKS["frf"], judgement).plain.splitlines()
    assert [line.strip() for line in lines if "…" in line] == ["81.9 … 90.5 Hz"] * 4
    assert max(map(len, lines)) <= ROOM


def test_rows_have_their_names_from_above_and_the_middle_of_a_logarithmic_axis_is_its_own() -> None:
    z = np.zeros((2, 41))
    z[0, 20:] = 4.0  # the first row, above 100 Hz
    image = Image(np.geomspace(10.0, 1000.0, 41), np.arange(2.0), z, "log10 of G")
    panel = Panel(
        "G", "frequency [Hz]", "", (image,), x_log=True, y_range=(1.5, -0.5), y_names=("de before", "de after")
    )
    lines = map_text(image, panel, width=41, height=4).plain.splitlines()
    assert lines[0].strip() == "┌" + 41 * "─" + "┐"
    assert lines[1].lstrip().startswith("de before")
    assert lines[3].lstrip().startswith("de after")
    assert lines[1].count("█") == 21
    assert "█" not in lines[3] + lines[4]
    assert lines[6].split() == ["10", "100", "1e+03"]
    assert "up:" not in lines[7]
    assert "log10 of G 0 [ ·░▒▓█] 4" in lines[7]  # the scale


def test_before_and_after_stand_beside_each_other_on_one_scale() -> None:
    z = np.zeros((4, 60))
    z[0, 30:], z[1, 30:], z[2] = 4.0, 2.0, 1.0
    image = Image(np.linspace(1.0, 60.0, 60), np.arange(4.0), z, "G")
    panel = Panel("G", "f [Hz]", "", (image,), y_range=(3.5, -0.5),
                  y_names=("de before", "de after", "da before", "da after"))  # fmt: skip
    lines = side_by_side(image, panel, 100, 6).plain.splitlines()
    assert lines[0].split() == ["before", "after"]
    assert max(map(len, lines)) <= 100
    (row,) = (line for line in lines if "de │" in line)
    left, right = row[:51], row[51:]
    assert "█" in left
    assert "█" not in right  # it is half as high, and not the largest of its own map
    assert "▒" in right or "░" in right
    assert "de before" in side_by_side(image, panel, 44, 8).plain  # where there is no room: rows of one map


def test_points_upon_a_curve_leave_the_curve_to_be_seen():
    x = np.log10(np.linspace(1.0, 1000.0, 600))
    few = apart(x, 40)
    assert 30 <= few.size <= 40  # one of each fortieth; the first of them are wider apart than that on a log axis
    assert few[0] == 0
    assert np.all(np.diff(x[few]) > 0)
    assert apart(x[:20], 40).size == 20


async def test_measured_points_are_on_top_of_the_model_and_both_are_there():
    """A model that fits covered what was measured, or was covered by it."""
    x = np.linspace(0.0, 1.0, 600)
    panel = Panel("ratio", "x", "y", (Line(x, x, "measured", "points", "data"), Line(x, x, "model", role="model")))

    class Shows(App[None]):
        def compose(self) -> ComposeResult:
            yield PanelView(panel, titled=False)

    async with Shows().run_test(size=(100, 30)) as pilot:
        await at_rest(pilot)
        drawn = pilot.app.export_screenshot()
        assert "ratio" not in drawn
    assert 15 <= drawn.count("•") <= 60  # some twenty, and one before its word
    assert any(chr(c) in drawn for c in range(0x2801, 0x2900))  # the curve, in braille


def rows_of(panel: Panel, width: int = 60, height: int = 18) -> list[str]:
    return draw(panel, width, height).text().plain.splitlines()


def test_a_phase_is_read_in_quarters_of_a_turn():
    x = np.linspace(1.0, 100.0, 50)
    panel = Panel("phase", "f [Hz]", "phase [deg]", (Line(x, 3.6 * x - 180.0),), y_range=(-200.0, 200.0))
    for height, expected in ((24, ["180", "90", "0", "−90", "−180"]), (12, ["180", "0", "−180"])):
        assert [row.split(" ┤")[0].strip() for row in rows_of(panel, height=height) if " ┤" in row] == expected


@pytest.mark.parametrize("height", range(6, 19))
@pytest.mark.parametrize(("low", "log"), [(-2.3, True), (-1.0, True), (-4.7, True), (-0.2, False)])
def test_no_two_numbers_stand_on_one_row_nor_run_into_each_other(height: int, low: float, log: bool):
    """0.1 and 0.01 were printed over each other: 00.1."""
    y = np.linspace(low, 0.4, 20)
    line = Line(10.0**y, 10.0**y) if log else Line(y, y)
    for width in range(20, 70, 7):
        rows = rows_of(Panel("", "x", "y", (line,), x_log=log, y_log=log), width, height)
        numbers = [row.split(" ┤")[0].strip() for row in rows if " ┤" in row]
        assert numbers
        assert all(re.fullmatch(r"−?(0|1|2|5|10|25|75|[0-9.]+|([25]·)?10[⁰¹²³⁴⁵⁻]*)", number) for number in numbers)
        assert len(set(numbers)) == len(numbers)
        along = rows[-1].split()[:-1]
        assert len(set(along)) == len(along)


def test_a_value_stands_in_the_cell_of_its_number():
    """The tick of zero and a point at zero are the same cell, and a quarter on is a quarter of the cells on."""
    panel = Panel("", "x", "y", (Line(np.zeros(1), np.zeros(1), style="points"),), x_range=(-1, 1), y_range=(-1, 1))
    rows = rows_of(panel, 65, 28)
    (row,) = (n for n, text in enumerate(rows) if "•" in text)
    assert float(rows[row].split("┤")[0]) == 0.0
    column = rows[row].index("•")
    assert rows[-2][column] == "┴"
    assert rows[-1][column - 1 : column + 2].strip().startswith("0")
    moved = Panel("", "x", "y", (Line(np.full(1, 0.5), np.full(1, 0.5), style="points"),), x_range=(-1, 1),
                  y_range=(-1, 1))  # fmt: skip
    (up,) = (n for n, text in enumerate(rows_of(moved, 65, 28)) if "•" in text)
    left = rows[-2].index("└") + 1
    assert rows_of(moved, 65, 28)[up].index("•") - column == pytest.approx((65 - left) / 4, abs=1.0)
    assert row - up == pytest.approx((28 - 3) / 4, abs=1.0)


def test_a_circle_is_round():
    """A cell of 2 x 4 dots is twice as high as wide: at equal scales a circle is as many dots wide as high."""
    turn = np.linspace(0.0, 2.0 * np.pi, 90)
    circle = Line(50.0 * np.cos(turn), 50.0 * np.sin(turn))
    for width, height in ((40, 20), (70, 18), (30, 28)):
        bits = draw(Panel("", "dx [um]", "dy [um]", (circle,), equal=True), width, height).bits
        across, down = np.ptp(np.flatnonzero(bits.any(axis=0))), np.ptp(np.flatnonzero(bits.any(axis=1)))
        assert across == pytest.approx(down, abs=2.0)
        assert across > 20


def test_two_curves_that_share_a_cell_both_keep_their_dots():
    """One of them had a gap wherever the other one was drawn over it."""
    x = np.linspace(0.0, 1.0, 50)
    level, rising = Line(x, np.full(50, 0.5)), Line(x, x)
    ends = {"x_range": (0.0, 1.0), "y_range": (0.0, 1.0)}
    both, one, other = (
        draw(Panel("", "x", "y", items, **ends), 50, 20).bits for items in ((level, rising), (level,), (rising,))
    )
    assert np.array_equal(both, one | other)
    assert (one.reshape(20, 4, 50, 2).any((1, 3)) & other.reshape(20, 4, 50, 2).any((1, 3))).any()


def test_words_stand_at_their_curve_and_not_at_the_other():
    x = np.linspace(0.0, 100.0, 300)
    rows = rows_of(Panel("", "x", "y", (Line(x, 3.0 * x, "steep one"), Line(x, 0.3 * x, "flat one"))), 70, 24)
    (steep,), (flat,) = ([n for n, row in enumerate(rows) if words in row] for words in ("steep one", "flat one"))
    assert 0 < steep < flat - 5  # in the axes, each near its own


def test_words_without_a_place_at_their_curve_stand_above_the_axes():
    x = np.linspace(0.0, 1.0, 400)
    items = tuple(Line(x, np.sin(90.0 * x + n), f"number {n}") for n in range(3))
    rows = rows_of(Panel("", "x", "y", items), 60, 9)
    assert all(f"number {n}" in "\n".join(rows) for n in range(3))


async def test_a_map_beside_another_picture_stays_in_its_lines():
    """Rows of a fixed width went on in the next line where two pictures share 98 columns."""
    z = np.ones((3, 50))
    z[:, -1] = 9.0
    panel = Panel("G", "f", "", (Image(np.arange(50.0), np.arange(3.0), z),), y_names=("a", "b", "c"))

    class Shows(App[None]):
        def compose(self) -> ComposeResult:
            with Horizontal():
                yield PanelView(panel)
                yield PanelView(panel)

    async with Shows().run_test(size=(98, 30)) as pilot:
        await at_rest(pilot)
        for view in pilot.app.query(PanelPlot):
            rows = str(view.render()).splitlines()
            assert 30 <= max(map(len, rows)) <= view.size.width
            assert sum(row.endswith("█│") for row in rows) == view.size.height - 4


def test_a_narrow_peak_stays_in_a_narrow_map():
    z = np.zeros((1, 300))
    z[0, 137] = 1.0
    item = Image(np.arange(300.0), np.zeros(1), z)
    drawn = map_text(item, Panel("peak", "", "", (item,)), 40, 1).plain.splitlines()
    (row,) = [line.split("│")[1] for line in drawn if "│" in line]
    assert row.count("█") == 1
    assert row[137 * 40 // 300] == "█"


def test_a_title_with_number_and_state_is_one_line_beside_the_steps():
    assert all(len(f"8/8  ? no result  ·  {check.title}") <= ROOM for check in CHECKS.values())


def test_a_long_line_goes_on_below_its_first_letter():
    console = Console(width=12, no_color=True)
    with console.capture() as drawn:
        console.print(Hung(Text("head\n  one two three")))
    assert [line.rstrip() for line in drawn.get().splitlines()] == ["head", "  one two", "  three"]


def test_no_impact_is_lost_among_more_samples_than_columns():
    force = np.zeros(122880)
    force[[7, 60001, 122879]] = 100.0, 80.0, -5.0
    assert set(force[thin(force)]) == {0.0, 100.0, 80.0, -5.0}


async def test_points_on_the_edge_are_drawn_and_so_is_a_zone_of_two_places():
    check = CHECKS["flatness"]
    z = np.array([5.4, -3.0, 4.0, 5.0, 1.0, 2.0, 3.0, 6.0])
    zone = Band(np.array([0.5, 8.5]), np.full(2, z.min()), np.full(2, z.max()), "zone")
    points = Line(np.arange(1.0, 9.0), z, style="points")

    class Shows(App[None]):
        def compose(self) -> ComposeResult:
            yield PanelPlot(Panel(check.title, "time [s]", "", (zone, points)))

    async with Shows().run_test(size=(80, 24)) as pilot:
        await at_rest(pilot)
        rows = ["".join(segment.text for segment in strip) for strip in pilot.app.screen._compositor.render_strips()]
    drawn = "\n".join(rows)
    assert drawn.count("•") == 8
    assert "time [s]" in drawn  # "[s]" is no style
    assert sum(row.count("⠒") + row.count("⠤") + row.count("⠉") + row.count("⣀") > 40 for row in rows) == 2


def test_values_of_a_model_have_words_and_units():
    assert model_label("joint.kRx_Nm_per_rad") == "joints: bending stiffness kRx"
    assert model_label("apa.mode_stiffness_12") == "APA: mode stiffness 12"
    assert with_unit("1 ± 2", "joint.cR_Nm_s_per_rad") == "1 ± 2 N m s/rad"
    assert with_unit("1 ± 2", "apa.damping_ratio") == "1 ± 2"


def test_no_line_is_drawn_across_a_turn_of_the_phase():
    phase = np.array([170.0, 178.0, -179.0, -175.0, 179.0])
    line, ends = Line(np.arange(5.0), phase), {"y_range": (-200.0, 200.0)}
    turned = draw(Panel("", "x", "phase [deg]", (line,), kind=PanelKind.PHASE, **ends), 50, 24).bits
    across = draw(Panel("", "x", "phase [deg]", (line,), **ends), 50, 24).bits
    middle = slice(8 * 4, 14 * 4)
    assert not turned[middle].any()
    assert across[middle].any()


def test_heights_that_lie_close_together_do_not_run_into_each_other():
    """Every number stands whole, with a blank on either side of it."""
    x = np.array([0.0, 0.0, 0.5, 1.0, 30.0])
    y = np.array([0.0, 0.5, 0.5, 0.4, 30.0])
    z = np.array([-12.3456, 7.0, -100.25, 0.0, 3.2])
    drawn = plan(Heights(x, y, z, label="um"), 40).text().plain
    assert {"-12.3", "+7.0", "-100.2", "+0.0", "+3.2"} <= set(drawn.split())
    assert drawn.splitlines()[-1].startswith("µm" if "µm" in drawn else "um")


def test_a_point_without_a_height_is_the_next_one_and_decimal_points_are_aligned():
    z = np.array([0.0, -11.5, np.nan, np.nan])
    x, y = np.array([-20.0, 20.0, 20.0, -20.0]), np.array([9.0, 9.0, -9.0, -9.0])
    words = height_words(z)
    assert words == [" +0.0", "-11.5", "     ", "     "]
    rows = plan(Heights(x, y, z, label="z"), 50, 11).text().plain.splitlines()
    assert "\n".join(rows).count("◉") == 1
    (due,) = (row for row in rows if "◉" in row)
    assert "3 ◉" in due
    upper, lower = (next(n for n, row in enumerate(rows) if f"{k} " in row) for k in (1, 3))
    assert upper < lower  # y upwards
    assert rows[upper].index("1 ") < rows[upper].index("2 ")  # x to the right
