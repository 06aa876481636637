"""What the screens of a step promise, cell by cell: the room is used, a key has one label, an arrow sends little."""

import asyncio
import itertools
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.text import Text
from textual._compositor import ChopsUpdate, CompositorUpdate
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import VerticalScroll
from textual.css.stylesheet import Stylesheet
from textual.dom import DOMNode
from textual.geometry import Region
from textual.pilot import Pilot
from textual.screen import Screen
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Label, Static

from accept.tui.app import BenchApp
from accept.tui.background.busy_screen import Working
from accept.tui.background.partial_draw import PartialDraw
from accept.tui.background.scanning import Scanning
from accept.tui.screens.ask import Choice, Help, Question
from accept.tui.screens.gap import Explain
from accept.tui.screens.page import Page
from accept.tui.screens.plots import Plots
from accept.tui.screens.record_picker import Pick
from accept.tui.screens.start import StartScreen
from accept.tui.screens.step import StepScreen
from accept.tui.screens.steps import Steps
from accept.tui.screens.summary import Summary
from accept.tui.widgets import hanging
from accept.tui.widgets.key_row import PALETTE, KeyRow, ShownKey, placed
from accept.tui.widgets.live_value import Followed, Gauge
from accept.tui.widgets.plot import draw
from accept.tui.widgets.raster import Raster
from accept.tui.widgets.step_list import StepList
from accept.workflow.instruments.port import Look
from checks.declare import Measured
from checks.picture import Band, Line, Panel
from specs.spec import Limit
from tests.accept.tui.tui_help import (
    HEIGHTS,
    at_rest,
    begin,
    fill_values,
    loader,
    press,
    running,
    settled,
    type_line,
    words,
)
from tests.hw.instruments.fake_instrument import Fake

METER = Followed("meter", "sensor stack", "uF", Limit(lower=4.4, upper=5.5, unit="uF", rule="guarded", source="test"))
SIZE = (120, 36)
FRAME = frozenset(" │─╭╮╰╯▁▃▅▇█")  # borders and bars of scrolling
USED = 0.6  # of the rows
ARROW_BYTES = 5000
LEADS = {
    "enter",
    "escape",
    "tab",
    "left",
    "right",
    "pageup",
    "pagedown",
    "backspace",
}  # their words say where they lead


def used(pilot: Pilot[None]) -> float:
    rows = [strip.text for strip in pilot.app.screen._compositor.render_strips()]
    return sum(bool(set(row) - FRAME) for row in rows) / len(rows)


async def open_at(pilot: Pilot[None], step: str) -> None:
    pilot.app.screen.query_one(StepList).stand_at(step)
    await press(pilot, "enter")


async def test_most_rows_of_the_screens_of_a_step_are_used() -> None:
    async with running(loader("apa"), SIZE) as pilot:
        await begin(pilot, "APA-01")
        rooms = {}
        for step in pilot.app.session.steps:
            pilot.app.screen.query_one(StepList).stand_at(step.name)
            await press(pilot, "up", "down")
            rooms[f"list at {step.name}"] = used(pilot)
            await press(pilot, "enter")
            rooms[step.name] = used(pilot)
            await press(pilot, "escape")
        await open_at(pilot, "flatness")
        await type_line(pilot, HEIGHTS)
        rooms["flatness, judged"] = used(pilot)
    assert not {name: round(room, 2) for name, room in rooms.items() if room < USED}


def test_no_key_has_two_labels() -> None:
    labels = defaultdict[str, set[str]](set)
    of_unit = (Working, Scanning, Page, Steps, StepScreen, Explain, Summary, Plots)
    for screen in (*of_unit, StartScreen, Question, Choice, Help, Pick):
        for binding in screen.__dict__.get("BINDINGS", ()):
            assert isinstance(binding, Binding)
            for key in binding.key.split(","):
                if binding.description and key not in LEADS:
                    labels[key].add(binding.description)
    assert not {key: names for key, names in labels.items() if len(names) > 1}


@pytest.mark.parametrize(("width", "left_out"), [(60, 8), (80, 6), (120, 1), (160, 0)])
def test_the_foot_is_one_row_and_says_how_many_keys_it_leaves_to_the_palette(width: int, left_out: int) -> None:
    names = ["File", "Measure", "Mean", "Note", "Other", "Plot", "Again", "Summary"]
    keys = [ShownKey("enter", "Enter", "Save", is_main=True)]
    keys += [ShownKey(f"f{n}", f"F{n}", name) for n, name in enumerate(names, 2)]
    keys += [
        ShownKey("escape", "Esc", "Steps"),
        ShownKey("ctrl+z", "^Z", "Undo"),
        ShownKey("f1", "F1", "Help"),
        PALETTE,
    ]
    found = placed(keys, width)
    assert len(found) == len(keys) - left_out
    assert found[0].is_main
    assert "Esc" in [each.cap for each in found]  # the way back is never left out
    assert [each.cap for each in found[-3:]] == ["F1", "^P", "^Z"]
    assert found[-2].label == (f"{left_out} more" if left_out else PALETTE.label)
    assert found[-1].end == width
    assert all(a.end < b.column for a, b in itertools.pairwise(found))


async def test_an_arrow_sends_little(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLORTERM", "truecolor")
    sent = []

    def display(app: BenchApp, _: Screen[Any], update: Any) -> None:
        if isinstance(update, CompositorUpdate):
            sent.append(len(update.render_segments(app.console).encode()))

    monkeypatch.setattr(BenchApp, "_display", display)
    costs = {}
    async with running(size=SIZE) as pilot:
        await begin(pilot)
        await fill_values(pilot)
        for key in ("down", "down", "up"):
            sent.clear()
            await press(pilot, key)
            costs[f"list, {key}, {len(costs)}"] = sum(sent)
        for step in ("capacitance", "flatness"):
            await open_at(pilot, step)
            await press(pilot, "up")
            for key in ("up", "down"):
                sent.clear()
                await press(pilot, key)
                costs[f"{step}, {key}"] = sum(sent)
            await press(pilot, "escape")
    assert not {name: cost for name, cost in costs.items() if not 0 < cost <= ARROW_BYTES}


async def test_of_several_keys_for_an_action_the_foot_shows_one() -> None:
    async with running(loader("apa"), SIZE) as pilot:
        x = np.linspace(0.0, 1.0, 5)
        panels = {name: Panel(name, "x", "y", (Line(x, x),)) for name in ("one", "two")}
        pilot.app.push_screen(Plots(panels, Path("pictures"), lambda *_: b""))
        await pilot.pause()
        labels = [shown.label for shown in pilot.app.screen.query_one(KeyRow).keys]
        assert labels.count("Next plot") == labels.count("Previous plot") == labels.count("Back") == 1
        await press(pilot, "space")  # the others still act
        assert "two" in words(pilot, ".title")


async def test_an_arrow_from_line_to_line_styles_what_it_lights_and_no_whole_card(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    styled: list[DOMNode] = []
    own = Stylesheet.apply

    def apply(sheet: Stylesheet, node: DOMNode, **more: Any) -> None:
        styled.append(node)
        own(sheet, node, **more)

    async with running(size=SIZE) as pilot:
        await begin(pilot)
        await press(pilot, "enter", "down")
        monkeypatch.setattr(Stylesheet, "apply", apply)
        await press(pilot, "down")
        lit = [str(each.content) for each in pilot.app.screen.query(".label").results(Label) if each.styles.text_style]
    assert len(lit) == 1  # the one line with the cursor
    assert len(styled) <= 70  # 225 where the whole card is styled


async def test_a_look_at_an_instrument_draws_the_rows_that_changed_and_no_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Red before: each text of the value was folded twice as a whole, and all rows of all parts were taken."""
    folded: list[Text] = []
    taken: list[int] = []
    fold, take = hanging._folded, Widget.render_lines
    async with running(size=SIZE) as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        gauge = pilot.app.screen.query_one(Gauge)
        gauge.follow(Fake([0.0], hold=True), METER, None)
        gauge.show(Look(Measured(4.93, 0.02), ""))
        await settled(pilot)

        def folding(line: Text, *more: Any) -> Iterator[Text]:
            folded.append(line)
            return fold(line, *more)

        def taking(widget: Widget, crop: Region) -> list[Strip]:
            taken.append(crop.height)
            return take(widget, crop)

        monkeypatch.setattr(hanging, "_folded", folding)
        monkeypatch.setattr(Widget, "render_lines", taking)
        gauge.show(Look(Measured(4.95, 0.02), ""))
        await settled(pilot)
    assert "4.950 ± 0.020 µF" in gauge.render().plain
    digits, course, bar, take_it = 3, 1, 2, 1  # rows of one value
    assert 0 < len(folded) <= digits + course + bar + take_it
    assert sum(taken) < 2 * SIZE[1]  # 261 where all rows of all parts are taken


class Rows(App[None]):
    """A text that grows above others, of which some are out of sight."""

    CSS = "#room { height: 1fr; }"

    def compose(self) -> ComposeResult:
        yield Static("head")
        yield VerticalScroll(Static("one", id="grows"), *(Static(f"row {n}") for n in range(30)), id="room")

    def get_default_screen(self) -> Screen[None]:
        screen = Screen[None]()
        screen._compositor = PartialDraw()
        return screen


async def test_what_moved_is_drawn_although_its_place_was_asked_for_before_it_was_laid_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Red before: a result of four rows stood upon the first lines of the records below it. Once the screen had been
    scrolled, a line out of sight that changed meanwhile (the age of a record) had the places found anew."""
    sent: list[ChopsUpdate] = []
    monkeypatch.setattr(Rows, "_display", lambda _, __, update: sent.append(update))
    async with Rows().run_test(size=(20, 10)) as pilot:
        room = pilot.app.screen.query_one("#room")
        for y in (2, 0):
            room.scroll_to(y=y, animate=False, immediate=True)
            await at_rest(pilot)
        sent.clear()
        pilot.app.screen.query_one("#grows", Static).update("one\ntwo\nthree")
        while not pilot.app.screen._layout_required:
            await asyncio.sleep(0)
        pilot.app.screen.query(Static).last().update("changed", layout=False)
        await at_rest(pilot)
    assert {y for y, *_ in sent[0].spans} == set(range(1, 10))


def test_a_plot_of_a_long_record_is_drawn_between_two_keys() -> None:
    """Red before: 0.4 s for each of three, in which no key was answered. A tenth tells it from the 0.025 s of now on a
    slow machine too."""
    f_Hz = np.geomspace(1.0, 4000.0, 40_000)
    H = np.abs(1.0 / (1.0 - (f_Hz / 85.0) ** 2 + 0.02j * f_Hz / 85.0)) * np.random.default_rng(1).lognormal(
        0.0, 0.05, f_Hz.size
    )
    items = (Band(f_Hz[::4], 0.8 * H[::4], 1.2 * H[::4]), Line(f_Hz, H, "measured"))
    began = time.thread_time()
    drawn = draw(Panel("Vs / Va", "f [Hz]", "[V/V]", items, x_log=True, y_log=True), 100, 20)
    assert time.thread_time() - began < 0.1
    assert drawn.bits.any(axis=0).mean() > 0.8  # the curve goes across


def test_a_curve_has_a_dot_in_every_column_that_it_crosses_and_none_beyond_a_gap() -> None:
    raster = Raster(10, 5)
    raster.curve(np.array([0.2, 4.4, np.nan, 6.1, 9.6, 1e6]), np.array([0.1, 4.6, 2.0, 3.3, 3.3, 3.3]), "red")
    columns = np.flatnonzero(raster.bits.any(axis=0))
    assert columns.tolist() == [*range(9), *range(12, 20)]
    assert raster.bits[13, 12:].all()
