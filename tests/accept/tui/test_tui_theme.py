"""Both palettes can be read: contrast as WCAG 2 defines it, 4.5 for text; F12 changes from one to the other."""

import re

import pytest
from rich.color import Color, ColorSystem
from rich.console import Console
from rich.segment import Segment
from rich.style import Style
from textual.color import Color as TextualColor
from textual.pilot import Pilot
from textual.widgets import Input

from accept.tui import theme
from accept.tui.screens.start import Given
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.step_list import StepList
from tests.accept.tui.tui_help import begin, fill_values, loader, press, running, settled

RED, GREEN, YELLOW, BRIGHT = 1, 2, 3, 8  # numbers among the 16 colours; what is added to them for the bright ones
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


@pytest.mark.parametrize(("drawn", "ground"), [(theme.ANSI_DARK_16, (0, 0, 0)), (theme.ANSI_LIGHT_16, (255, 255, 255))])
def test_axes_are_seen_in_16_colours(drawn, ground):
    """Red before: they were black on black."""
    assert contrast(tuple(drawn.ansi_colors[BRIGHT]), ground) >= TEXT


async def test_f12_changes_light_and_dark(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ACCEPT_THEME", "light")
    async with running(loader(), given=Given("Ann")) as pilot:
        assert pilot.app.theme == theme.LIGHT
        assert key_colours(pilot) == {theme.ANSI_LIGHT.ansi_colors[YELLOW]}
        await press(pilot, "f12")
        assert pilot.app.theme == theme.DARK
        assert key_colours(pilot) == {theme.ANSI_DARK.ansi_colors[YELLOW]}  # red before: they were drawn once


def key_colours(pilot: Pilot[None]) -> set[tuple[int, int, int]]:
    """Return the colours in which the row of keys has its keys."""
    parts = pilot.app.screen.query_one(KeyRow).render_line(0)
    return {part.style.color.get_truecolor() for part in parts if part.text.strip() in ("F6", "Esc", "F1", "^P")}


async def test_no_text_of_a_judged_step_is_too_faint(monkeypatch: pytest.MonkeyPatch):
    """Red before: the instrument under the instruction (2.9 on light), the number in a title (2.8), in a failed
    result the limits of what had passed, and what is still to be connected."""
    monkeypatch.setenv("COLORTERM", "truecolor")
    async with running(loader("apa-basic"), (120, 36)) as pilot:
        await begin(pilot)
        await fill_values(pilot, more=5.0)
        for name in (theme.DARK, theme.LIGHT):
            pilot.app.theme = name
            for step in ("capacitance", "stroke"):
                await pilot.app.go_to_step(step)
                await settled(pilot)
                assert not faint(pilot), (name, step)


def faint(pilot: Pilot[None]) -> set[tuple[str, float]]:
    """Return the words whose contrast is below what WCAG asks for, but for gauges, which are drawn, and hints of empty
    lines."""
    found, default = set(), rgb(pilot.app.current_theme.foreground)
    for strip in pilot.app.screen._compositor.render_strips():
        for part in strip:
            style = part.style
            if style is None or style.color is None or not re.search(r"\w{2}", part.text):
                continue
            ink = default if style.color.is_default else tuple(style.color.get_truecolor())
            ground = tuple(style.bgcolor.get_truecolor())
            if (seen := contrast(ink, ground)) < TEXT:
                found.add((part.text.strip(), round(seen, 1)))
    return found


def test_a_cell_without_a_style_has_no_colour_either():
    red = Segment("a", Style(color="red"))
    plain, blank = theme.WITHOUT_COLOUR.apply([red, Segment(" ", None)], TextualColor(0, 0, 0))
    assert (plain.text, blank.text) == ("a", " ")
    triplet = plain.style.color.get_truecolor()
    assert triplet.red == triplet.green == triplet.blue


@pytest.mark.parametrize("name", [theme.DARK, theme.LIGHT])
async def test_good_bad_and_doubtful_are_told_apart_in_16_colours(monkeypatch: pytest.MonkeyPatch, name: str):
    """Good is a green of the 16, bad a red, doubtful a yellow, drawn as such a terminal draws them."""
    monkeypatch.setattr(Console, "_detect_color_system", lambda _: ColorSystem.STANDARD)
    monkeypatch.setenv("ACCEPT_THEME", name.removeprefix("accept-"))
    async with running(loader(), given=Given("Ann")) as pilot:
        themed, ansi = pilot.app.current_theme, pilot.app.ansi_theme
    drawn = [Style.parse(style).color.get_truecolor(ansi) for style in ("green", "bold red", "yellow")]
    for three in (drawn, [rgb(colour) for colour in (themed.success, themed.error, themed.warning)]):
        numbers = [Color.from_rgb(*of).downgrade(ColorSystem.STANDARD).number % BRIGHT for of in three]
        assert numbers == [GREEN, RED, YELLOW]


@pytest.mark.parametrize("one", theme.THEMES, ids=lambda one: one.name)
def test_frames_and_chips_are_seen_in_16_colours(one):
    """Red before: on light they were of the white of the ground."""
    shown = theme.of_16(one)

    def number(colour: str) -> int:
        return Color.parse(colour).downgrade(ColorSystem.STANDARD).number

    for part in (shown.panel, shown.variables["frame"]):
        assert number(part) not in {number(shown.background), number(shown.foreground)}
    turned = {number(shown.variables[f"block-cursor-{of}"]) for of in ("background", "foreground")}
    assert turned in ({0, 15}, {0, 7})  # black with white or grey: ink and ground are turned round


async def test_the_chip_is_turned_round_in_16_colours(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLORTERM", "")
    monkeypatch.setenv("TERM", "xterm-16color")
    async with running(loader(), given=Given("Ann")) as pilot:
        row = pilot.app.screen.query_one(KeyRow)
        assert [part.style.reverse for part in row.render_line(0) if part.text.strip() == "Enter Open"] == [True]


async def test_lines_and_the_row_under_the_cursor_are_seen_without_colour(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("NO_COLOR", "1")
    async with running(loader(), given=Given("Ann")) as pilot:
        assert pilot.app.screen.query_one("#serial", Input).rich_style.underline
        await press(pilot, *"APA-02", "enter", "enter")
        rail = pilot.app.screen.query_one(StepList)
        assert rail.get_component_rich_style("datatable--cursor").reverse
