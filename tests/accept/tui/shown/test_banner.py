"""The result in large letters: each verdict is drawn whole, and fits its terminal; it is heard if that is asked for."""

import pytest
from textual.app import App
from textual.color import Color
from textual.widgets import DataTable

from accept.tui import theme
from accept.tui.screens import summary
from accept.tui.widgets.banner import _LETTERS, Banner, drawn
from checks.verdict import UnitVerdict
from tests.accept.tui.tui_help import at_rest, begin, fill_values, press, running, settled, shown, until

WORDS = [*map(str, UnitVerdict), "held"]


@pytest.mark.parametrize("word", WORDS)
def test_every_verdict_is_drawn_whole(word: str):
    assert set(word.upper()) <= set(_LETTERS)
    rows = drawn(word)
    assert len(rows) == 3
    assert len({len(row) for row in rows}) == 1
    assert len(rows[0]) <= 76  # and a margin, in a terminal of 80
    assert len(rows[0]) == sum(len(_LETTERS[letter][0]) + 1 for letter in word.upper()) - 1


def test_letters_differ():
    assert len(set(_LETTERS.values())) == len(_LETTERS)


async def test_the_result_is_large_and_can_be_heard(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(summary.SOUND, "1")
    monkeypatch.setattr(summary, "_BETWEEN_BELLS_S", 0.0)
    bells: list[int] = []
    async with running() as pilot:
        await begin(pilot)
        monkeypatch.setattr(App, "bell", lambda self: bells.append(1))
        await press(pilot, "f9")
        await shown(pilot, "#verdict", "not measured")
        await until(lambda: len(bells) >= 3)
        await settled(pilot)
        assert len(bells) == 3
        banner = pilot.app.screen.query_one(Banner)
        assert (banner.word, banner.size.height) == ("incomplete", 3)
        rows = [strip.text for strip in pilot.app.screen._compositor.render_strips()]
        assert sum("INCOMPLETE" in row.upper() for row in rows) == 0  # once, in its letters
        pilot.app.screen.query_one(DataTable).clear()  # judged anew: it is empty for a moment
        await at_rest(pilot)


@pytest.mark.parametrize("name", [theme.DARK, theme.LIGHT])
async def test_letters_have_the_colours_of_the_theme(name: str, monkeypatch: pytest.MonkeyPatch):
    """Red before: they were the plain red and green of style sheets, hardly seen on their ground."""
    monkeypatch.setenv("COLORTERM", "truecolor")
    async with running() as pilot:
        pilot.app.theme = name
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        banner = pilot.app.screen.query_one(Banner)
        assert banner.word == "accepted"
        shown = pilot.app.screen._compositor.render_strips()[banner.region.y]
        colours = {part.style.color.get_truecolor() for part in shown if "▀" in part.text}
        assert colours == {Color.parse(pilot.app.current_theme.success).rgb}
