"""What a new user stumbled over: counts that differ, gauges without room, keys without a use, borders that are gone."""

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.text import Text
from textual.events import Key, MouseDown, MouseUp
from textual.pilot import Pilot
from textual.widget import Widget
from textual.widgets import DataTable

from accept.tui.screens.ask import Choice, Question
from accept.tui.screens.plots import Plots
from accept.tui.screens.start import Given
from accept.tui.screens.summary import aligned
from accept.tui.widgets.hanging import Hung
from accept.tui.widgets.heat_map import map_text
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.limit_bar import alike
from accept.tui.widgets.plan import height_words, plan
from accept.tui.widgets.plot import draw
from accept.tui.widgets.step_list import StepList
from checks.picture import Heights, Image, Line, Panel
from tests.accept.tui.shown.test_tui_layout import HAMMER, hammer_record, seen, to_hammer
from tests.accept.tui.tui_help import (
    begin,
    fill_values,
    focused_again,
    loader,
    press,
    running,
    settled,
    sign_first,
    title,
    type_line,
    words,
)

ROOM = (120, 36)


def keys(pilot: Pilot[None]) -> set[str]:
    return {shown.cap for shown in pilot.app.screen.query_one(KeyRow).keys}


async def test_list_and_card_count_the_same_entries(tmp_path: Path) -> None:
    """Red before: of four records of the hammer the list had `1 of 1` after the first."""
    async with running(loader("apa", tmp_path), ROOM) as pilot:
        await to_hammer(pilot)
        for n, place in enumerate(HAMMER[:2], 1):
            hammer_record(tmp_path / f"{place}.mat", n)
            pilot.app.focused.value = f"{place}.mat"
            await press(pilot, "enter")
            assert f"{n} of 4" in title(pilot, "#entries")
            assert str(pilot.app.screen.query_one(StepList).get_cell("spurious_modes", "title")).endswith(f"{n} of 4")


async def test_what_is_optional_is_counted_apart() -> None:
    async with running(loader("apa"), ROOM) as pilot:
        await begin(pilot, "APA-01")
        pilot.app.screen.query_one(StepList).stand_at("frf")
        await press(pilot, "enter")
        assert "0 of 2 · 7 optional" in title(pilot, "#entries")


async def test_gauges_of_the_summary_have_the_room_that_there_is() -> None:
    """Red before: the table had no width yet when they were drawn."""
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        table = pilot.app.screen.query_one("#findings", DataTable)
        room = pilot.app.screen.query_one("#found").size.width
        assert room - 3 <= table.virtual_size.width <= room


def test_a_value_without_uncertainty_takes_no_room_of_the_others() -> None:
    """Red before: all of `238.9 µm, U unknown` stood left of the sign."""
    assert aligned(["0.391824 ± 0.000095 Hz", "238.9 µm, U unknown"]) == [
        "0.391824 ± 0.000095 Hz  ",
        "   238.9   µm, U unknown",
    ]


async def test_the_foot_has_keys_that_have_a_use() -> None:
    """Red before: all of them were shown on a bench without a unit, and Sign at a unit that is signed."""
    async with running(given=Given("")) as pilot:
        assert not keys(pilot) & {"Tab", "F8", "^S", "^O", "^Z"}
        assert {"Enter", "F6", "Esc", "F1"} <= keys(pilot)
        await type_line(pilot, "Ann")
        await press(pilot, "f6")
        for serial in ("APA-21", "APA-22"):
            await type_line(pilot, serial)
        assert {"Tab", "^O", "^Z"} <= keys(pilot)
        assert "Enter Add" in seen(pilot)[-1] + seen(pilot)[-2]
    async with running() as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        assert "^S" in keys(pilot)
        assert not keys(pilot) & {"^T", "^E", "F8"}
        await sign_first(pilot)
        assert "^S" not in keys(pilot)
        assert {"^T", "^E", "F10"} <= keys(pilot)
        await press(pilot, "ctrl+s")
        assert "Already signed" in words(pilot, "#status")  # it still says why


async def test_one_plot_has_no_keys_to_others() -> None:
    async with running() as pilot:
        x = np.linspace(0.0, 1.0, 5)
        for names, shown in ((("one",), set()), (("one", "two"), {"→", "←"})):
            panels = {name: Panel(name, "x", "y", (Line(x, x),)) for name in names}
            pilot.app.push_screen(Plots(panels, Path("pictures"), lambda *_: b""))
            await pilot.pause()
            assert keys(pilot) & {"→", "←"} == shown
            assert "F1" in keys(pilot)
            await press(pilot, "escape")


async def test_every_card_of_the_first_screen_has_its_lower_border() -> None:
    """Red before: what was drawn for another height stayed."""
    async with running(size=ROOM, given=Given("")) as pilot:
        rows = seen(pilot)
        for card in pilot.app.screen.query(".card").results(Widget):
            if not card.display:
                continue
            assert rows[card.region.bottom - 1][card.region.x] == "╰", card.id


async def test_a_rejected_unit_is_set_aside_for_quality_assurance() -> None:
    """Red before: after the signature it was left at `F10: next unit`."""
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await fill_values(pilot, more=5.0)
        await press(pilot, "f9")
        await sign_first(pilot, why="stays outside")
        assert "Set the unit aside, QA decides about it (^T). F10: next unit" in words(pilot, "#status")
        assert "^T QA decides about it" in words(pilot, "#who")


async def test_a_question_is_read_to_its_end_beside_the_summary() -> None:
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9", "ctrl+s")
        assert isinstance(pilot.app.screen, Question)
        shown = " ".join(" ".join(row[79:].strip("│ ") for row in seen(pilot)).split())
        assert "Sign APA-02 ─" in shown
        assert "then confirm Esc: cancel" in shown


async def test_a_choice_says_what_escape_does() -> None:
    async with running() as pilot:
        pilot.app.push_screen(Choice("What is it?", "Guess.", ["one", "two"], "tell me"))
        await pilot.pause()
        assert "Esc: tell me" in "\n".join(seen(pilot))


def test_numbers_that_follow_each_other_have_their_point_in_one_place() -> None:
    """Red before: 14.05, 14, 13.95."""
    assert [alike(value, (14.05, 14.0), 5) for value in (14.05, 14.0, -0.0)] == ["14.05", "14.00", "0.00"]
    assert alike(1e-7, (2e-7,), 5) == "1e-07"


def test_a_height_of_nothing_has_no_sign_of_its_own() -> None:
    assert height_words(np.array([-0.01, 1.0])) == ["+0.0", "+1.0"]


@pytest.mark.parametrize("mark", ["1 ", "· ", "  → "])
def test_a_sentence_goes_on_behind_its_number_or_mark(mark: str) -> None:
    console = Console(width=12, no_color=True)
    with console.capture() as drawn:
        console.print(Hung(Text(f"{mark}one two three")))
    first, *others = [line.rstrip() for line in drawn.get().splitlines()]
    assert first.startswith(f"{mark}one")
    assert all(line.startswith(" " * len(mark)) and line[len(mark)] != " " for line in others)
    assert " ".join([first, *others]).split() == [*mark.split(), "one", "two", "three"]


async def test_the_line_with_the_cursor_stays_in_sight_on_a_small_terminal() -> None:
    """Seen in a terminal: it went out of sight when the reason of a refusal above it was gone."""
    async with running(loader("apa-basic"), (80, 24)) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        for text in ("0", "1", "2", "3", "4.99 V", "4", "5 V", "5", "6"):
            pilot.app.focused.value = text
            await press(pilot, "enter")
            await focused_again(pilot, pilot.app.focused)
            body = pilot.app.screen.query_one("#body").region
            assert body.contains_region(pilot.app.focused.region), text


async def test_a_list_that_is_done_says_so() -> None:
    """Red before: with 4 of 4 steps the main action was still to open a step."""
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        assert (words(pilot, "#status"), pilot.app.screen.main_key) == ("Enter: open the step", "enter")
        await fill_values(pilot)
        await press(pilot, "enter", "escape")
        assert words(pilot, "#status").startswith("All steps are done. F9: summary and signature")
        assert pilot.app.screen.query_one(KeyRow).placed[0].cap == "F9"


async def test_a_key_in_the_line_at_the_foot_can_be_clicked() -> None:
    """Red before: `^S: sign this result` could not."""
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        await pilot.click("#status", offset=(6, 0))
        await settled(pilot)
        assert isinstance(pilot.app.screen, Question)
        await press(pilot, "escape")
        await pilot.click("#status", offset=(60, 0))  # behind the words
        await settled(pilot)
        assert not isinstance(pilot.app.screen, Question)
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        before = pilot.app.screen
        await pilot.click("#status", offset=(3, 0))  # `Type the value`, which is no key
        await settled(pilot)
        assert pilot.app.screen is before


def test_words_above_a_plot_stand_in_the_order_of_their_curves() -> None:
    """Red before: 0.2 V, 0.1 V, 0.05 V."""
    x = np.linspace(-1.0, 1.0, 50)
    items = tuple(Line(x, x, f"{n} V") for n in (1, 2, 3))  # upon each other: no place is nearer to one
    above = draw(Panel("loops", "V", "um", items), 60, 12).text().plain.split("\n")[0]
    assert above.split() == ["µm", "━", "1", "V", "━", "2", "V", "━", "3", "V"]


def test_the_scale_of_a_plan_is_whole() -> None:
    """Red before: `▁ -4.8  █` in 46 columns."""
    z = np.array([-4.8, 0.1, 4.8, -0.5])
    item = Heights(np.array([-1.0, -2.0, 1.0, 2.0]), np.zeros(4), z, "height above the fitted plane [um]")
    assert plan(item, 46, 12).text().plain.split("\n")[-1].split() == ["µm", "▁", "-4.8", "█", "+4.8"]
    assert "fitted plane [µm]" in plan(item, 60, 12).text().plain


def test_the_scale_of_a_map_is_whole_and_has_its_colours() -> None:
    """Red before: `log10 of G 0 [` in a narrow card, and shades in grey beside cells of colour."""
    x = np.linspace(5.0, 685.0, 40)
    item = Image(x, np.arange(2.0), np.outer([0.0, 4.0], np.ones(40)), "log10 of G")
    panel = Panel("G", "frequency [Hz]", "", (item,), y_names=("Vs before", "de before"))
    text = map_text(item, panel, 27, 4, coloured=True)
    last = text.plain.split("\n")[-1]
    assert last.split(maxsplit=1)[1] == "log10 of G 0 [ ·░▒▓█] 4"
    assert max(map(len, text.plain.split("\n"))) <= 40
    first = len(text.plain) - len(last) + last.index("█")
    assert any(span.start <= first < span.end and " on #" in str(span.style) for span in text.spans)


async def test_what_was_not_measured_is_called_so_on_the_first_screen() -> None:
    """Red before: `? no value µm`, as if a record had shown nothing."""
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "enter", "f8")
        await type_line(pilot, "dust")
        await press(pilot, "escape", "f9", "escape", "escape")
        card = next(row for row in seen(pilot) if "Flatness, half" in row)
        assert "· Flatness" in card
        assert "not done" in card


async def test_the_list_of_files_is_whole_on_a_small_terminal(tmp_path: Path) -> None:
    """Red before: of the sizes the unit was cut."""
    hammer_record(tmp_path / "add_mass_closed_circuit.mat", 1)
    async with running(loader("apa", tmp_path), (80, 24)) as pilot:
        await to_hammer(pilot)
        await press(pilot, "f2")
        table = pilot.app.screen.query_one("#files", DataTable)
        assert table.virtual_size.width <= table.size.width
        row = next(row for row in seen(pilot) if "add_mass_closed" in row)
        assert row.split("│")[1].split()[-2:] == ["98.7", "kB"]


async def test_without_units_the_list_has_the_room_of_the_unit() -> None:
    async with running(size=(200, 60), given=Given("Ann")) as pilot:
        assert not pilot.app.screen.query_one("#unit-card").display
    async with running(size=(200, 60)) as pilot:
        await begin(pilot)
        await press(pilot, "escape")
        assert pilot.app.screen.query_one("#unit-card").display


@pytest.mark.parametrize("size", [(80, 24), ROOM, (200, 60)], ids=str)
async def test_a_question_is_answered_with_the_mouse(size: tuple[int, int]) -> None:
    """Red before: a click on `Enter: confirm` or `Esc: close` did nothing, so none could sign without keys."""
    async with running(size=size) as pilot:

        async def click(words: str) -> None:
            rows = seen(pilot)
            row = max(n for n, text in enumerate(rows) if words in text)
            await pilot.click(offset=(rows[row].index(words) + len(words) // 2, row))
            await settled(pilot)

        await begin(pilot)
        await press(pilot, "f5")
        await click("Esc: cancel")
        assert not isinstance(pilot.app.screen, Question)
        await fill_values(pilot)
        await press(pilot, "f9")
        await click("^S Sign")
        for _ in range(2):
            pilot.app.focused.insert_text_at_cursor("correct horse")
            await click("next field")
        await click("Enter or Esc: close")  # the keys were made
        assert "Signed and verified" in words(pilot, "#status")


async def test_what_is_typed_after_a_click_goes_where_it_leads() -> None:
    """Red before: a click was handed on beside the keys that came after it, and a passphrase stood in another line."""
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        rows = seen(pilot)
        row = max(n for n, text in enumerate(rows) if "^S Sign" in text)
        at = rows[row].index("^S Sign") + 2
        for event in (MouseDown, MouseUp):
            pilot.app.post_message(event(None, at, row, 0, 0, 1, False, False, False, at, row))
        for letter in "correct":
            pilot.app.post_message(Key(letter, letter))
        await settled(pilot)
        assert isinstance(pilot.app.screen, Question)
        assert pilot.app.focused.value == "correct"


async def test_a_repair_of_another_step_is_told_where_it_is() -> None:
    async with running(size=ROOM) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        pilot.app.screen.dismiss("stiffness")
        await settled(pilot)
        steps = pilot.app.screen.query_one(StepList)
        assert pilot.app.session.steps[steps.cursor_row].name == "stiffness"
        assert "measure the step again" in words(pilot, "#status")
