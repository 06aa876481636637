"""A hammer test while it is recorded: what to do now, every hit with its force and verdict, what the good ones show."""

import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from textual.widgets import Static

from accept.capture.setup import CaptureResult
from accept.tui.widgets.hits import ENOUGH, HIT, WAIT, cue_of, hits_text, response_panel
from accept.workflow import open_bench
from checks.acceptance import HitsSoFar
from checks.signals.impact.hammer import ImpactFrf
from checks.signals.impact.impacts import Impact
from tests.accept.tui.shown.test_tui_layout import Recorder, seen, to_hammer
from tests.accept.tui.tui_help import at_rest, loader, running, settled, shown

NAN = float("nan")
GOOD = (Impact(0, 10, 20, 90.0), Impact(100, 110, 120, 106.0))
BAD = Impact(200, 210, 220, 45.0, "double hit", "a second peak of 38 % after 11.9 ms")


def frf() -> ImpactFrf:
    f = np.linspace(0.0, 600.0, 601)
    H = 1.0 / (1.0 - (f / 414.0) ** 2 + 0.02j)
    ones = np.ones((2, f.size), dtype=complex)
    return ImpactFrf(f, ones, ones * H, H, np.zeros(f.size), 0.0)


def test_every_hit_has_its_mark_and_what_is_needed_is_open() -> None:
    text = hits_text(HitsSoFar((GOOD[0], BAD, GOOD[1]), False, 5, NAN)).plain
    assert text.split("\n")[1].startswith("✓ ✗ ✓ ○ ○ ○   2 good, 3 to go")
    assert "last   ✓ 106 N  single hit" in text
    assert "45 to 106 N" in text
    assert "coherence" not in text  # there is none of one good hit, and none is invented
    assert "0.989" in hits_text(HitsSoFar(GOOD, False, 5, 0.989)).plain


def test_a_hit_that_is_set_aside_says_why() -> None:
    assert "last   ✗ 45 N  double hit (a second peak of 38 % after 11.9 ms)" in hits_text(
        HitsSoFar((BAD,), False, 5, NAN)
    ).plain  # fmt: skip


def test_bars_are_as_high_as_the_forces() -> None:
    forces = [Impact(0, 0, 0, force) for force in (10.0, 50.0, 100.0)]
    bars = hits_text(HitsSoFar(tuple(forces), False, 3, NAN)).plain.split("\n")[2]
    assert [bars[2 * n] for n in range(3)] == ["▂", "▅", "█"]


def test_bars_of_a_large_terminal_are_wide_below_their_marks() -> None:
    _, marks, *bars = hits_text(HitsSoFar(GOOD, False, 3, NAN), 12, 7).plain.split("\n")[:14]
    assert [marks[7 * n] for n in range(3)] == ["✓", "✓", "○"]
    assert bars[-1].startswith("██████ ██████ ")
    assert bars[0].startswith("       ██")  # the higher one


def test_the_cue_is_what_is_to_be_done_at_this_moment() -> None:
    assert cue_of(HitsSoFar((), False, 5, NAN)) == HIT
    assert cue_of(HitsSoFar(GOOD, True, 5, NAN)) == WAIT
    assert cue_of(HitsSoFar(GOOD, False, 2, NAN)) == ENOUGH


def test_the_response_is_that_of_the_band_and_there_is_none_of_one_hit() -> None:
    assert response_panel(HitsSoFar(GOOD[:1], False, 5, NAN)) is None
    (line,) = response_panel(HitsSoFar(GOOD, False, 5, 0.99, frf(), (300.0, 520.0))).items
    assert (line.x.min(), line.x.max()) == (300.0, 520.0)
    assert line.x[np.argmax(line.y)] == 414.0


@pytest.mark.parametrize("size", [(80, 24), (120, 36), (200, 60)], ids=str)
async def test_hit_now_stays_in_sight_with_the_hits_and_where_to_hit(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Red before: the cue was one word in a line of the foot."""
    told, go_on = threading.Event(), threading.Event()

    def capture(*_: Any, stopped: threading.Event, show: Any, **__: Any) -> CaptureResult:
        _[4]("x-bending: hit now")
        show("x-bending", HitsSoFar((), False, 10, NAN))
        show("x-bending", HitsSoFar((GOOD[0], BAD, GOOD[1]), False, 10, 0.989, frf(), (300.0, 520.0)))
        _[4]("x-bending, hit 3: good, 106 N. 2 good; 8 more hits")
        told.set()
        while not (stopped.is_set() or go_on.wait(0.01)):
            pass
        return CaptureResult(notes=("x-bending: 10 of 10 hits good",))

    monkeypatch.setattr(open_bench, "capture", capture)
    async with running(lambda: replace(loader("apa")(), instruments=Recorder()), size) as pilot:
        await to_hammer(pilot)
        await pilot.press("f3")
        await shown(pilot, "#said", "8 more hits")
        for _ in range(2):
            pilot.app.screen._tick()
            await at_rest(pilot)
        rows = seen(pilot)
        assert sum(HIT in row for row in rows) == 1
        cue = pilot.app.screen.query_one("#cue", Static)
        assert cue.size.height == (3 if size[1] < 32 else 7)  # red before at 60 rows: 3; and as wide as its card
        assert "now" in cue.classes
        text = "\n".join(rows)
        said = ("✓ ✗ ✓ ○", "2 good, 8 to go", "106 N", "0.989", "8 more hits")
        assert all(each in " ".join(text.split()) for each in said)  # wider apart on a large terminal
        picture = [row.strip() for row in pilot.app.session.step("spurious_modes").guide.picture.splitlines()]
        assert all(row in text for row in picture)
        if size[0] >= 120:
            assert "Response so far" in text
        assert not pilot.app.screen.query_one("#main").display
        go_on.set()
        await settled(pilot)
        assert pilot.app.screen.query_one("#main").display
        assert not pilot.app.screen.query("#hits")
