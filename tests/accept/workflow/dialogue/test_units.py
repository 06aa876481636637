"""The list on the first screen: which unit a scan opens, what a tray begins, what is taken off again."""

from dataclasses import replace

import pytest

from accept.judging import default_spec
from accept.workflow.dialogue import start
from accept.workflow.dialogue import units as dialogue
from accept.workflow.dialogue.start import Do, WaitForBench
from accept.workflow.dialogue.start_state import SCAN
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.steps.plan import steps_of
from accept.workflow.steps.unit_list import KnownUnit, queues
from tests.accept.workflow.dialogue.begin_driver import SECRET, Bench, Doubt, Driver, known, waiting


def at_list(*serials: str, **more: object) -> Driver:
    return Driver(Bench({serial: known(serial) for serial in serials}, **more), operator="Ann")


def test_the_names_of_the_lists_are_whole():
    specs = {kind: default_spec(kind) for kind in ("apa", "strut")}
    units = [
        KnownUnit(kind, kind, 1, None, 0, 0, steps=1, waiting=tuple(step.name for step in steps_of(spec)))
        for kind, spec in specs.items()
    ]
    assert all(len(queue.title) <= 19 for queue in queues(units, specs))


class TestOpening:
    def test_a_scan_opens_its_unit_and_enter_the_marked_one(self):
        at = at_list("APA-01", "APA-02")
        assert at.listed == ["APA-02", "APA-01"]
        at.press("enter")
        at.press("down", "down", "enter")
        at.enters("APA-02")
        assert at.opens == ["APA-02", "APA-01", "APA-02"]

    def test_letters_leave_the_units_whose_serial_holds_them(self):
        at = at_list("APA-01", "APA-02", "B-1")
        at.types("a-0")
        assert (at.listed, at.d.row) == (["APA-02", "APA-01"], 0)
        at.press("down")  # the marked one is taken, not passed
        assert (at.d.value("serial"), at.listed) == ("APA-02", ["APA-02", "APA-01"])
        at.types("q")
        assert at.d.nothing.startswith("No unit of this list has these letters")
        at.types("")
        assert at.listed == ["B-1", "APA-02", "APA-01"]

    def test_the_cursor_stands_at_what_is_proposed_and_at_the_unit_that_was_left(self):
        bench = Bench({serial: known(serial) for serial in ("APA-01", "APA-02")})
        for given in ({"serial": "APA-01"}, {"left": "APA-01"}):
            at = Driver(bench, operator="Ann", **given)
            assert (at.listed, at.d.here.serial) == (["APA-02", "APA-01"], "APA-01")

    def test_a_unit_that_is_too_old_for_the_list_is_looked_up(self):
        at = at_list("APA-01")
        at.bench.known = {"APA-00": known("APA-00")}
        at.enters("APA-00")
        assert at.opens == ["APA-00"]

    def test_a_unit_of_a_kind_without_a_spec_is_not_opened(self):
        at = Driver(Bench({"X-1": known("X-1", "beam")}), operator="Ann")
        at.press("enter")
        assert at.asked == []
        assert "of kind beam" in at.said

    def test_a_unit_of_a_queue_is_opened_with_it(self):
        at = Driver(Bench({"APA-01": waiting(known("APA-01")), "APA-02": known("APA-02")}), operator="Ann")
        at.press("tab")
        assert (at.d.queue.title, at.listed) == ("Stroke", ["APA-01"])
        assert "Enter opens the marked one" in at.said
        at.press("enter")
        assert (at.opens, at.asked[-1].queue) == (["APA-01"], at.d.queue)
        at.enters("APA-02")  # it does not wait there
        assert at.asked[-1].queue is None
        at.press("shift+tab")
        assert at.said == SCAN
        at.press("enter")
        assert at.asked[-1].queue is None  # nor does one of all units

    def test_a_queue_that_is_gone_gives_way_to_all_units(self):
        at = Driver(Bench({"APA-01": waiting(known("APA-01"))}), operator="Ann")
        at.press("tab")
        at.answer(dialogue.listed, Bench({"APA-01": known("APA-01")}).overview)
        assert at.d.queue.title == "All units"

    def test_the_units_to_sign_are_opened_by_one_key_from_the_first(self):
        done = {serial: known(serial, steps=4) for serial in ("APA-01", "APA-02")}
        at = Driver(Bench(done), operator="Ann")
        at.press("ctrl+s")
        assert (at.opens, at.asked[-1].queue.title) == (["APA-01"], "To sign")
        at = at_list("APA-01")
        at.press("ctrl+s")
        assert (at.said, at.asked) == ("No unit waits for a signature", [])

    def test_a_click_marks_a_unit_and_two_open_it(self):
        at = at_list("APA-01", "APA-02")
        at.answer(start.point, 1, False)
        assert (at.d.value("serial"), at.asked) == ("APA-01", [])
        at.answer(start.point, 0, True)
        assert at.opens == ["APA-02"]

    def test_keys_that_need_the_units_wait_for_them_and_a_scan_does_not(self):
        at = at_list("APA-01")
        d = replace(at.d, lists=True, listed=None)
        for key in ("enter", "tab", "f6", "ctrl+z", "ctrl+s"):
            assert start.press(d, key).effects == (WaitForBench(key, for_list=True),)
        at.d = d
        at.enters("APA-01")
        assert at.opens == ["APA-01"]

    def test_a_list_that_cannot_be_read_holds_nobody_up(self):
        at = at_list("APA-01", fails=True)
        at.press("tab", "enter")
        assert at.said == "Enter the serial number"
        at.enters("APA-01")
        assert at.opens == ["APA-01"]


class TestTray:
    def test_every_scan_is_a_unit_once(self):
        at = at_list()
        assert "No units yet" in at.d.nothing
        at.press("f6")
        at.enters("APA-01", "APA-02", "APA-01")
        assert "APA-01 is here already" in at.said
        assert (at.listed, at.d.value("serial")) == (["APA-02", "APA-01"], "")
        at.press("enter")
        assert "2 added" in at.said
        assert [(each.serial, each.kind, each.operator) for each in at.bench.begun] == [
            ("APA-01", "apa", "Ann"),
            ("APA-02", "apa", "Ann"),
        ]

    def test_f6_adds_what_is_typed_already(self):
        at = at_list()
        at.types("APA-01")
        at.press("f6")
        assert at.said.startswith("APA-01 added (1)")

    def test_a_unit_that_is_proposed_is_none_of_the_tray(self):
        at = Driver(operator="Ann", serial="APA-02")
        at.press("f6")
        assert (at.d.value("serial"), at.bench.begun) == ("", [])

    @pytest.mark.parametrize("kind", ["apa", "ap", ""])
    def test_another_kind_than_the_unit_before(self, kind: str):
        """Red before: a kind that was half typed ended the program at the first scan."""
        at = Driver(Bench(), operator="Ann", kind=kind)
        at.press("f6")
        assert "of kind apa" in at.said
        at.press("tab")
        assert "of kind strut" in at.said
        at.enters("X-1")
        assert [each.kind for each in at.bench.begun] == ["strut"]

    def test_a_kind_that_follows_from_the_serial_is_taken(self):
        at = at_list(describes={"strut": "ST"})
        at.press("f6")
        at.enters("ST-1", "X-1")
        assert [each.kind for each in at.bench.begun] == ["strut", "apa"]

    def test_a_serial_that_cannot_be_stays_to_be_replaced(self):
        at = at_list()
        at.press("f6")
        at.enters("bad serial")
        assert (at.d.value("serial"), at.role, at.selected, at.bench.begun) == ("bad serial", "bad", True, [])

    def test_a_serial_that_looks_like_a_known_one_is_asked_about(self):
        at = at_list(doubts=["APA-O1"])
        at.press("f6")
        at.enters("APA-O1")
        (asked,) = at.asked
        assert isinstance(asked, Doubt)
        at.answer(asked.event, asked.begun, None)
        assert "not confirmed, and not added" in at.said
        assert not at.bench.begun
        at.answer(asked.event, asked.begun, "APA-O1")
        assert [each.confirmed for each in at.bench.begun] == [True]

    def test_without_a_name_nothing_is_added_or_taken_off(self):
        at = Driver(Bench({"APA-01": known("APA-01")}))
        for key in ("f6", "ctrl+z"):
            at.stands_at("serial")
            at.press(key)
            assert (at.said, at.d.cursor) == ("Enter your name", "operator")
        assert not at.d.adds

    def test_a_passphrase_is_taken_away(self):
        at = at_list("APA-01")
        for key in ("enter", "f6"):
            at.types(SECRET)
            at.press(key)
            assert (at.said, at.d.value("serial"), at.d.adds, at.asked) == (NOT_TAKEN, "", False, [])

    def test_escape_ends_the_tray_before_it_leaves(self):
        at = at_list("APA-01")
        at.press("f6", "escape")
        assert (at.said, at.asked) == (SCAN, [])
        at.press("f6")
        assert ("f6" in at.d.idle_keys, at.d.called["escape"]) == (True, "Tray done")  # F6 begins one, and that alone
        at.enters("APA-02")
        at.press("escape")
        assert at.said.startswith("1 added. Tab: ")
        at.press("escape")
        assert at.asked == []
        at.press("escape")
        assert at.asked == [Do.LEAVE]


class TestTakingOff:
    def test_a_mistake_is_taken_off_when_asked_twice_with_nothing_between(self):
        """Red before: a key between the two left the question open, though the foot said something else."""
        at = at_list()
        at.press("f6")
        at.enters("APA-01", "apa-02")
        at.press("ctrl+z", "tab", "ctrl+z")
        assert "Ctrl+Z again: take apa-02 off" in at.said
        assert at.listed == ["apa-02", "APA-01"]
        at.press("ctrl+z")
        assert at.listed == ["APA-01"]
        at.enters("APA-02")
        assert "(2)" in at.said

    @pytest.mark.parametrize("done", [{"last": "12.5 um"}, {"notes": 1}, {"attempt": 2}])
    def test_a_unit_at_which_something_was_done_stays_and_is_not_asked_about(self, done: dict[str, object]):
        at = Driver(Bench({"APA-01": known("APA-01", **done)}), operator="Ann")
        at.press("ctrl+z")
        assert (at.said, at.role) == ("APA-01 stays: something was done at it", "bad")

    def test_an_empty_list_says_so(self):
        at = at_list()
        at.press("ctrl+z")
        assert at.said == "No unit to take off the list"
