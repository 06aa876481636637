"""The summary: gauges in one table, the signature and the certificate beside it, its page behind a key."""

from dataclasses import replace
from pathlib import Path

import pytest
from textual.widgets import DataTable

from accept.tui.background.viewer import viewer
from accept.tui.screens import summary
from accept.tui.screens.ask import Question
from accept.tui.screens.summary import aligned, folded
from accept.tui.widgets.limit_bar import LIMIT, VALUE
from accept.tui.widgets.plot import PanelView
from checks.verdict import Verdict
from tests.accept.tui.tui_help import begin, fill_values, loader, press, running, settled, sign_first, words


@pytest.mark.parametrize("size", [(80, 24), (120, 36), (200, 60)], ids=str)
async def test_every_finding_has_its_gauge_and_no_cell_is_cut(size: tuple[int, int]) -> None:
    async with running(size=size) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        table = pilot.app.screen.query_one("#findings", DataTable)
        rows = [[str(cell) for cell in table.get_row_at(n)] for n in range(table.row_count)]
        assert len(rows) == 5
        assert all(LIMIT in row[3] and VALUE in row[3] for row in rows)
        seen = "\n".join(strip.text for strip in pilot.app.screen._compositor.render_strips())
        assert all(cell.strip() in seen for row in rows for cell in row)
        assert len({row[2].index("±") for row in rows if "±" in row[2]}) == 1
        if size[0] >= 120:
            assert "Ann  APA-02 ACCEPTED" in seen
            assert "^S Sign and verify" in seen


async def test_a_gauge_gives_way_before_a_verdict() -> None:
    """Red before: `Verdict` was left out at 120 columns, beside empty rows."""
    async with running(loader("apa"), (120, 36)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        table = pilot.app.screen.query_one("#findings", DataTable)
        titles = ["", "Quantity", "Value ± U", "Limits", "Verdict"]
        assert [str(column.label) for column in table.ordered_columns] == titles
        await pilot.resize_terminal(60, 36)
        await settled(pilot)
        assert [str(column.label) for column in table.ordered_columns] == [*titles[:3], titles[4]]


async def test_the_chip_beside_the_verdict_is_pressed_by_a_click() -> None:
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        rows = [strip.text for strip in pilot.app.screen._compositor.render_strips()]
        row = next(n for n, row in enumerate(rows) if "^S Sign and verify" in row)
        await pilot.click(offset=(rows[row].index("^S Sign and"), row))
        await settled(pilot)
        assert isinstance(pilot.app.screen, Question)


async def test_the_verdict_has_its_room_beside_the_bar_of_scrolling() -> None:
    """Red before: `conditional` lost its last letters where the rows are more than the table's."""
    async with running(loader("apa"), (80, 22)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        table = pilot.app.screen.query_one("#findings", DataTable)
        assert table.max_scroll_y > 0
        assert len(table.ordered_columns) == 5
        assert table.virtual_size.width <= table.scrollable_content_region.width


async def test_the_row_under_the_cursor_is_told_with_limits_requirement_and_instrument() -> None:
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9", "down")
        told = words(pilot, "#detail")
        assert told.startswith("4.4 … 5.5 µF   Sensor stack: passes if")
        assert "limits: [STB] 2.2" in told
        assert "LCR-819" in told


async def test_the_steps_of_the_certificate_tick_off_and_its_page_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Path] = []
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        assert words(pilot, "#ticks").split() == ["○", "sign", "○", "store", "○", "verify", "○", "QA"]
        await sign_first(pilot)
        assert words(pilot, "#ticks").split() == ["✓", "sign", "✓", "store", "✓", "verify", "○", "QA"]
        assert "✓ Ann, technician" in words(pilot, "#who")
        monkeypatch.setattr(summary, "viewer", lambda: ("see",))
        monkeypatch.setattr(summary, "open_file", lambda command, path: opened.append(path))
        await press(pilot, "ctrl+e")
        assert opened == [Path(pilot.app.session.attempt.certificate)]
        monkeypatch.setattr(summary, "viewer", lambda: ())
        await press(pilot, "ctrl+e")
        assert "No viewer here. The certificate is" in words(pilot, "#status")
        assert str(opened[0]) in words(pilot, "#status")
        assert len(opened) == 1


async def test_an_evaluation_that_was_stopped_names_the_way_on(monkeypatch: pytest.MonkeyPatch) -> None:
    async with running() as pilot:
        await begin(pilot)
        await fill_values(pilot)
        session, kept = pilot.app.session, []
        monkeypatch.setattr(type(session.judgements), "result", property(lambda self: kept[-1] if kept else None))
        await press(pilot, "f9")
        screen = pilot.app.screen
        screen.dialogue = summary.dialogue.not_judged(screen.dialogue).state
        await screen.draw()
        await settled(pilot)
        assert "F8: evaluate again, Esc: back to the steps" in words(pilot, "#verdict")
        assert "F8 Again" in "\n".join(strip.text for strip in screen._compositor.render_strips()[-3:])


def test_uncertainties_stand_below_each_other() -> None:
    assert aligned(["4.45 ± 0.27 µm", "361 ± 1.1 µm", "-"]) == ["4.45 ± 0.27 µm", " 361 ± 1.1 µm ", "   -          "]


def test_a_page_is_shown_where_somebody_sees_it(tmp_path: Path) -> None:
    program = tmp_path / "xdg-open"
    program.touch(mode=0o755)
    at_desk = {"PATH": str(tmp_path), "DISPLAY": ":0"}
    assert list(viewer(at_desk, "linux")) == [str(program)]
    assert viewer({**at_desk, "SSH_CONNECTION": "10.0.0.1"}, "linux") == ()
    assert viewer({"PATH": str(tmp_path)}, "linux") == ()  # no desktop
    assert viewer({"PATH": "", "DISPLAY": ":0"}, "linux") == ()  # none that opens files
    assert viewer({}, "darwin") == ("open",)


async def test_every_finding_has_its_gauge_beside_the_longest_verdict() -> None:
    """Red before: of a conditional unit no gauge was drawn at 120 columns."""
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        screen = pilot.app.screen
        facts = screen.dialogue.facts
        first, second, *others = facts.result.findings
        findings = (
            replace(first, value=0.39733, U=0.000096, verdict=Verdict.CONDITIONAL),
            replace(second, value=278.691, U=0.056, verdict=Verdict.CONDITIONAL),
            *others,
        )
        screen.dialogue = replace(
            screen.dialogue, facts=replace(facts, result=replace(facts.result, findings=findings))
        )
        screen._show_table(0)
        table = screen.query_one("#findings", DataTable)
        rows = [[str(cell) for cell in table.get_row_at(n)] for n in range(table.row_count)]
        assert rows[0][-1] == "conditional"
        assert all(len(row) == 5 and LIMIT in row[3] for row in rows)


async def test_a_table_behind_a_question_is_as_wide_as_its_card() -> None:
    """Red before: it kept the widths of the terminal before."""
    async with running(size=(200, 60)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9", "ctrl+s")
        below = pilot.app.screen_stack[-2]
        for size in ((120, 36), (80, 24), (120, 36)):
            await pilot.resize_terminal(*size)
            await settled(pilot)
            room = below.query_one("#found").size.width
            assert room - 3 <= below.query_one("#findings").virtual_size.width <= room


async def test_a_large_summary_has_the_pictures_of_the_unit() -> None:
    """Red before: two thirds of it were empty. An arrow draws none of them anew."""
    async with running(size=(200, 60)) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        (picture,) = pilot.app.screen.query(PanelView)  # typed values have no others
        assert picture.display
        assert picture.size.height > 20
        await press(pilot, "down")
        assert pilot.app.screen.query_one(PanelView) is picture
        await pilot.resize_terminal(*(120, 36))
        await settled(pilot)
        assert not pilot.app.screen.query(PanelView)


@pytest.mark.parametrize(("path", "lines"), [
    ("in /tmp/training/certificates", ["in /tmp/training/", "certificates"]),
    ("in /a/b", ["in /a/b"]),
    ("in /a-folder-that-is-longer-than-this/b", ["in /", "a-folder-that-is-longer-than-this/", "b"]),
])  # fmt: skip
def test_a_path_is_broken_between_its_folders(path: str, lines: list[str]) -> None:
    """Red before: `/training/certificat` and `es`."""
    assert folded(path, 20).split("\n") == lines
