"""The result in large letters: each verdict is drawn whole, and fits its terminal; it is heard if that is asked for."""

import pytest
from textual.app import App
from textual.widgets import DataTable

from accept.tui.screens import summary
from accept.tui.widgets.banner import _LETTERS, Banner, band
from checks.verdict import UnitVerdict
from tests.accept.tui.tui_help import at_rest, begin, press, running, settled, shown, until

WORDS = [*map(str, UnitVerdict), "held"]


@pytest.mark.parametrize("word", WORDS)
def test_every_verdict_is_drawn_whole(word: str):
    assert set(word.upper()) <= set(_LETTERS)
    for width, large, rows in ((80, False, 3), (140, True, 5)):
        lines = band(word, "bold green", width, large).plain.splitlines()
        assert len(lines) == rows
        assert {len(line) for line in lines} == {width}  # the band reaches from edge to edge and into no further line
    assert "reverse" in str(band(word, "bold green", 80, False).spans[0].style)  # seen without colours too


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
        await shown(pilot, "#verdict", "INCOMPLETE")
        await until(lambda: len(bells) >= 3)
        await settled(pilot)
        assert len(bells) == 3
        assert pilot.app.screen.query_one(Banner).size.height == 3
        pilot.app.screen.query_one(DataTable).clear()  # judged anew: it is empty for a moment
        await at_rest(pilot)
