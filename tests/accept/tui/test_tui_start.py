"""The first screen: whose name is proposed, where the cursor stands, what a refused serial does, leaving at once."""

import threading

from textual.widgets import Input

from accept.store import open_store
from accept.store.payloads import RunOpened
from accept.tui.app import BenchApp
from accept.tui.screens.start import Given
from tests.accept.tui.tui_help import (
    SETTLED_WITHIN_S,
    at_rest,
    loader,
    press,
    running,
    settled,
    until,
)

BAD = "bad serial"


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
    async with running() as pilot:
        fields = [line(pilot, name) for name in ("operator", "serial", "kind")]
        for start, key in ((fields[0], "up"), (fields[-1], "down"), (fields[1], "up"), (fields[1], "down")):
            start.focus()
            await press(pilot, key)
            assert pilot.app.focused in fields
            here = pilot.app.focused
            await press(pilot, "ctrl+u", "Q")
            assert here.value == "Q"
