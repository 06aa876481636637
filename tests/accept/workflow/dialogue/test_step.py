"""The dialogue at a step: every entry lands where it was meant and is on the disk before it is called saved; slips are
asked about; the foot names the key that gives what is wanted."""

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from accept.judging.advice import ADVICE
from accept.store.payloads import StepJudged
from accept.tui.screens.step import StepScreen
from accept.workflow.dialogue import step as dialogue
from accept.workflow.dialogue import step_effects as do
from accept.workflow.dialogue.step_effects import Do
from accept.workflow.dialogue.turn import Toast
from accept.workflow.entry.record_folder import PickableFile
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.steps.plan import needs_rig
from accept.workflow.steps.status import Status
from accept.workflow.steps.unit_list import RIG, Queue
from accept.workflow.worker.not_done import STOPPED
from checks.cause import Cause
from hw.errors import NoReply
from tests.accept.workflow.dialogue.step_driver import at_step
from tests.hw.instruments.fake_instrument import Fake, Only
from tests.shared.record_files import write_csv, write_mat

HEIGHTS = "0 -2.5 -3 0 -1.5 1 -2 -4"
CHANNELS = ("Va", "Vs", "de", "da")
AGO_S = 100.0  # the records were written to their ends


def write_record(path: Path, names: tuple[str, ...] = CHANNELS, ago_s: float = AGO_S, gain: float = 1.0) -> None:
    rng = np.random.default_rng(len(path.name))
    columns = {name: np.clip(gain * rng.standard_normal(1000), -10.0, 10.0) for name in names}
    (write_csv if path.suffix == ".csv" else write_mat)(path, columns | {"t": np.arange(1000) * 1e-3})
    os.utime(path, (time.time() - ago_s,) * 2)


def test_a_repair_of_another_step_leads_to_it():
    """Red before: the list stood at the next step that was not done, and nothing named the one with new records."""
    with at_step("stroke") as at:
        assert dialogue.mended(at.d, "capacitance").effects == (do.Leave("capacitance"),)


class TestEntries:
    def test_two_lines_of_a_scanner_land_in_their_two_fields(self):
        with at_step("capacitance") as at:
            at.types("4,93")
            at.types("9940 nF")
            assert at.entries() == [("sensor_uF", None, 4.93), ("actuator_uF", None, 9.94)]
            assert at.d.complete

    def test_the_cursor_goes_on_before_the_entry_is_on_the_disk_and_nothing_is_called_saved_before(self):
        with at_step("flatness", holds=True) as at:
            for height in HEIGHTS.split():
                at.types(height)
            assert not at.values()
            assert "Saved" not in at.told.title
            assert at.d.cursor is None  # every line has its entry under way
            at.arrives()
            assert [(index, value) for _, index, value in at.entries()] == list(enumerate(map(float, HEIGHTS.split())))

    def test_what_is_refused_keeps_its_line_and_the_next_entry_has_its_own(self):
        with at_step("capacitance") as at:
            at.types("4.99 V")
            assert at.d.lines[0].text == "4.99 V"
            at.types("9.85")
            assert at.d.cursor == 0  # the only one that is still to be given
            at.comes_back()
            at.types("4.99")
            assert at.d.complete
            assert at.entries() == [("actuator_uF", None, 9.85), ("sensor_uF", None, 4.99)]

    def test_what_is_refused_in_the_only_line_is_replaced_by_what_is_typed_next(self):
        with at_step("stroke") as at:
            at.types("abc")
            assert "is not a number" in at.d.reason(0)[0]
            assert at.said == "stroke of the three stacks: not saved. Type it again"  # why is said once, below the line
            at.types("365")
            assert at.values() == [365]

    def test_enter_tries_a_refused_entry_again_and_does_not_go_on_without_it(self):
        with at_step("capacitance") as at:
            at.types("4.99 V")
            at.types("9.85")
            at.d = replace(at.d, cursor=None)
            at.press("enter")
            assert at.said.startswith("sensor stack: not saved")
            assert "V" in at.d.reason(0)[0]
            assert not at.asked

    def test_a_slip_of_the_point_is_asked_about_and_kept_only_when_confirmed(self):
        with at_step("capacitance") as at:
            at.types("49.9")
            assert "4.99 uF would be usual" in at.said
            at.comes_back()
            at.press("enter")  # a scanner sends it: it does not confirm
            assert not at.values()
            at.press("f9")
            assert at.values() == [49.9]

    def test_one_more_reading_that_was_asked_about_is_one_more_reading(self):
        """Red before: kept by F9 it replaced the reading that was there."""
        with at_step("capacitance") as at:
            at.types("4.99")
            at.stands_at("sensor_uF")
            at.edits("49.9")
            at.press("f4", "f9")
            assert [each.value for each in at.d.facts.state.readings("sensor_uF", None)] == [4.99, 49.9]

    def test_a_question_at_the_foot_goes_with_the_value_that_it_is_about(self):
        """Red before: it stayed, with a key that did nothing any more."""
        with at_step("capacitance") as at:
            at.types("49.9")
            at.comes_back()
            at.edits("4")
            assert "F9: keep it" in at.said  # it may be typed back
            at.edits("")
            assert at.said == at.d.what_now

    def test_what_is_typed_after_a_question_corrects_the_value_in_question(self):
        with at_step("capacitance") as at:
            for wrong, right in (("49.3", "4.93"), ("98.6", "9.86")):
                at.types(wrong)
                at.comes_back()
                at.types(right)
            assert at.entries() == [("sensor_uF", None, 4.93), ("actuator_uF", None, 9.86)]

    def test_f9_keeps_the_value_that_the_foot_asks_about_and_no_other(self):
        with at_step("capacitance") as at:
            at.types("49.9")
            at.comes_back()
            at.press("down")
            at.types("98.5")
            at.stands_at("sensor_uF")
            assert "98.5 uF" in at.said
            at.press("f9")
            assert not at.values()
            assert at.d.lines[0].place.name in at.said
            at.press("f9")
            assert at.values() == [49.9]
            at.press("f9", "f9")
            assert at.values() == [49.9, 98.5]

    def test_a_value_in_question_that_was_typed_over_is_not_kept(self):
        with at_step("capacitance") as at:
            at.types("49.9")
            at.comes_back()
            at.edits("4.98")
            at.press("f9")
            assert "The entry was changed" in at.said
            assert not at.values()

    def test_an_emptied_line_is_not_in_question(self):
        with at_step("capacitance") as at:
            at.types("49.9")
            at.comes_back()
            assert at.d.reason(0)[1] == "doubted"
            at.edits("")
            assert at.d.reason(0) == ("", "")

    def test_all_heights_at_once_are_asked_about_together(self):
        with at_step("flatness") as at:
            at.types("0 1 2 3 99999 1 2 3")
            assert "99999 um is unusual" in at.said
            assert not at.values()
            at.comes_back()
            at.press("f9")
            assert at.values() == [0, 1, 2, 3, 99999, 1, 2, 3]

    def test_some_of_the_heights_in_one_line_are_distinguished_from_a_slip_of_one(self):
        with at_step("flatness") as at:
            for value in ("0", "-2.5 um"):  # a value with its unit is one
                at.types(value)
            at.types("28 43 40 25")
            assert "4 values; enter all 8" in at.d.reason(2)[0]
            assert at.values() == [0.0, -2.5]

    def test_pasted_lines_in_a_line_of_one_value_are_refused(self):
        with at_step("capacitance") as at:
            at.types("4.99 9.85")
            assert "is not a number" in at.d.reason(0)[0]
            assert not at.values()

    def test_enter_stays_at_a_required_value_and_the_next_value_is_its_own(self):
        with at_step("capacitance") as at:
            at.press("enter")
            assert "is required" in at.said
            at.types("4.99")
            at.press("down", "enter")
            assert at.entries() == [("sensor_uF", None, 4.99)]

    def test_a_passphrase_is_taken_away_and_stands_nowhere(self):
        secret = "correct-horse"
        with at_step("capacitance", secrets=(secret,)) as at:
            at.edits(secret)
            assert secret not in repr(at.d)
            at.press("enter")
            assert (at.said, at.role) == (NOT_TAKEN, "bad")
            assert not any(line.text for line in at.d.lines)
            assert not at.values()
            assert secret not in repr(do.Recognize(("sensor_uF", None), secret, False, True))

    def test_a_serial_that_is_scanned_into_a_line_goes_to_its_unit(self):
        with at_step("capacitance", serial="APA-02") as at:
            at.types("APA-02")
            (goes,) = at.asked
            assert (goes.serial, goes.queue.name) == ("APA-02", "capacitance")
            assert not at.d.lines[0].text

    def test_a_serial_of_no_unit_in_a_line_says_where_it_is_scanned(self):
        with at_step("capacitance", serial="APA-02") as at:
            at.types("APA-077")
            assert at.said.endswith("A new unit? Esc, then scan it")
            at.types("4.99 V")
            assert "new unit" not in at.said

    def test_a_value_that_is_typed_over_a_complete_step_is_not_saved(self):
        with at_step("stroke") as at:
            at.types("365")
            at.answer(dialogue.take_value, "366")
            assert "366 was not saved: this step is complete" in at.said
            assert at.values() == [365]

    def test_undo_takes_nothing_of_another_step_and_says_what_it_took(self):
        with at_step("flatness") as at:
            for height in ("0", "4.95"):
                at.types(height)
            at.press("ctrl+z")
            assert "height 2 4.95 um" in at.told.text
            assert at.d.cursor == 1
            at.press("ctrl+z", "ctrl+z")
            assert at.role == "bad"
            assert not at.session.state("flatness").entries

    def test_measuring_again_needs_an_entry(self):
        with at_step("stroke") as at:
            at.press("f8")
            assert "Nothing to repeat" in at.said
            at.types("365")
            at.press("f8")
            assert at.asked == [Do.ASK_REASON]


class TestWords:
    def test_a_failed_step_says_at_its_foot_what_to_do(self):
        with at_step("capacitance") as at:
            at.types("3.9")
            at.types("9.8")
            assert at.said.startswith("Fail: do what → says, then F8: measure again. ")  # the result has the advice
            assert "Step complete" not in at.said

    def test_a_complete_step_names_the_summary_and_f9_goes_there(self):
        with at_step("capacitance") as at:
            at.types("4.99")
            at.press("f9")
            assert at.asked.pop() == do.Leave(None)  # from a step that is not complete too
            at.types("9.85")
            assert "Enter: next step" in at.said
            assert "F9: summary" in at.said
            at.press("up")
            at.edits("4.98")
            at.press("f9")
            assert "is saved, what was typed over it is not" in at.said  # red before: that it is not saved
            at.press("enter", "f9")
            assert at.asked == [do.Leave(None)]

    def test_enter_at_a_complete_step_goes_on(self):
        with at_step("capacitance") as at:
            at.types("4.99")
            at.types("9.85")
            at.press("enter")
            assert at.asked == [do.Leave(True)]

    def test_no_key_leaves_a_step_while_it_is_measured(self):
        """Red before: Enter did, and the hits of some minutes were lost."""
        with at_step("capacitance") as at:
            at.types("4.99")
            at.types("9.85")
            at.d = replace(at.d, measures=True)
            for key in ("enter", "f2", "f3", "f4", "f8", "f9", "f10", "ctrl+z", "ctrl+r"):
                at.press(key)
                assert "Measuring. Esc stops it" in at.said
                assert not at.asked
            assert (at.d.main_key, at.d.called["escape"]) == ("escape", "Stop")

    def test_the_main_key_at_what_is_optional_goes_on_without_it(self):
        """Red before: it opened the list of files, of which none fits."""
        with at_step("frf", "strut", serial="ST-01") as at:
            assert at.d.main_key == "f2"
            at.stands_at("first")
            assert "Enter: go on without it" in at.said
            assert at.d.main_key == "enter"

    def test_what_a_capture_says_stays_beside_the_judgement_that_follows(self):
        """Red before: it stood at the foot, where the judgement took its place at once."""
        with at_step("capacitance") as at:
            at.types("1.72")  # outside its limits
            at.types("9.85")
            at.d = replace(at.d, measures=True)
            at.answer(dialogue.measured, ["x-bending: 8 of 9 hits good", "closed: 99 readings"])
            told = "x-bending: 8 of 9 hits good\nclosed: 99 readings\n^Z takes back the last entry"
            assert at.told == Toast("Saved", told)
            assert (at.said, at.role) == (at.d.what_now, "bad")

    def test_f4_without_a_cursor_says_how_to_read_once_more(self):
        with at_step("stroke") as at:
            at.types("365")
            at.press("f4")
            assert "F4" in at.said
            assert at.values() == [365]

    def test_a_key_without_a_use_says_so_and_stays_out_of_the_row_of_keys(self, tmp_path: Path):
        with at_step("frf", "strut", tmp_path, serial="ST-01") as at:
            for key, said in (
                ("ctrl+k", "No value is asked about"),
                ("f3", "No instrument for this field; F2: choose the file"),  # red before: type the value
                ("f8", "Nothing to repeat"),
            ):
                at.press(key)
                assert said in at.said
            shown = {b.key for b in StepScreen.BINDINGS if b.show and at.d.means(b.key)} - at.d.idle_keys
            assert shown - {"f7"} == {"enter", "f2", "f5", "f9", "escape"}  # F7 needs a picture

    def test_in_the_queue_of_the_rig_the_unit_stays_mounted_until_its_last_step_there(self):
        with at_step("stroke") as at:
            at.queue = Queue(RIG, "", "For the rig", ())
            first, second = (step for step in at.session.steps if needs_rig(step))
            at.types("365")
            assert f"Leave APA-02 mounted. Enter: its next step, {second.short}" in at.said
            at.press("enter")
            assert at.asked == [do.Leave(True)]
            assert first.name == "stroke"

    def test_at_the_end_of_a_queue_enter_goes_to_the_next_unit_and_the_queue_ends_with_it(self):
        with at_step("stroke") as at:
            at.queue = Queue("stroke", "apa", "Stroke", ())
            at.types("365")
            assert "Enter: next unit" in at.said
            at.press("enter")
            (asked,) = at.asked
            assert (asked.queue, asked.ends) == (at.queue, True)
            assert asked.words.startswith("APA-02: ✓ pass")
            at.answer(dialogue.no_next_unit, asked, "No other unit waits")
            assert at.asked[-1] is Do.END_QUEUE
            assert at.said == "No other unit waits. Enter: next step of this unit"
            assert at.d.enter_label == "Next step"  # the foot had still `Next unit`

    def test_f10_opens_the_same_step_of_the_next_unit_and_the_queue_of_the_rig_goes_on(self):
        with at_step("stroke") as at:
            at.queue = Queue(RIG, "", "For the rig", ())
            at.press("f10")
            (asked,) = at.asked
            assert (asked.queue.name, asked.goes_on, asked.ends) == ("stroke", at.queue, False)


class TestInstruments:
    def test_f3_takes_a_reading_and_says_so_before(self):
        with at_step("capacitance", instruments=Only("capacitance", Fake([4.99e-6]))) as at:
            assert "F3: take the reading" in at.said
            at.press("f3")
            assert at.values() == pytest.approx([4.99])

    def test_a_saved_value_is_read_again_only_when_asked_twice(self):
        with at_step("capacitance", instruments=Only("capacitance", Fake([4.99e-6]))) as at:
            at.press("f3", "f3")
            assert len(at.values()) == 2
            at.press("f3")
            assert "Step complete" in at.said
            at.press("up", "f3")
            assert "F3 again: replace it" in at.said
            at.press("down", "up", "f3")  # moving on forgets the first F3
            assert len(at.values()) == 2
            at.press("f3")
            assert [name for name, *_ in at.entries()] == ["sensor_uF", "actuator_uF", "actuator_uF"]
            at.stands_at("actuator_uF")
            at.press("f3")
            at.types("9.85")  # an entry forgets it too
            at.stands_at("actuator_uF")
            at.press("f3")
            assert "F3 again: replace it" in at.said
            assert len(at.values()) == 4

    def test_f3_during_a_reading_is_too_early_and_reads_nothing(self):
        with at_step("capacitance", instruments=Only("capacitance", Fake([4.99e-6])), holds=True) as at:
            at.press("f3", "f3", "f4")
            assert "Wait: a reading is under way" in at.said
            at.arrives()
            assert "The second F3 came too early" in at.said
            assert len(at.values()) == 1
            at.press("f3")
            assert len(at.values()) == 2

    def test_an_entry_that_is_stored_meanwhile_ends_no_reading(self):
        with at_step("capacitance", instruments=Only("capacitance", Fake([4.99e-6])), holds=True) as at:
            at.types("4.99")
            at.press("f3")
            at.execute(at.waits.popleft())
            at.press("f3")
            assert "Wait: a reading is under way" in at.said
            assert at.values() == [4.99]

    def test_a_fault_of_the_instrument_is_said_and_the_cursor_comes_back(self):
        fake = Fake([NoReply("meter: nothing came in time")])
        with at_step("capacitance", instruments=Only("capacitance", fake)) as at:
            at.press("f3")
            assert "no whole answer in time. On? Cable in? F3: again" in at.reason("sensor_uF")
            assert at.said == "Not read, nothing is saved. F3: again, or type the value"  # the fault is said once
            at.comes_back()
            assert at.d.cursor == 0
            fake.mend(4.99e-6)
            at.press("f3")
            assert at.told.title.startswith("Saved ")
            assert not at.reason("sensor_uF")

    def test_f4_takes_one_more_reading_of_the_same_value(self):
        with at_step("capacitance", instruments=Only("capacitance", Fake([4.99e-6]))) as at:
            at.press("f3", "up", "f4")
            assert len(at.session.state("capacitance").readings("sensor_uF")) == 2


class TestRecords:
    def test_a_wrong_file_leaves_the_proposals_as_they_were(self, tmp_path: Path):
        write_record(tmp_path / "frf_noise.csv")
        write_record(tmp_path / "frf_noise_hf.csv")
        write_record(tmp_path / "loops.csv", ("Va", "de"))
        with at_step("frf", "strut", tmp_path, serial="ST-01") as at:
            at.types("loops.csv")  # lacks channels: refused
            assert "loops.csv" in at.reason("low")
            assert "Enter: take" not in at.reason("low")  # the cursor is in the next field: there it would be taken
            at.comes_back()
            assert "→ Enter: take frf_noise.csv" in at.reason("low")
            at.press("enter")
            assert at.links() == {"low": "frf_noise.csv"}
            at.stands_at("low")
            at.types("frf_noise_hf.csv")  # in the wrong place
            at.stands_at("low")
            at.types("frf_noise.csv")  # put right
            at.press("enter")
            assert at.links() == {"low": "frf_noise.csv", "high": "frf_noise_hf.csv"}

    def test_a_record_that_is_cut_says_so_at_once_with_what_to_do(self, tmp_path: Path):
        write_record(tmp_path / "frf_noise.mat")
        write_record(tmp_path / "frf_noise_hf.mat")
        cut = (tmp_path / "frf_noise_hf.mat").read_bytes()
        (tmp_path / "frf_noise_hf.mat").write_bytes(cut[: len(cut) * 2 // 3])
        os.utime(tmp_path / "frf_noise_hf.mat", (time.time() - AGO_S,) * 2)
        with at_step("frf", "strut", tmp_path, serial="ST-01") as at:
            assert "→ copy the file again, or record again" in at.reason("high")
            at.press("enter", "enter")  # the low one, then none for the high one
            assert "Copy the file again" in at.said
            (tmp_path / "frf_noise_hf.mat").write_bytes(cut)
            os.utime(tmp_path / "frf_noise_hf.mat", (time.time() - AGO_S + 1.0,) * 2)
            at.looks()
            assert "Enter: take" in at.said
            assert at.proposed("high") == "frf_noise_hf.mat"

    def test_a_record_that_is_refused_says_what_to_do_and_is_not_proposed_again(self, tmp_path: Path):
        write_record(tmp_path / "frf_noise.mat", gain=6.0)  # the converter ends at 10 V
        with at_step("frf", "strut", tmp_path, serial="ST-01") as at:
            at.press("enter")
            assert "clipped" in at.reason("low")
            assert "→ set the range of" in at.reason("low")
            assert at.proposed("low") is None
            assert at.d.facts.status is Status.REFUSED

    def test_a_damaged_record_that_is_given_by_enter_is_called_refused(self, tmp_path: Path):
        (tmp_path / "frf_noise.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
        os.utime(tmp_path / "frf_noise.mat", (time.time() - AGO_S,) * 2)
        with at_step("frf", "strut", tmp_path, serial="ST-01") as at:
            assert at.d.reason(0)[1] == "refused"
            at.press("enter")
            assert "Copy the file again" in at.said
            (refused,) = at.session.state("frf").refused.values()
            assert (refused.file, refused.action) == ("frf_noise.mat", ADVICE[Cause.FILE_DAMAGED])

    def test_a_step_turns_to_the_input_whose_record_arrives_unless_something_was_typed(self, tmp_path: Path):
        with at_step("stroke", "apa", tmp_path) as at:
            assert at.d.form.name == "values"
            at.edits("3")
            write_record(tmp_path / "stroke_one_stack.csv", ("V", "d"))
            at.looks()
            assert at.d.form.name == "values"
            at.edits("")
            at.looks()
            assert "stroke_one_stack.csv" in at.said
            assert at.d.form.name == "records"

    def test_records_that_were_found_while_something_was_typed_change_no_form(self, tmp_path: Path):
        with at_step("stroke", "apa", tmp_path) as at:
            (look,) = dialogue.looks(at.d)
            write_record(tmp_path / "stroke_one_stack.csv", ("V", "d"))
            at.edits("3")
            at.execute(look)
            assert (at.d.form.name, at.d.lines[0].text) == ("values", "3")

    def test_a_form_that_was_chosen_stays(self, tmp_path: Path):
        with at_step("stroke", "apa", tmp_path) as at:
            at.press("ctrl+f", "ctrl+f")
            assert at.d.form.name == "values"
            write_record(tmp_path / "stroke_one_stack.csv", ("V", "d"))
            at.looks()
            assert at.d.form.name == "values"

    def test_the_answer_to_an_earlier_form_changes_nothing(self):
        with at_step("stroke") as at:
            at.types("3.65")  # a hundredth of what is usual
            assert at.d.reason(0)[1] == "doubted"
            at.press("ctrl+f")
            before = at.d
            at.comes_back()
            assert at.d == before

    def test_the_foot_names_the_record_that_enter_takes_also_when_more_arrive_and_the_cursor_moves(
        self, tmp_path: Path
    ):
        with at_step("spurious_modes", "apa", tmp_path) as at:
            names = [line.place.key[0] for line in at.d.lines]
            arrived = {name: PickableFile(f"{name}.mat", time.time() - AGO_S, 1) for name in names}
            at.answer(dialogue.looked, do.LookForRecords((at.d.form,), "again"), [(at.d.form, arrived)], time.time())
            for _ in names:
                assert at.d.proposed(at.d.cursor).name in at.said
                at.press("down")

    def test_an_open_optional_record_is_called_optional(self, tmp_path: Path):
        for name in ("frf_noise.csv", "frf_noise_hf.csv"):
            write_record(tmp_path / name)
        with at_step("frf", "strut", tmp_path, serial="ST-01") as at:
            at.press("enter", "enter")
            at.d = replace(at.d, facts=replace(at.d.facts, status=Status.PASS))  # else it asks to be put right
            assert "Optional: " in at.d.what_now
            assert "Enter: keep 350 Hz" in at.d.what_now

    def test_after_no_result_the_foot_says_first_what_to_put_right(self, tmp_path: Path):
        for name in ("frf_noise.csv", "frf_noise_hf.csv"):
            write_record(tmp_path / name)
        with at_step("frf", "strut", tmp_path, serial="ST-01") as at:
            at.press("enter", "enter")
            assert at.d.facts.status is Status.NO_RESULT
            assert at.said.startswith("No result: do what → says, then ")
            assert "Optional" not in at.said  # the crossover puts nothing right
            assert "F8: measure again. Enter: next step" in at.said
            at.press("enter")
            assert at.asked == [do.Leave(True)]

    def test_a_record_given_wrongly_is_not_proposed_for_another_line(self, tmp_path: Path):
        t = np.arange(0.0, 10.0, 1e-2)
        volts = 65.0 + 85.0 * np.sin(0.2 * np.pi * t)
        for name in ("stroke_one_stack.mat", "stroke_two_stacks.mat"):
            write_mat(tmp_path / name, {"t": t, "V": volts, "d": 1e-6 * volts})
            os.utime(tmp_path / name, (time.time() - AGO_S,) * 2)
        with at_step("stroke", "apa", tmp_path) as at:
            assert at.proposed("one_stack") == "stroke_one_stack.mat"
            at.types("stroke_two_stacks.mat")
            assert at.links() == {"one_stack": "stroke_two_stacks.mat"}
            assert at.proposed("two_stacks") is None

    def test_f2_at_the_only_record_offers_files_in_its_place(self, tmp_path: Path):
        write_record(tmp_path / "hysteresis.mat")
        with at_step("hysteresis", "apa", tmp_path) as at:
            at.press("enter")
            assert at.links() == {"record": "hysteresis.mat"}
            at.press("f2")
            (pick,) = at.asked
            assert pick.place == ("record", None)

    def test_f2_has_the_proposal_on_top(self, tmp_path: Path):
        write_record(tmp_path / "hysteresis.mat")
        with at_step("hysteresis", "apa", tmp_path) as at:
            at.press("f2")
            assert at.asked[0].first == "hysteresis.mat"


class TestDerived:
    def test_a_derived_step_without_its_records_says_which_it_needs(self):
        with at_step("misalignment", "strut", serial="ST-01") as at:
            assert at.role == "bad"
            assert at.said == at.d.lacking != ""
            at.press("f3")
            assert at.said == at.d.lacking

    def test_a_comparison_that_runs_is_stopped_before_the_screen_is_left(self):
        with at_step("misalignment", "strut", serial="ST-01") as at:
            d = replace(at.d, judges=True)
            assert dialogue.press(d, "enter").words.text == "Running. Esc: stop"
            assert dialogue.press(d, "f3").words.text == "Running. Esc: stop"
            stopped = dialogue.not_judged(d, STOPPED)
            assert stopped.words.text == "Stopped. F3: compare again"

    def test_a_comparison_that_is_repeated_and_stopped_leaves_the_earlier_one(self, tmp_path: Path):
        """Red before: "Not compared" stood in its place."""
        rng = np.random.default_rng(3)
        columns = {name: rng.standard_normal(1000) * 1e-6 for name in ("Va", "Vs", "de", "da")}
        write_csv(tmp_path / "frf.csv", {"t": np.arange(1000) * 1e-3, **columns})
        with at_step("misalignment", "strut", serial="ST-01") as at:
            for name in ("low", "high"):
                at.session.records.link("frf", at.session.step("frf").check.inputs[name], tmp_path / "frf.csv")
            stopped = dialogue.not_judged(at.present(), STOPPED).state
            assert "Not compared" in stopped.judging_words
            at.session.append(StepJudged("misalignment", at.session.state("misalignment").upto, (), (), ()))
            assert not replace(stopped, facts=at.present().facts).judging_words
