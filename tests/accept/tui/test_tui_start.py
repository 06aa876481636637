"""The first screen: whose name is proposed, where the cursor stands, what a refused serial does, leaving at once,
the mouse."""

import threading
from dataclasses import replace

from textual.widgets import Input

from accept.judging import load_spec
from accept.store import open_store
from accept.store.payloads import RunOpened
from accept.tui.app import BenchApp
from accept.tui.background.busy_screen import Working
from accept.tui.screens.start import Given, StartScreen
from tests.accept.tui.tui_help import (
    SETTLED_WITHIN_S,
    at_rest,
    begin,
    loader,
    press,
    running,
    settled,
    until,
    words,
)

KINDS = {"apa": load_spec("apa-basic"), "strut": load_spec("strut-basic")}


def screen(pilot) -> str:
    return type(pilot.app.screen).__name__


def line(pilot, name: str) -> Input:
    return pilot.app.screen.query_one(f"#{name}", Input)


async def test_a_serial_that_is_scanned_while_the_bench_opens_is_no_name():
    with open_store() as store:
        store.write(RunOpened(1), "APA-01", who="Bob")
    go_on = threading.Event()

    def load():
        go_on.wait(2 * SETTLED_WITHIN_S)
        return loader()()

    app = BenchApp(load)
    async with app.run_test(size=(80, 24)) as pilot:
        for key in "APA-07":
            app.simulate_key(key)
        go_on.set()
        await settled(pilot)
        assert (line(pilot, "operator").value, line(pilot, "serial").value) == ("Bob", "APA-07")


async def test_a_burst_with_a_refused_serial_opens_the_unit_that_is_scanned_next():
    async with running() as pilot:
        for key in (*"bad!", "enter", *"APA-02", "enter", "enter"):
            pilot.app.simulate_key(key)
        await settled(pilot)
        assert (screen(pilot), pilot.app.session.serial) == ("Steps", "APA-02")


async def test_the_program_is_left_at_once_while_the_bench_opens():
    go_on = threading.Event()

    def load():
        go_on.wait(2 * SETTLED_WITHIN_S)
        return loader()()

    app = BenchApp(load, Given("Ann"))
    async with app.run_test(size=(80, 24)) as pilot:
        await at_rest(pilot)
        app.simulate_key("ctrl+q")
        await until(lambda: app._exit)
    go_on.set()


async def test_what_is_typed_after_a_click_beside_the_fields_goes_into_the_first():
    async with running() as pilot:
        pilot.app.screen.set_focus(None)
        await press(pilot, *"APA-02", "enter", "enter")
        assert (screen(pilot), pilot.app.session.serial) == ("Steps", "APA-02")


async def test_the_arrows_stay_in_the_fields_and_what_is_typed_there_is_taken():
    """Above the first and below the last field the frame around them had the cursor, and swallowed every letter."""
    async with running(loader("strut-basic")) as pilot:
        await press(pilot, *"ST-01", "enter")
        fields = [field for field in pilot.app.screen.query(Input) if field.region]
        assert [field.id for field in fields[:2]] == ["serial", pilot.app.focused.id]
        await press(pilot, *["down"] * 9)
        assert pilot.app.focused is fields[-1]
        await press(pilot, "ctrl+u", "Q", *["up"] * 9)
        assert pilot.app.focused is fields[0]
        assert fields[-1].value == "Q"


async def test_a_serial_that_is_scanned_where_a_kind_is_chosen_is_another_unit_s():
    async with running(lambda: replace(loader()(), specs=KINDS)) as pilot:
        await press(pilot, *"X-01", "enter")
        assert pilot.app.focused.id == "kind"
        await press(pilot, *"X-02", "enter", "right", "enter")
        assert line(pilot, "serial").value == "X-02"
        assert pilot.app.screen.dialogue.value("kind") == "strut"


async def click(pilot, widget, row: int, times: int = 1) -> None:
    await pilot.click(widget, offset=(3, row), times=times)
    await settled(pilot)


async def test_a_click_marks_a_unit_a_second_one_opens_it_and_queues_are_clicked_too():
    async with running(size=(120, 36)) as pilot:
        for serial in ("APA-01", "APA-02"):
            await begin(pilot, serial)
            await press(pilot, "escape")
        await click(pilot, "#queues", 2)
        assert pilot.app.screen.dialogue.queue.title == "Flatness"
        await click(pilot, "#known", 1)  # below the head of the table: the unit that was begun first is on top
        assert words(pilot, "#about").startswith("Enter opens APA-01")
        await click(pilot, "#known", 2, times=2)
        assert (screen(pilot), pilot.app.session.serial, pilot.app.queue.name) == ("StepScreen", "APA-02", "flatness")


def test_every_key_has_one_label():
    keys = [binding.key for binding in StartScreen.BINDINGS + Working.BINDINGS]
    assert len(keys) == len(set(keys))
