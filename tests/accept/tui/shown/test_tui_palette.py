"""The command palette, the list of steps under a mouse, and words that go by themselves."""

import re

from textual.command import CommandPalette
from textual.widgets import OptionList

from accept.store import open_store
from accept.tui.background.busy_screen import TOLD_S
from accept.tui.screens.step import StepScreen
from accept.tui.widgets.step_list import StepList
from tests.accept.tui.tui_help import begin, press, running, settled, title, told, type_line, until


async def test_the_palette_leads_to_a_step_by_its_name():
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        assert pilot.app.screen.step.name == "flatness"
        await pilot.press("ctrl+p")
        palette = pilot.app.screen
        assert isinstance(palette, CommandPalette)
        await pilot.press(*"step stroke")
        await until(lambda: palette.query_one(OptionList).option_count == 1)
        await pilot.press("enter")
        await until(lambda: isinstance(pilot.app.screen, StepScreen) and pilot.app.screen.step.name == "stroke")
        await settled(pilot)
        assert pilot.app.screen.query_one(StepList).cursor_row == 2


async def test_the_palette_offers_the_keys_of_the_screen():
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await pilot.press("ctrl+p")
        options = pilot.app.screen.query_one(OptionList)
        await until(lambda: options.option_count > 8)
        names = [str(options.get_option_at_index(n).prompt) for n in range(options.option_count)]
        for name in ("Note", "Other input", "Summary", "Step Capacitance", "Light or dark"):
            assert any(name in each for each in names), name
        await pilot.press("escape")


async def test_a_step_is_opened_from_another_by_a_click_on_its_row():
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await type_line(pilot, "0 1 2 3 4 5 6 7")
        await pilot.click(StepList, offset=(6, 3))  # the frame, then the rows
        await until(lambda: isinstance(pilot.app.screen, StepScreen) and pilot.app.screen.step.name == "stroke")
        await settled(pilot)
        assert "Stroke" in title(pilot)
        assert len(pilot.app.session.state("flatness").entries) == 8


async def test_what_was_saved_is_told_with_its_time_and_its_entry_of_the_record():
    async with running() as pilot:
        await begin(pilot)
        pilot.app.screen.query_one(StepList).stand_at("stroke")
        await press(pilot, "enter")
        await type_line(pilot, "365")
        said = re.match(r"Saved \d\d:\d\d:\d\d as entry (\d+): stroke of the three stacks 365 um", told(pilot))
        assert said is not None
        with open_store() as store:
            assert int(said[1]) in {event.seq for event in store.events("APA-02", "value_taken")}
        (shown,) = pilot.app._notifications
        assert shown.timeout == TOLD_S
        await press(pilot, "ctrl+z")
        assert re.match(r"Undone \d\d:\d\d:\d\d: stroke .* keeps both", told(pilot))
        assert len(pilot.app._notifications) == 1  # in place of the one before
