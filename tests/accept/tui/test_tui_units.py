"""Several units in one session: a tray, the same step of one unit after the other, scans anywhere, signatures."""

import threading
from dataclasses import replace

import pytest
from textual.widgets import DataTable, Input

from accept.base.home import home
from accept.certificate.trust import keys
from accept.judging import load_spec
from accept.store import open_store
from accept.tui.screens.summary import Summary
from accept.tui.widgets.step_list import StepList
from accept.workflow.certify import Signing
from accept.workflow.steps.unit_list import known_units
from accept.workflow.worker.judging import Elsewhere
from tests.accept.tui.tui_help import (
    HEIGHTS,
    SETTLED_WITHIN_S,
    begin,
    fill_values,
    loader,
    press,
    running,
    settled,
    type_line,
    words,
)
from tests.accept.workflow.test_unit_list import SPECS

TRAY = [f"APA-{n:02d}" for n in range(1, 11)]


def screen(pilot) -> str:
    return type(pilot.app.screen).__name__


async def add_tray(pilot, serials=TRAY) -> None:
    """From the first screen: scan each, then the list of one step."""
    await press(pilot, "f6")
    for serial in serials:
        await type_line(pilot, serial)
    await press(pilot, "f6")


async def open_list(pilot, title: str) -> None:
    rail = pilot.app.screen.query_one("#queues", DataTable)
    for _ in range(rail.row_count):
        if title in str(rail.get_row_at(rail.cursor_row)[0]):
            return
        await press(pilot, "tab")
    raise AssertionError(title)


def values() -> dict[str, list[float]]:
    with open_store() as store:
        taken = list(store.events(what="value_taken"))
    return {s: [e.data["value"] for e in taken if e.subject == s] for s in sorted({e.subject for e in taken})}


@pytest.mark.slow
async def test_ten_capacitances_in_a_row_typed_without_waiting():
    async with running() as pilot:
        await add_tray(pilot, [*TRAY, TRAY[0]])  # scanned twice it is one unit
        await open_list(pilot, "Capacitance")
        await press(pilot, "enter")
        for n in range(len(TRAY)):
            await pilot.press(*f"4.9{n}", "enter", *f"9.8{n}", "enter", "enter")
        await settled(pilot)
        typed = {serial: [float(f"4.9{n}"), float(f"9.8{n}")] for n, serial in enumerate(TRAY)}
        assert values() == typed
        assert pilot.app.session.serial == TRAY[-1]
        assert "No other unit waits" in words(pilot, "#status")
        with open_store() as store:
            assert {unit.serial for unit in known_units(store, SPECS)} == set(TRAY)
            judged = [e.subject for e in store.events(what="step_judged")]
        assert judged == TRAY  # each was judged before the next was opened


async def test_the_same_step_of_the_next_unit_by_one_key_and_what_was_found_is_said():
    async with running() as pilot:
        await add_tray(pilot, TRAY[:2])
        await type_line(pilot, TRAY[0])
        pilot.app.screen.query_one(StepList).stand_at("capacitance")
        await press(pilot, "enter")
        await type_line(pilot, "1.7")
        await type_line(pilot, "9.8")
        await press(pilot, "f10")
        assert screen(pilot) == "StepScreen"
        assert (pilot.app.session.serial, pilot.app.screen.step.name) == (TRAY[1], "capacitance")
        assert f"{TRAY[0]}: ✗ fail" in words(pilot, "#status")


async def test_a_scan_goes_to_its_unit_wherever_it_comes():
    async with running() as pilot:
        await add_tray(pilot, TRAY[:3])
        await type_line(pilot, TRAY[0])
        assert screen(pilot) == "Steps"
        await press(pilot, *TRAY[1], "enter")
        assert (screen(pilot), pilot.app.session.serial) == ("Steps", TRAY[1])
        await press(pilot, "enter")
        await type_line(pilot, TRAY[2])  # into the line of a height
        assert (screen(pilot), pilot.app.session.serial) == ("StepScreen", TRAY[2])
        assert pilot.app.screen.step.name == "flatness"
        await type_line(pilot, HEIGHTS)
        await press(pilot, *TRAY[0], "enter")  # at a complete step
        assert (screen(pilot), pilot.app.session.serial) == ("StepScreen", TRAY[0])
        await press(pilot, "escape", "f9")
        await press(pilot, *"APA-77", "enter")  # a new one, from the summary: it might be a passphrase
        assert screen(pilot) == "Summary"
        assert "77" not in words(pilot, "#status")
        await press(pilot, *"APA-77", "enter")
        assert screen(pilot) == "StartScreen"
        assert pilot.app.screen.query_one("#serial", Input).value == "APA-77"
        assert "APA-77 is a new unit" in words(pilot, "#about")
    assert set(values()) == {TRAY[2]}


async def test_a_stray_letter_goes_nowhere():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "s", "enter")
        assert screen(pilot) == "Steps"
        assert "No unit of that serial" in words(pilot, "#status")
        await press(pilot, "enter")
        assert screen(pilot) == "StepScreen"


@pytest.mark.slow
async def test_one_passphrase_for_a_shift_and_one_unit_after_the_other_to_sign():
    keys.init(home(), "correct horse", "Ann")
    async with running() as pilot:
        for serial, more in (("APA-01", 0.0), ("APA-02", 0.01)):
            await begin(pilot, serial)
            await fill_values(pilot, more)
            await press(pilot, "escape")
        await press(pilot, "ctrl+s")
        assert (screen(pilot), pilot.app.session.serial) == ("Summary", "APA-01")
        await press(pilot, "f2")
        await type_line(pilot, "correct horse")
        assert "✓ verified" in words(pilot, "#certificate")
        await press(pilot, "f4")
        await settled(pilot)
        assert (screen(pilot), pilot.app.session.serial) == ("Summary", "APA-02")
        await press(pilot, "f2")
        assert not pilot.app.screen.query(Input)  # no passphrase is asked
        await press(pilot, "enter")
        assert "✓ verified" in words(pilot, "#certificate")
        await press(pilot, "ctrl+l")
        assert pilot.app.shift.passphrase("Ann") is None


async def test_a_unit_that_is_open_elsewhere_is_said_and_nothing_is_lost():
    async with running() as pilot:
        await add_tray(pilot, TRAY[:2])
        await type_line(pilot, TRAY[0])
        other = loader()()
        session = other.session(TRAY[1], "apa", "Bob")
        await press(pilot, *TRAY[1], "enter")
        assert screen(pilot) == "StartScreen"
        assert TRAY[1] in words(pilot, "#status")
        session.close()
        other.store.close()


def judging_waits(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Hold every judgement of a unit back until the event is set."""
    go_on, judge = threading.Event(), Elsewhere.judge

    def slowly(self, *given):
        go_on.wait(SETTLED_WITHIN_S)
        return judge(self, *given)

    monkeypatch.setattr(Elsewhere, "judge", slowly)
    return go_on


@pytest.mark.slow
async def test_a_passphrase_typed_while_the_unit_is_evaluated_is_not_lost_nor_shown(monkeypatch: pytest.MonkeyPatch):
    keys.init(home(), "correct horse", "Ann")
    go_on = judging_waits(monkeypatch)
    async with running() as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await pilot.press("f9", "f2", *"correct", "space", *"horse", "enter")  # at once, as a hand does it
        assert "horse" not in pilot.app.export_screenshot()
        go_on.set()
        await settled(pilot)
        assert "You sign as technician: ACCEPTED" in words(pilot, ".words")
        with open_store() as store:
            assert not list(store.events(what="certificate_signed"))
        await press(pilot, "enter")
        assert "✓ verified" in words(pilot, "#certificate")


@pytest.mark.parametrize("key", ["f4", "escape"])
async def test_the_summary_is_left_when_the_certificate_is_signed_and_shown(key: str, monkeypatch: pytest.MonkeyPatch):
    keys.init(home(), "correct horse", "Ann")
    go_on, sign, leave, left = threading.Event(), Signing.sign, Summary.leave, []

    def slowly(self, *given):
        go_on.wait(SETTLED_WITHIN_S)
        return sign(self, *given)

    def leaves(self, result=None):
        left.append(self.session.attempt.certificate)
        leave(self, result)

    monkeypatch.setattr(Signing, "sign", slowly)
    monkeypatch.setattr(Summary, "leave", leaves)
    async with running() as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9", "f2")
        await pilot.press(*"correct", "space", *"horse", "enter", key)  # while the certificate is drawn
        go_on.set()
        await settled(pilot)
        assert len(left) == 1
        assert left[0]
        assert screen(pilot) == ("StartScreen" if key == "f4" else "Steps")
        assert pilot.app.shift.passphrase("Ann") == "correct horse"


async def test_a_key_that_was_open_when_the_bench_was_left_signs_nothing_afterwards():
    keys.init(home(), "correct horse", "Ann")
    async with running() as pilot:
        await begin(pilot)
        await fill_values(pilot)
        pilot.app.shift.keep("Ann", "correct horse")
        await press(pilot, "f9", "f2")
        assert "The key of Ann is open. Enter: sign" in words(pilot, ".words")
        pilot.app.shift._touched -= 16 * 60.0
        await press(pilot, "enter")  # somebody else's
        assert "It opens your key for this shift" in words(pilot, ".words")
        await type_line(pilot, "correct horse")
        assert "✓ verified" in words(pilot, "#certificate")


async def test_values_typed_over_the_list_of_steps_go_into_the_step_under_the_cursor():
    """They began a unit of the serial 24.05."""
    async with running() as pilot:
        await begin(pilot, TRAY[0])
        for key in (*"0", "enter", *"24.05", "enter", *"-3", "enter", *"0.018 mm", "enter"):
            pilot.app.simulate_key("space" if key == " " else key)
        await settled(pilot)
        assert (screen(pilot), pilot.app.session.serial) == ("StepScreen", TRAY[0])
        step = pilot.app.session.state("flatness")
        assert [(entry.index, entry.value) for entry in step.entries] == [(0, 0.0), (1, 24.05), (2, -3.0), (3, 18.0)]
        assert pilot.app.screen.dialogue.here.place.index == 4
    with open_store() as store:
        assert {event.subject for event in store.events(what="attempt_started")} == {TRAY[0]}


async def test_a_unit_whose_serial_is_digits_is_opened_by_its_scan_and_a_new_one_is_asked_about():
    async with running() as pilot:
        await begin(pilot, "40.5")
        await press(pilot, "escape")
        await begin(pilot, TRAY[0])
        await press(pilot, *"40.5", "enter")
        assert (screen(pilot), pilot.app.session.serial) == ("Steps", "40.5")
        await press(pilot, *"4711", "enter", "down", "up", "enter")  # what else is pressed is another answer
        assert (screen(pilot), pilot.app.session.serial) == ("StepScreen", "40.5")
        await press(pilot, "escape", *"4711", "enter", *"4712", "enter")
        assert "4712" in words(pilot, "#status")
        await press(pilot, "enter")
        assert screen(pilot) == "StartScreen"
        assert pilot.app.screen.query_one("#serial", Input).value == "4712"
    assert not values()


async def test_digits_that_fit_the_pattern_of_a_spec_are_a_serial():
    own = load_spec("apa-basic").model_copy(update={"serial_pattern": "[0-9]{4}"})
    async with running(lambda: replace(loader()(), specs={"apa": own})) as pilot:
        await begin(pilot, "4710")
        await press(pilot, *"4711", "enter")
        assert screen(pilot) == "StartScreen"
        assert pilot.app.screen.query_one("#serial", Input).value == "4711"


async def test_a_passphrase_that_is_typed_before_it_is_asked_for_is_not_shown_and_begins_no_unit():
    async with running() as pilot:
        await begin(pilot, TRAY[0])
        await press(pilot, "f9")
        for key in ("c", "o", "rrect-horse"):
            await press(pilot, *key)
            assert "co" not in words(pilot, "#status")
        await press(pilot, "enter", "enter")
        assert screen(pilot) == "Summary"
        assert "^S first" in words(pilot, "#status")
        assert "horse" not in words(pilot, "#status")


async def test_the_key_of_one_technician_is_locked_when_another_begins():
    async with running() as pilot:
        pilot.app.shift.keep("Ann", "correct horse")
        await begin(pilot, TRAY[0])
        assert pilot.app.shift.passphrase("Ann") == "correct horse"
        await press(pilot, "escape", "ctrl+o", *"Ben", "enter")
        await begin(pilot, TRAY[0])
        assert pilot.app.session.operator == "Ben"
        assert pilot.app.shift.passphrase("Ann") is None
