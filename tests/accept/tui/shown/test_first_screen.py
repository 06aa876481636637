"""What must be seen on the first screen: serials that are whole, the room used, what to do where there is nothing."""

from pathlib import Path

import pytest
from textual.pilot import Pilot

from accept.tui.widgets.bench.units_table import UnitsTable
from accept.tui.widgets.limit_bar import share_bar
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.begin import Begun
from accept.workflow.worker.judging import judge_step, judge_whole_unit
from checks.declare import Measured
from tests.accept.tui.tui_help import HEIGHTS, loader, press, running, words
from tests.shared.kept_folder import KeptFolder, kept

LONG = "APA-2026-" + "8" * 40
VALUES = {
    "flatness": [("z_um", n, float(z)) for n, z in enumerate(HEIGHTS.split())],
    "capacitance": [("sensor_uF", None, 4.99), ("actuator_uF", None, 9.85)],
    "stroke": [("stroke_um", None, 365.5)],
    "stiffness": [("k_N_per_um", None, 1.75)],
}
USED, ROOM = 0.6, (120, 36)


def measure(bench: Workbench, serial: str, count: int, held: str = "") -> None:
    """Take and judge the first steps of a unit; of all of them, the unit too."""
    session, _ = bench.open_unit(Begun(serial, "apa", "Ann"))
    for step in list(VALUES)[:count]:
        for name, index, value in VALUES[step]:
            session.entries.take(step, session.step(step).check.inputs[name], Measured(value), index=index)
        judge_step(session, step)
    if held:
        session.entries.note("capacitance", held, nonconformance=True)
    if count == len(VALUES):
        judge_whole_unit(session)
    session.close()


def measure_ten(_: Path) -> None:
    bench = loader()()
    for n in range(8):
        measure(bench, f"APA-{n:02d}", 4 if n == 0 else n % 3)
    measure(bench, "APA-21", 2, "flexure cracked")
    measure(bench, LONG, 1)
    bench.store.close()


ten_units = kept(measure_ten)


@pytest.fixture
def units(ten_units: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    ten_units.put_back(monkeypatch)


def seen(pilot: Pilot[None]) -> list[str]:
    return [strip.text for strip in pilot.app.screen._compositor.render_strips()]


def column(pilot: Pilot[None], name: str) -> list[str]:
    return [str(cell).rstrip() for cell in pilot.app.screen.query_one(UnitsTable).get_column(name)]


@pytest.mark.parametrize("size", [(100, 30), ROOM, (200, 60)], ids=lambda size: str(size[0]))
async def test_no_serial_is_cut_and_every_unit_has_a_mark_per_step(units: None, size: tuple[int, int]) -> None:
    async with running(size=size) as pilot:
        assert LONG in column(pilot, "Serial")
        assert any(LONG in row for row in seen(pilot))
        marks = dict(zip(column(pilot, "Serial"), column(pilot, "Steps"), strict=True))
        assert (marks["APA-00"], marks["APA-21"], marks[LONG]) == ("✓ ✓ ✓ ✓", "✓ ! ◉ ·", "✓ ◉ · ·")


async def test_the_rows_of_a_screen_of_usual_size_are_used(units: None) -> None:
    async with running(size=ROOM) as pilot:
        inside = [row.strip(" │") for row in seen(pilot)]
        assert sum(any(map(str.isalnum, row)) for row in inside) >= USED * ROOM[1]
        right = [row[31:].strip(" │╭╮╰╯─") for row in seen(pilot)]  # beside the cards on the left
        assert sum(map(bool, right)) >= USED * ROOM[1]


async def test_the_unit_under_the_cursor_has_its_findings_inside_their_limits(units: None) -> None:
    async with running(size=ROOM) as pilot:
        await press(pilot, *"APA-00", "backspace", "0")
        card = words(pilot, "#unit-card")
        assert "✓ Sensor stack" in card
        assert "4.990 ± 0.025 µF" in card
        assert "┃" in card
        assert "accepted, to sign" in card
        await press(pilot, "ctrl+u", *"APA-21")
        assert "note  “flexure cracked”" in words(pilot, "#unit-card")
        assert pilot.app.screen.query_one("#unit-card").has_class("bad")


async def test_the_week_counts_what_was_begun_and_says_nothing_that_nobody_measured(units: None) -> None:
    async with running(size=ROOM) as pilot:
        week = words(pilot, "#week").split("\n")
        counts = {row.split()[0]: row.split()[-1] for row in week[1:5]}
        assert counts == {"accepted": "1", "rejected": "0", "held": "1", "open": "8"}
        assert "drift" not in words(pilot, "#week")  # of one value
        assert "1 of 10" in str(pilot.app.screen.query_one("#week").border_title)


def test_the_bar_of_the_week_has_the_colour_of_each_verdict_and_no_rejected_unit_is_lost_in_it() -> None:
    """Red before: it was green for rejected units too."""
    bar = share_bar([(39, "green"), (1, "bold red"), (0, "yellow")], 80, 26)
    assert [(bar.plain[span.start : span.end], span.style) for span in bar.spans] == [
        ("━" * 13, "green"),
        ("━", "bold red"),
        ("┄" * 12, "dim"),
    ]


@pytest.mark.parametrize("size", [(80, 24), ROOM])
async def test_where_there_is_nothing_it_is_said_what_to_do(size: tuple[int, int]) -> None:
    async with running(size=size) as pilot:
        shown = "\n".join(seen(pilot))
        assert "No units yet." in shown
        assert "F6: scan a whole tray" in shown
        await press(pilot, *"APA-01")
        assert "APA-01 is a new unit of kind apa. Enter: begin it" in "\n".join(seen(pilot))


async def test_a_small_screen_has_the_counts_in_a_line_and_the_shown_queue_among_them(units: None) -> None:
    async with running(size=(80, 24)) as pilot:
        assert not pilot.app.screen.query_one("#left").display
        assert words(pilot, "#counts").startswith(" All units 10  To sign 1  Held for QA 1")
        await press(pilot, "shift+tab")
        assert "Stiffness 9" in seen(pilot)[1]
