"""What must be readable on a small terminal and on a large one: names of records, the drawing, words of a capture."""

import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot
from textual.widgets import Static

from accept.capture.setup import CaptureResult
from accept.tui.background import busy_screen
from accept.tui.screens.plots import Plots
from accept.tui.widgets.fields import Field
from accept.tui.widgets.plot import PanelView
from accept.tui.widgets.step_list import StepList
from accept.workflow import open_bench
from accept.workflow.instruments.port import Instruments
from hw.records import own_record
from tests.accept.tui.tui_help import (
    HEIGHTS,
    at_rest,
    begin,
    fill_values,
    loader,
    press,
    running,
    settled,
    shown,
    told,
    type_line,
    words,
)

HAMMER = ("x_bending", "y_bending", "torsion_left", "torsion_top")


def seen(pilot: Pilot[None]) -> list[str]:
    return [strip.text for strip in pilot.app.screen._compositor.render_strips()]


def hammer_record(path: Path, seed: int) -> Path:
    noise = np.random.default_rng(seed).normal(size=(2, 4096))
    path.write_bytes(own_record({"t": np.arange(4096) / 5120.0, "Track1": noise[0], "Track2": noise[1]}))
    return path


async def to_hammer(pilot: Pilot[None]) -> None:
    await begin(pilot, "APA-01")
    pilot.app.screen.query_one(StepList).stand_at("spurious_modes")
    await press(pilot, "enter")


@pytest.mark.parametrize("size", [(60, 24), (80, 24), (120, 36), (200, 60)], ids=lambda size: str(size[0]))
async def test_no_two_stored_records_read_the_same(size: tuple[int, int], tmp_path: Path) -> None:
    async with running(loader("apa", tmp_path), size) as pilot:
        await begin(pilot, "APA-01")
        session, names = pilot.app.session, [f"hammer_of_this_unit_{place}.mat" for place in HAMMER]
        for n, (place, name) in enumerate(zip(HAMMER, names, strict=True)):
            declared = session.step("spurious_modes").check.inputs[place]
            session.records.link("spurious_modes", declared, hammer_record(tmp_path / name, n))
        pilot.app.screen.query_one(StepList).stand_at("spurious_modes")
        await press(pilot, "enter")
        read = []
        for field in pilot.app.screen.query(Field):
            line = field.query_one(".stored", Static)
            drawn = line.render_lines(line.outer_size.region)
            read.append("".join(strip.text.strip() for strip in drawn).removeprefix("▪").strip())
        assert read == names


async def test_the_drawing_stays_with_the_words_for_every_record_of_the_hammer(tmp_path: Path) -> None:
    async with running(loader("apa", tmp_path), (80, 24)) as pilot:
        await to_hammer(pilot)
        session = pilot.app.session
        picture = [row.strip() for row in session.step("spurious_modes").guide.picture.splitlines()]
        for n, place in enumerate(HAMMER):
            rows = "\n".join(seen(pilot))
            assert all(row in rows for row in picture), f"{n} records"
            assert "Hit with the hammer at the point in the drawing" in rows
            assert pilot.app.focused.region.height == 1  # and the field is on the screen
            assert pilot.app.screen.region.contains_region(pilot.app.focused.region)
            assert pilot.app.focused.ancestors[0].parent.place.declared.name == place
            hammer_record(tmp_path / f"{place}.mat", n)
            pilot.app.focused.value = f"{place}.mat"
            await press(pilot, "enter")
        assert not all(row in "\n".join(seen(pilot)) for row in picture)  # the result has the room then


class Recorder(Instruments):
    """A recorder at the bench."""

    name = "recorder"

    def recording(self, check: str) -> Any:
        return self if check == "spurious_modes" else None


async def test_what_a_capture_says_is_still_there_after_the_clock_has_run(monkeypatch: pytest.MonkeyPatch) -> None:
    all_said, go_on = threading.Event(), threading.Event()
    verdicts = [f"x-bending, hit {n}: good, {90 + n} N. {n} good; {10 - n} more hits" for n in (1, 2)]

    def capture(*_: Any, stopped: threading.Event, **__: Any) -> CaptureResult:
        say = _[4]
        for words_said in ("x-bending: hit now", *verdicts):
            say(words_said)
        all_said.set()
        while not (stopped.is_set() or go_on.wait(0.01)):
            pass
        return CaptureResult(notes=("x-bending: 10 of 10 hits good",))

    monkeypatch.setattr(open_bench, "capture", capture)
    monkeypatch.setattr(busy_screen, "_CLOCK_AFTER_S", -1.0)
    async with running(lambda: replace(loader("apa")(), instruments=Recorder())) as pilot:
        await to_hammer(pilot)
        await pilot.press("f3")
        await shown(pilot, "#said", verdicts[-1])
        for _ in range(3):
            pilot.app.screen._tick()
            await at_rest(pilot)
            rows = " ".join(" ".join(seen(pilot)).split())
            assert "x-bending: hit now" in rows
            assert all(verdict in rows for verdict in verdicts)
            assert "measuring with recorder" in words(pilot, "#status")
        go_on.set()
        await settled(pilot)
        assert not pilot.app.screen.query_one("#said").display
        assert "10 of 10 hits good" in told(pilot)  # beside the line at the foot, which the judgement takes


async def test_a_long_reason_in_the_summary_is_read_to_its_end() -> None:
    """Red before: it was cut behind the fourth line."""
    async with running() as pilot:
        await begin(pilot)
        for n in range(12):
            pilot.app.session.entries.note("stroke", f"note number {n}")
        await press(pilot, "f9")
        assert "More" in "".join(seen(pilot)[-2:])  # in the row of keys
        read = "\n".join(seen(pilot))
        for _ in range(6):
            await press(pilot, "pagedown")
            read += "\n".join(seen(pilot))
        assert all(f"note number {n}" in read for n in range(12))


async def test_every_row_of_the_list_is_counted_or_said_to_be_optional() -> None:
    async with running(loader("apa")) as pilot:
        await begin(pilot, "APA-01")
        rows = pilot.app.screen.query_one(StepList).row_count
        assert f"0 of {rows - 1} steps, gap optional" in words(pilot, "#unit")
    async with running() as pilot:
        await begin(pilot)
        rows = pilot.app.screen.query_one(StepList).row_count
        assert f"0 of {rows} steps  " in words(pilot, "#unit")


async def test_a_plot_and_a_card_have_their_room_again_after_a_smaller_terminal() -> None:
    """Red before: the plot was gone for good, and the card beside it had the rows of the smaller one."""
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await type_line(pilot, HEIGHTS)
        result = pilot.app.screen.query_one("#findings")
        before = len(pilot.app.screen.query(PanelView)), result.size
        for size in ((80, 24), (120, 36), (200, 60), (120, 36)):
            await pilot.resize_terminal(*size)
            await settled(pilot)
        assert (len(pilot.app.screen.query(PanelView)), result.size) == before
        assert before[0] == 2


async def test_a_large_terminal_has_a_large_drawing_and_the_units_before() -> None:
    """Red before: three quarters of the rows beside typed values were empty."""
    async with running() as pilot:
        for n in range(6):
            await begin(pilot, f"APA-{20 + n}")
            await fill_values(pilot, 0.1 * n)
            await press(pilot, "f9", "escape", "escape")
        await pilot.resize_terminal(200, 60)
        await begin(pilot, "APA-11")
        await press(pilot, "down", "enter")
        used = sum(bool(row[70:].strip(" │")) for row in seen(pilot))
        assert used >= 36  # of 60: more than half, where 10 were
        titles = [str(view.border_title) for view in pilot.app.screen.query(PanelView)]
        assert titles == ["Sensor stack, the last 6 units", "Actuator stacks, the last 6 units"]


async def test_on_a_small_terminal_the_plot_takes_the_place_of_the_form_until_escape() -> None:
    async with running(size=(80, 24)) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await type_line(pilot, "1.5")
        step, line = pilot.app.screen, pilot.app.focused
        form, plot = step.query_one("#form"), step.query_one("#plot")
        await press(pilot, "f7")
        assert pilot.app.screen is step  # unit, result and keys stay in sight
        assert not form.display
        assert plot.size.height > 10
        assert plot.query(PanelView)
        await press(pilot, "f7")
        assert isinstance(pilot.app.screen, Plots)  # all of them
        await press(pilot, "escape", "escape")
        assert pilot.app.screen is step
        assert form.display
        assert not plot.display
        assert pilot.app.focused is line
        await press(pilot, "f7", "down")  # a key of the form brings it back
        assert form.display
