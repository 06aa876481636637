"""The dialogue on the first screen: whose name is proposed, where the cursor stands, what a refused serial does, and
which unit is begun."""

import pytest

from accept.workflow.dialogue import start as dialogue
from accept.workflow.dialogue.begin import LookUp
from accept.workflow.dialogue.start import Do, OpenBench, Proposed, WaitForBench
from accept.workflow.entry.shift import NOT_TAKEN
from tests.accept.workflow.dialogue.begin_driver import SECRET, Bench, Doubt, Driver, known

APA = Bench(pattern={"apa": "APA"})


def bench(*serials: str, **more: object) -> Bench:
    return Bench({serial: known(serial) for serial in serials}, **more)


def begun(at: Driver) -> list[tuple[str, str, str]]:
    return [(each.serial, each.kind, each.operator) for each in at.bench.begun]


class TestOpening:
    @pytest.mark.parametrize(("given", "cursor"), [({}, "operator"), ({"operator": "Ann"}, "serial")])
    def test_keys_wait_for_the_bench_where_it_knows_who_worked_there(self, given: dict[str, str], cursor: str):
        turn = dialogue.opening(given)
        assert turn.effects == (OpenBench(given.get("operator", ""), holds=not given),)
        assert turn.state.cursor == cursor

    def test_the_last_operator_is_proposed_and_the_cursor_goes_to_the_serial(self):
        at = Driver(proposed=Proposed("Bob", "APA-02"))
        assert at.values() == {"operator": "Bob", "serial": "APA-02", "kind": "apa"}
        assert (at.d.cursor, at.selected) == ("serial", True)  # a scan replaces what is proposed
        assert Driver().d.cursor == "operator"

    def test_what_is_given_is_not_replaced_by_what_is_proposed(self):
        at = Driver(proposed=Proposed("Bob", "APA-02"), operator="Ann", serial="APA-01", kind="strut")
        assert at.values() == {"operator": "Ann", "serial": "APA-01", "kind": "strut"}
        assert not at.selected

    def test_the_folder_of_a_unit_states_its_serial_kind_and_parts(self):
        texts = {"serial": "ST-01", "kind": "strut", "apa": "APA-07", "other": "x"}
        at = Driver(proposed=Proposed("Ann", "", texts), serial="?")
        assert at.values() == {"operator": "Ann", "serial": "ST-01", "kind": "strut", "apa": "APA-07"}

    def test_why_the_unit_that_was_wanted_is_not_open_is_said_first(self):
        opened = dialogue.opened(dialogue.opening({}, "store: locked", True).state, APA.kinds, Proposed())
        assert (opened.words.text, opened.words.role) == ("store: locked", "bad")

    def test_a_bench_that_does_not_open_begins_nothing(self):
        d = dialogue.nothing_came(dialogue.opening({"operator": "Ann", "serial": "APA-01"}).state, "locked").state
        refused = dialogue.press(d, "enter")
        said = dialogue.recognized(refused.state, *refused.effects, None).words.text
        assert said == "locked. Esc, Esc: end the program"  # red before: the reason was gone after a key


class TestSerial:
    def test_a_new_one_goes_on_to_its_kind_and_a_known_one_opens_at_once(self):
        at = Driver(bench("APA-02"), operator="Ann")
        at.enters("APA-03")
        assert (at.d.cursor, at.d.about) == ("kind", "Enter begins APA-03, a new unit of kind apa")
        at.press("enter")
        assert begun(at) == [("APA-03", "apa", "Ann")]
        at = Driver(bench("APA-02"), operator="Ann")
        at.enters("APA-02")
        assert begun(at) == [("APA-02", "apa", "Ann")]

    def test_enter_waits_until_it_is_known_what_a_serial_means(self):
        at = Driver(bench("APA-02"), operator="Ann")
        at.waits = True
        at.enters("APA-02")
        assert [*at.threads] == [LookUp("APA-02", "Ann"), WaitForBench("enter")]
        assert not at.bench.begun
        at.arrive()
        assert begun(at) == [("APA-02", "apa", "Ann")]

    def test_what_is_known_of_an_earlier_serial_is_not_said_of_the_present_one(self):
        at = Driver(bench("APA-02"), operator="Ann")
        at.waits = True
        at.types("APA-02")
        at.types("APA-03")
        at.arrive()
        assert at.d.known is None
        assert at.d.about.startswith("APA-03 is a new unit")

    def test_a_look_that_fails_holds_nobody_up(self):
        at = Driver(operator="Ann")
        at.waits = True
        at.types("APA-02")
        at.threads.clear()
        at.answer(dialogue.nothing_came, "locked")
        at.press("enter")
        at.arrive()
        assert at.d.cursor == "kind"

    def test_a_refused_one_stays_and_the_next_scan_replaces_it(self):
        at = Driver(Bench(pattern={"apa": "APA"}), operator="Ann")
        at.types("bad serial")
        assert at.d.about == "✗ serial 'bad serial': expected APA..., no spaces"
        at.press("enter", "enter")
        assert (at.d.cursor, at.said, at.role, at.selected) == ("serial", at.d.about[2:], "bad", True)
        at.types("APA-02")
        assert at.role == "quiet"  # why it was refused goes with it
        at.press("enter", "enter")
        assert begun(at) == [("APA-02", "apa", "Ann")]

    def test_a_serial_that_fits_one_kind_only_proposes_it(self):
        at = Driver(Bench(pattern={"apa": "APA", "strut": "ST"}), operator="Ann")
        at.types("ST-01")
        assert at.d.value("kind") == "strut"
        at.types("APA-01")
        assert at.d.value("kind") == "apa"

    def test_a_known_one_sets_its_kind_whatever_the_unit_before_was(self):
        """Red before: a dead end after a strut, whatever was pressed."""
        at = Driver(bench("APA-02"), operator="Ann", kind="strut")
        at.enters("APA-02")
        assert begun(at) == [("APA-02", "apa", "Ann")]

    def test_one_whose_kind_follows_from_its_pattern_begins_at_once_unless_it_has_parts(self):
        at = Driver(bench(describes={"apa": "APA", "strut": "ST"}), operator="Ann", kind="strut")
        at.types("APA-01")
        assert at.d.about == "Enter begins APA-01, a new unit of kind apa"
        at.press("enter")
        assert begun(at) == [("APA-01", "apa", "Ann")]
        at = Driver(bench(describes={"apa": "APA", "strut": "ST"}), operator="Ann")
        at.types("ST-01")
        assert at.d.about == "ST-01 is a new unit of kind strut. Enter: what it is made of"
        at.press("enter")
        assert (at.d.cursor, at.bench.begun) == ("apa", [])
        at.press("enter")
        assert begun(at) == [("ST-01", "strut", "Ann")]

    def test_letters_of_a_serial_open_no_other_unit_that_holds_them(self):
        at = Driver(bench("APA-11"), operator="Ann")
        at.types("APA-1")
        assert at.listed == ["APA-11"]
        at.press("enter")
        assert (at.opens, at.d.begins) == ([], True)
        at.press("escape", "down")
        assert (at.d.value("serial"), at.d.about.partition(" · ")[0]) == ("APA-11", "Enter opens APA-11")
        at.press("enter")
        assert at.opens == ["APA-11"]

    def test_one_that_looks_like_a_known_one_is_asked_about_once(self):
        at = Driver(bench(doubts=["APA-O1"]), operator="Ann")
        at.enters("APA-O1")
        at.press("enter")
        (asked,) = at.asked
        assert isinstance(asked, Doubt)
        for answer in (None, "APA-01"):
            at.answer(asked.event, asked.begun, answer)
            assert "APA-O1 was not confirmed" in at.said
        assert not at.bench.begun
        at.answer(asked.event, asked.begun, " APA-O1 ")
        assert [each.confirmed for each in at.bench.begun] == [True]


class TestFields:
    def test_an_empty_operator_is_asked_for(self):
        at = Driver()
        at.press("enter")
        assert (at.d.cursor, at.said) == ("operator", "Enter your name")

    def test_what_is_missing_is_said_and_the_cursor_goes_there(self):
        at = Driver(bench("APA-02"))
        at.stands_at("serial")
        at.enters("APA-02")
        assert (at.said, at.d.cursor) == ("Enter your name", "operator")
        at.enters("Ann")
        assert at.d.cursor == "serial"
        at.press("enter")
        assert begun(at) == [("APA-02", "apa", "Ann")]
        at = Driver(operator="Ann")
        at.press("enter")
        assert (at.said, at.d.cursor) == ("Enter the serial number", "serial")

    @pytest.mark.parametrize("scanned", ["APA-07", "PROTO", "Sx"])
    def test_a_serial_that_is_scanned_where_the_name_is_asked_for_is_nobody_s_name(self, scanned: str):
        """By its digits, as the serial of a unit, or by a spec's own pattern."""
        at = Driver(bench("PROTO", describes={"apa": "S"}))
        at.enters(scanned)
        assert at.values() == {"serial": scanned, "kind": "apa"}
        assert (at.d.cursor, at.role) == ("operator", "bad")
        at.enters("Ann")
        assert (at.d.value("operator"), at.d.value("serial"), at.d.cursor) == ("Ann", scanned, "serial")

    def test_the_operator_is_asked_for_once_and_by_a_key_again(self):
        at = Driver()
        at.enters("", "Ann")
        assert at.d.shown == ["serial"]
        at.press("ctrl+o")
        assert at.d.shown == ["operator", "serial"]
        at.press("escape")
        at.press("ctrl+o")
        at.enters("Bob")
        assert (at.d.value("operator"), at.d.cursor) == ("Bob", "serial")

    def test_kind_and_parts_are_asked_of_a_new_unit_only(self):
        at = Driver(bench("ST-01"), operator="Ann", kind="strut")
        at.types("ST-02")
        assert at.d.shown == ["serial"]
        at.press("enter")
        assert at.d.shown[:3] == ["serial", "kind", "apa"]
        at.press("down", "up", "up")
        assert at.d.cursor == "serial"
        at.types("ST-01")
        assert at.d.shown == ["serial"]

    def test_parts_belong_to_their_kind_and_one_enter_passes_those_that_stay_empty(self):
        at = Driver(operator="Ann", kind="strut")
        at.enters("ST-01", "strut")
        assert at.d.cursor == "apa"
        assert "the parts may stay empty" in at.said
        at.enters("APA-07")
        assert not at.bench.begun
        at.press("enter")
        assert [dict(each.parts) for each in at.bench.begun] == [{"apa": "APA-07"}]

    def test_a_key_without_a_cursor_does_nothing_and_a_letter_goes_to_what_lacks(self):
        at = Driver(operator="Ann")
        at.stands_at(None)
        at.press("enter")
        assert (at.d.cursor, at.bench.begun) == (None, [])
        at.answer(dialogue.stand_at_lacking)
        assert at.d.cursor == "serial"


class TestKeys:
    @pytest.mark.parametrize("name", ["operator", "serial", "apa"])
    def test_a_passphrase_is_taken_away(self, name: str):
        at = Driver(operator="Ann", serial="APA-02", kind="strut")
        if name == "apa":
            at.press("enter")
        at.stands_at(name)
        at.enters(SECRET)
        assert (at.said, at.d.cursor, at.d.texts[name], at.bench.begun) == (NOT_TAKEN, name, "", [])
        assert SECRET not in at.d.about

    def test_a_passphrase_in_any_field_begins_no_unit(self):
        at = Driver(operator=SECRET, serial="APA-02")
        at.press("enter", "enter")
        assert (at.d.cursor, at.bench.begun) == ("operator", [])

    def test_f8_begins_an_attempt_at_a_known_unit_with_a_reason(self):
        at = Driver(bench("APA-02"), operator="Ann", serial="APA-01")
        at.press("f8")
        assert at.said == "F8 needs a known unit"
        at.types("APA-02")
        at.press("f8")
        (asked,) = at.asked
        assert asked.words.startswith("APA-02, attempt 1")
        at.answer(dialogue.reasoned, None)
        assert not at.bench.begun
        at.answer(dialogue.reasoned, "dropped")
        assert [each.reason for each in at.bench.begun] == ["dropped"]

    def test_the_program_is_left_by_escape_twice_and_nothing_between(self):
        """Red before: an Enter between took the words away, and the next Escape ended the program."""
        at = Driver(operator="Ann")
        for between in (lambda: at.press("enter"), lambda: at.types("APA-02"), lambda: at.press("f8")):
            at.press("escape")
            assert "Esc again" in at.said
            between()
        at.press("escape")
        assert Do.LEAVE not in at.asked
        at.press("escape")
        assert at.asked == [Do.LEAVE]

    def test_escape_goes_back_to_the_unit_from_which_a_scan_led_here_before_it_ends_the_program(self):
        at = Driver(bench("APA-02"), operator="Ann", serial="APA-77", left="APA-02")
        assert at.said == "Esc: back to APA-02"
        at.press("escape")
        assert (at.opens, at.d.back) == (["APA-02"], "")
        at = Driver(bench("APA-02"), operator="Ann", left="APA-02")  # left as it was, by the same key
        at.press("escape")
        assert (at.opens, "Esc again" in at.said) == ([], True)

    def test_escape_leaves_what_was_begun_last(self):
        at = Driver(operator="Ann")
        at.enters("APA-01")
        at.press("escape")
        assert (at.d.cursor, at.d.begins) == ("serial", False)
        at.press("escape")
        assert "Esc again" in at.said
