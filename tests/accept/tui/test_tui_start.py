"""The first screen: whose name is proposed, where the cursor stands, what a refused serial does, leaving at once."""

import asyncio
import threading
from dataclasses import replace

import pytest
from textual.widgets import Input

from accept.base.home import home
from accept.base.names import is_system_account
from accept.certificate.trust import keys
from accept.store import open_store
from accept.store.payloads import RunOpened
from accept.tui.app import BenchApp
from accept.tui.screens.start import Given
from accept.workflow.bench import Begun
from accept.workflow.certify import Signing
from accept.workflow.open_bench import open_bench
from accept.workflow.training import open_training
from checks.declare import Measured
from tests.accept.tui.tui_help import (
    APART,
    SETTLED_WITHIN_S,
    at_rest,
    begin,
    fill_values,
    loader,
    press,
    running,
    settled,
    type_line,
    until,
    words,
)

BAD = "bad serial"


def screen(pilot) -> str:
    return type(pilot.app.screen).__name__


def line(pilot, name: str) -> Input:
    return pilot.app.screen.query_one(f"#{name}", Input)


@pytest.mark.parametrize(("last", "proposed"), [("Bob", "Bob"), ("root", ""), ("", "")])
async def test_the_last_operator_here_is_proposed_and_no_account_of_a_machine(last: str, proposed: str):
    if last:
        with open_store() as store:
            store.write(RunOpened(1), "APA-01", who=last)
    async with running(given=Given()) as pilot:
        assert line(pilot, "operator").value == proposed
        assert pilot.app.focused is line(pilot, "serial" if proposed else "operator")


@pytest.mark.parametrize(("operator", "proposed"), [("Ann", "APA-02"), ("", "APA-02"), ("Bob", "")])
async def test_the_next_start_proposes_the_unit_that_was_being_measured(operator: str, proposed: str):
    async with running() as pilot:
        await begin(pilot, "APA-02")
        await press(pilot, "enter", "1", "enter", "ctrl+q")
    async with running(given=Given(operator)) as pilot:
        assert line(pilot, "serial").value == proposed
        await press(pilot, *([] if proposed else "APA-02"), "enter")  # one that is known opens at once
        assert screen(pilot) == "Steps"
        assert len(pilot.app.session.state("flatness").entries) == 1


async def test_a_scan_replaces_the_proposed_unit():
    async with running() as pilot:
        await begin(pilot, "APA-02")
        await press(pilot, "enter", "1", "enter", "ctrl+q")
    async with running() as pilot:
        await press(pilot, *"APA-03", "enter")
        assert line(pilot, "serial").value == "APA-03"


async def test_a_unit_of_a_tray_or_one_that_is_signed_is_not_proposed():
    with open_store() as store:
        store.write(RunOpened(1), "APA-01", who="Ann")  # in the list of another bench
    async with running() as pilot:
        assert not line(pilot, "serial").value
        await begin(pilot, "APA-02")
    async with running() as pilot:
        assert not line(pilot, "serial").value  # nothing was measured
        await begin(pilot, "APA-02")
        await fill_values(pilot)
        keys.init(home(), "correct horse", "Ann")
        await asyncio.to_thread(Signing(pilot.app.session).sign, "correct horse")
    async with running() as pilot:
        assert not line(pilot, "serial").value


def test_a_training_goes_on_with_its_unit_unless_another_was_asked_for():
    begun = Begun("TRAIN-000003", "apa", "Ann")
    bench = open_training("apa-basic", 3)
    session, _ = bench.at_unit(begun).open_unit(begun)
    session.entries.take("capacitance", session.step("capacitance").check.inputs["sensor_uF"], Measured(4.99))
    session.close()
    bench.close()
    for seed, proposed in ((None, "TRAIN-000003"), (3, "")):
        bench = open_training("apa-basic", seed)
        assert bench.unfinished("Ann") == proposed
        bench.close()


def test_accounts_of_machines_are_known():
    assert is_system_account("root")
    assert is_system_account("daemon")
    assert not is_system_account("Ann")


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


async def test_without_a_name_the_unit_is_not_begun_and_the_cursor_goes_there():
    async with running(given=Given("", "APA-07")) as pilot:
        line(pilot, "kind").focus()
        await press(pilot, "enter")
        assert "your name" in words(pilot, "#status")
        assert pilot.app.focused is line(pilot, "operator")
        await press(pilot, *"Ann", "enter", "enter", "enter")
        assert (screen(pilot), pilot.app.session.operator) == ("Steps", "Ann")


async def test_enter_on_a_refused_serial_stays_there_and_the_next_scan_replaces_it():
    async with running() as pilot:
        await type_line(pilot, BAD)
        assert pilot.app.focused is line(pilot, "serial")
        assert f"serial '{BAD}': expected" in words(pilot, "#status")
        await press(pilot, "enter")
        assert (screen(pilot), line(pilot, "serial").value) == ("StartScreen", BAD)
        await press(pilot, *"APA-02", "enter", "enter")
        assert (screen(pilot), pilot.app.session.serial) == ("Steps", "APA-02")


async def test_a_burst_with_a_refused_serial_opens_the_unit_that_is_scanned_next():
    async with running() as pilot:
        for key in (*"bad!", "enter", *"APA-02", "enter", "enter"):
            pilot.app.simulate_key(key)
        await settled(pilot)
        assert (screen(pilot), pilot.app.session.serial) == ("Steps", "APA-02")


async def test_one_enter_passes_the_parts_that_stay_empty():
    async with running(lambda: replace(open_bench("strut"), services=APART)) as pilot:
        await press(pilot, *"ST-01", "enter", "enter")
        assert screen(pilot) == "StartScreen"
        await press(pilot, *"APA-07", "enter")  # the first part is given, the others are not
        assert screen(pilot) == "StartScreen"
        await press(pilot, "enter")
        assert screen(pilot) == "Steps"
        assert list(pilot.app.session.attempt.parts.values()) == ["APA-07"]


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


async def test_why_a_kind_was_refused_is_said_once_and_goes_when_the_kind_is_right():
    async with running(loader("")) as pilot:  # a serial fits both kinds
        line(pilot, "serial").value, line(pilot, "kind").value = "APA-02", "app"
        line(pilot, "kind").focus()
        await press(pilot, "enter")
        assert "kind" in words(pilot, "#status")
        assert "kind" not in words(pilot, "#about")
        await press(pilot, "ctrl+u", *"apa")
        assert pilot.app.focused is line(pilot, "kind")
        assert "kind" not in words(pilot, "#status")
        assert "new unit APA-02" in words(pilot, "#about")
        await press(pilot, "enter")
        assert screen(pilot) == "Steps"
