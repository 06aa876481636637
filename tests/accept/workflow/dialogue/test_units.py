"""The dialogue at the list of units: which unit a scan opens, what a tray begins, what is taken off again."""

import pytest

from accept.judging import default_spec
from accept.workflow.dialogue import units as dialogue
from accept.workflow.dialogue.begin import Begun
from accept.workflow.dialogue.units import SCAN, CloseList
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.steps.plan import steps_of
from accept.workflow.steps.unit_list import KnownUnit, queues
from tests.accept.workflow.dialogue.begin_driver import SECRET, Bench, UnitsDriver, known, waiting


def at_list(*serials: str, **more: object) -> UnitsDriver:
    return UnitsDriver(Bench({serial: known(serial) for serial in serials}, **more))


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
        at.types("", row=1)
        at.press("enter")
        at.scans("APA-02")
        assert [leave.unit.serial for leave in at.asked] == ["APA-02", "APA-01", "APA-02"]

    def test_letters_leave_the_units_whose_serial_holds_them(self):
        at = at_list("APA-01", "APA-02", "B-1")
        at.types("a-0", row=1)
        assert (at.listed, at.d.row) == (["APA-02", "APA-01"], 0)
        at.types("q")
        at.types("", row=2)
        assert at.listed == ["B-1", "APA-02", "APA-01"]

    def test_a_unit_that_is_too_old_for_the_list_is_looked_up_and_a_new_one_is_said(self):
        at = at_list("APA-01")
        old = known("APA-00")
        at.bench.known = {"APA-00": old}
        at.scans("APA-00")
        assert at.asked == [CloseList(old)]
        at.scans("APA-77")
        assert "APA-77 is new here" in at.said

    def test_a_unit_of_a_kind_without_a_spec_is_not_opened(self):
        at = UnitsDriver(Bench({"X-1": known("X-1", "beam")}))
        at.press("enter")
        assert at.asked == []
        assert "of kind beam" in at.said

    def test_a_unit_of_a_queue_is_opened_with_it(self):
        at = UnitsDriver(Bench({"APA-01": waiting(known("APA-01")), "APA-02": known("APA-02")}))
        at.press("tab")
        assert (at.d.queue.title, at.listed) == ("Stroke", ["APA-01"])
        assert "Enter opens the marked one" in at.said
        at.press("enter")
        assert at.asked == [CloseList(at.bench.known["APA-01"], at.d.queue)]
        at.scans("APA-02")  # it does not wait there
        assert at.asked[-1].queue is None
        at.press("shift+tab")
        assert at.said == SCAN

    def test_a_queue_that_is_gone_gives_way_to_all_units(self):
        at = UnitsDriver(Bench({"APA-01": waiting(known("APA-01"))}))
        at.press("tab")
        at.answer(dialogue.listed, [known("APA-01")], Bench({"APA-01": known("APA-01")}).queues())
        assert at.d.queue.title == "All units"

    def test_before_the_units_are_there_keys_do_nothing(self):
        d = dialogue.opening(Bench().kinds, "Ann", "apa").state
        assert dialogue.press(d, "enter") == dialogue.press(d, "tab") == dialogue.Turn(d)


class TestTray:
    def test_every_scan_is_a_unit_once(self):
        at = at_list()
        assert "No units yet" in at.said
        at.press("f6")
        at.scans("APA-01", "APA-02", "APA-01")
        assert "APA-01 is here already" in at.said
        assert (at.listed, at.d.text) == (["APA-02", "APA-01"], "")
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

    @pytest.mark.parametrize("kind", ["apa", "ap", ""])
    def test_another_kind_than_the_first_screen_s(self, kind: str):
        """Red before: a kind that was half typed there ended the program at the first scan."""
        at = UnitsDriver(Bench(), kind=kind)
        at.press("f6")
        assert "of kind apa" in at.said
        at.press("tab")
        assert "of kind strut" in at.said
        at.scans("X-1")
        assert [each.kind for each in at.bench.begun] == ["strut"]

    def test_a_serial_that_cannot_be_stays_to_be_replaced(self):
        at = at_list()
        at.press("f6")
        at.scans("bad serial")
        assert (at.d.text, at.role, at.selected, at.bench.begun) == ("bad serial", "bad", True, [])

    def test_a_serial_that_looks_like_a_known_one_is_asked_about(self):
        at = at_list(doubts=["APA-O1"])
        at.press("f6")
        at.scans("APA-O1")
        (asked,) = at.asked
        assert isinstance(asked, Begun)
        at.answer(dialogue.confirmed, asked, None)
        assert "not confirmed, and not added" in at.said
        assert not at.bench.begun
        at.answer(dialogue.confirmed, asked, "APA-O1")
        assert [each.confirmed for each in at.bench.begun] == [True]

    def test_without_a_name_nothing_is_added_or_taken_off(self):
        at = UnitsDriver(Bench({"APA-01": known("APA-01")}), operator="")
        for key in ("f6", "ctrl+z"):
            at.press(key)
            assert "Enter your name on the first screen" in at.said
        assert not at.d.adds

    def test_a_passphrase_is_taken_away(self):
        at = at_list("APA-01")
        for key in ("enter", "f6"):
            at.types(SECRET)
            at.press(key)
            assert (at.said, at.d.text, at.d.adds, at.asked) == (NOT_TAKEN, "", False, [])

    def test_escape_ends_the_tray_before_it_leaves(self):
        at = at_list("APA-01")
        at.press("f6", "escape")
        assert (at.said, at.asked) == (SCAN, [])
        at.press("escape")
        assert at.asked == [CloseList()]


class TestTakingOff:
    def test_a_mistake_is_taken_off_when_asked_twice_with_nothing_between(self):
        """Red before: a key between the two left the question open, though the foot said something else."""
        at = at_list()
        at.press("f6")
        at.scans("APA-01", "apa-02")
        at.press("ctrl+z", "tab", "ctrl+z")
        assert "Ctrl+Z again: take apa-02 off" in at.said
        assert at.listed == ["apa-02", "APA-01"]
        at.press("ctrl+z")
        assert at.listed == ["APA-01"]
        at.scans("APA-02")
        assert "(2)" in at.said

    @pytest.mark.parametrize("done", [{"last": "12.5 um"}, {"notes": 1}, {"attempt": 2}])
    def test_a_unit_at_which_something_was_done_stays_and_is_not_asked_about(self, done: dict[str, object]):
        at = UnitsDriver(Bench({"APA-01": known("APA-01", **done)}))
        at.press("ctrl+z")
        assert (at.said, at.role) == ("APA-01 stays: something was done at it", "bad")

    def test_an_empty_list_says_so(self):
        at = at_list()
        at.press("ctrl+z")
        assert at.said == "No unit to take off the list"
