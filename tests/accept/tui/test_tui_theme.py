"""Both palettes can be read: contrast as WCAG 2 defines it, 4.5 for text; F12 changes from one to the other."""

import pytest
from rich.segment import Segment
from rich.style import Style
from textual.color import Color as TextualColor
from textual.widgets import Input

from accept.tui import theme
from accept.tui.screens.start import Given
from accept.tui.widgets.step_list import StepList
from tests.accept.tui.tui_help import loader, press, running

TEXT = 4.5  # WCAG 2.2, 1.4.3
ANSI = {theme.DARK: theme.ANSI_DARK, theme.LIGHT: theme.ANSI_LIGHT}


def luminance(rgb: tuple[int, int, int]) -> float:
    parts = [c / 255 for c in rgb]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a: tuple[int, int, int], b: tuple[int, int, int]) -> float:
    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


def rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


@pytest.mark.parametrize("one", theme.THEMES, ids=lambda one: one.name)
def test_every_colour_of_text_can_be_read_on_every_ground(one):
    grounds = [rgb(one.background), rgb(one.surface)]
    named = {
        role: rgb(getattr(one, role)) for role in ("primary", "secondary", "accent", "success", "warning", "error")
    }
    named["foreground"] = rgb(one.foreground)
    drawn = {f"ansi {n}": tuple(ANSI[one.name].ansi_colors[n]) for n in range(1, 8)}
    poor = {name: contrast(c, g) for name, c in (named | drawn).items() for g in grounds if contrast(c, g) < TEXT}
    assert not poor


async def test_f12_changes_light_and_dark(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ACCEPT_THEME", "light")
    async with running(loader(), given=Given("Ann")) as pilot:
        assert pilot.app.theme == theme.LIGHT
        await press(pilot, "f12")
        assert pilot.app.theme == theme.DARK


def test_a_cell_without_a_style_has_no_colour_either():
    red = Segment("a", Style(color="red"))
    plain, blank = theme.WITHOUT_COLOUR.apply([red, Segment(" ", None)], TextualColor(0, 0, 0))
    assert (plain.text, blank.text) == ("a", " ")
    triplet = plain.style.color.get_truecolor()
    assert triplet.red == triplet.green == triplet.blue


async def test_lines_and_the_row_under_the_cursor_are_seen_without_colour(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("NO_COLOR", "1")
    async with running(loader(), given=Given("Ann")) as pilot:
        assert pilot.app.screen.query_one("#kind", Input).rich_style.underline
        await press(pilot, *"APA-02", "enter", "enter")
        rail = pilot.app.screen.query_one(StepList)
        assert rail.get_component_rich_style("datatable--cursor").reverse
