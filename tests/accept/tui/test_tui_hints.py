"""What a step says and proposes: the record that fits, why one cannot be taken and what to do, the key that gives what
the present field wants; typing ahead loses nothing and goes nowhere else."""

import os
import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.text import Text
from textual.events import Key
from textual.widgets import DataTable, Input, Static

from accept.base.home import home
from accept.judging import load_spec
from accept.pictures.labels import label_of
from accept.store import open_store
from accept.store.payloads import NotedFile, StepNoted, without_hashes
from accept.tui.screens import steps as steps_screen
from accept.tui.screens.ask import Question, QuestionLine
from accept.tui.screens.start import Given
from accept.tui.widgets.bench import units_table
from accept.tui.widgets.fields import Field
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.step_list import StepList
from accept.units import unit_folder
from accept.workflow.dialogue.begin import Begun
from accept.workflow.entry.record_folder import PickableFile
from accept.workflow.session.open_session import open_session
from accept.workflow.steps.status import Status
from accept.workflow.steps.unit_list import KnownUnit, known_units
from accept.workflow.training import open_training
from accept.workflow.worker.judging import judge_here, judge_step
from checks.declare import Measured, Series
from checks.errors import RecordError
from checks.rounding import rounded
from checks.verdict import UnitVerdict, Verdict
from specs.strict import toml_of
from tests.accept.tui.tui_help import (
    HEIGHTS,
    NARROW,
    begin,
    fill_values,
    loader,
    press,
    running,
    settled,
    told,
    type_line,
    words,
)
from tests.shared.record_files import write_csv, write_mat

WHY = "the rest is measured tomorrow"
AGO_S = 100.0  # the records were written to their ends
CHANNELS = ("Va", "Vs", "de", "da")


def aged(path: Path, ago_s: float = AGO_S) -> None:
    os.utime(path, (time.time() - ago_s,) * 2)


def write_record(path: Path, names: tuple[str, ...] = CHANNELS, ago_s: float = AGO_S, gain: float = 1.0) -> None:
    rng = np.random.default_rng(len(path.name))
    columns = {name: np.clip(gain * rng.standard_normal(1000), -10.0, 10.0) for name in names} | {
        "t": np.arange(1000) * 1e-3
    }
    (write_csv if path.suffix == ".csv" else write_mat)(path, columns)
    aged(path, ago_s)


@pytest.fixture
def records(tmp_path: Path) -> Path:
    folder = tmp_path / "records"
    folder.mkdir()
    return folder


async def open_step(pilot, step: str, serial: str = "ST-01") -> None:
    if type(pilot.app.screen).__name__ == "StartScreen":
        await type_line(pilot, serial)
        while type(pilot.app.screen).__name__ == "StartScreen":
            await press(pilot, "enter")
    pilot.app.screen.query_one(StepList).stand_at(step)
    await press(pilot, "enter")


def post(pilot, *keys: str) -> None:
    """Keys as a terminal sends them, without waiting for an answer."""
    for key in keys:
        pilot.app.post_message(Key(key, key if len(key) == 1 else None))


def field(pilot, name: str) -> Field:
    return next(f for f in pilot.app.screen.query(Field) if f.place.declared.name == name)


async def stand_at(pilot, name: str) -> None:
    pilot.app.screen.set_focus(field(pilot, name).input)
    await settled(pilot)


def proposed(pilot, name: str) -> PickableFile | None:
    d = pilot.app.screen.dialogue
    return d.proposed(d.at((name, None)))


def reason(pilot, name: str) -> str:
    return str(field(pilot, name).query_one(".reason", Static).render())


def links(serial: str = "ST-01") -> dict[str, str]:
    with open_store() as store:
        return {e.data["input"]: e.data["file"] for e in store.events(serial, "record_linked")}


async def test_letters_behind_f2_reach_the_filter_before_enter_takes_the_file_on_top(records: Path):
    for n, name in enumerate(("frf_noise.csv", "frf_noise_hf.csv", "old_loops.csv", "hysteresis.csv")):
        write_record(records / name, ago_s=AGO_S + n)
    async with running(loader("strut", records)) as pilot:
        await open_step(pilot, "hysteresis")
        post(pilot, "f2", *"old", "enter")
        await settled(pilot)
        assert links() == {"record": "old_loops.csv"}


@pytest.mark.slow
async def test_training_says_what_the_label_holds_and_its_keys_fit_into_80_columns():
    bench = open_training("apa", 31)
    async with running(lambda: bench, NARROW) as pilot:
        await open_step(pilot, "stiffness")
        for _ in range(2):
            await press(pilot, "enter")
        assert "F3: take 6.4 kg from the label" in words(pilot, "#status")
        await press(pilot, "f3")
        await stand_at(pilot, "mass_kg")
        row = pilot.app.screen.query_one(KeyRow)
        assert {"ctrl+r", "f3", "f7"} <= {key.key for key in row.keys}
        assert max(key.end for key in row.placed) <= 80
    bench.close()


async def test_no_record_of_another_step_is_proposed_and_f2_has_the_proposal_on_top(records: Path):
    """The responses were recorded again an hour after the other records."""
    for name in ("hysteresis.mat", "sweep_lf_with_R.mat", "sweep_lf.mat"):
        write_record(records / name, ago_s=4000.0)
    for name in ("frf_sweep.mat", "frf_noise_hf.mat"):
        write_record(records / name)
    async with running(loader("apa", records)) as pilot:
        for step, wanted, expected in (
            ("hysteresis", "record", "hysteresis.mat"),
            ("sensor_highpass", "with_resistor", "sweep_lf_with_R.mat"),
        ):
            await open_step(pilot, step, "APA-01")
            assert proposed(pilot, wanted).name == expected
            assert expected in words(pilot, "#status")
            await press(pilot, "f2")
            assert str(pilot.app.screen.query_one("#files", DataTable).get_row_at(0)[0]) == expected
            await press(pilot, "escape", "enter")
            assert links("APA-01")[wanted] == expected
            await press(pilot, "escape")


def test_the_records_of_a_training_are_proposed_as_soon_as_its_unit_is_open():
    """Opened from a tray, a step asked for values: its records were written in that moment."""
    bench, begun = open_training("apa", 31), Begun("TRAIN-000031", "apa", "Ann")
    bench.add(begun)
    at_unit = bench.at_unit(begun)
    session, _ = at_unit.open_unit(begun)
    step = session.step("stroke")
    assert session.records.proposals(step, step.check.forms[1], at_unit.records)
    session.close()
    bench.close()


async def test_a_unit_that_is_held_is_called_so_wherever_it_is_named():
    async with running() as pilot:
        await begin(pilot)
        await fill_values(pilot)
        pilot.app.session.entries.note("stiffness", "flexure cracked", nonconformance=True)
        await press(pilot, "f9")
        table = pilot.app.screen.query_one("#findings", DataTable)
        rows = [table.get_row_at(n) for n in range(table.row_count)]
        assert {(str(row[0]).strip(), str(row[4])) for row in rows} == {("!", "pass, held")}
        assert "conditional" not in words(pilot, "#verdict").lower()
        await press(pilot, "f2")
        assert "HELD" in words(pilot, ".words")
        assert "conditional" not in words(pilot, ".words").lower()
        await press(pilot, "escape", "escape")
        rail = pilot.app.screen.query_one(StepList)
        assert {str(rail.get_cell(key, "mark")).strip() for key in rail.rows} == {"!"}
        await press(pilot, "escape")
        assert pilot.app.done.words == {"APA-02": "held"}
        assert pilot.app.done.verdicts == {"APA-02": "conditional"}  # for the exit code
    with open_store() as store:
        (unit,) = known_units(store, {"apa": load_spec("apa-basic")})
    assert "held" in unit.words
    assert "conditional" not in unit.words
    assert unit.state == "held, to sign"


def test_every_state_of_a_unit_fits_into_its_column():
    width = units_table._STATE - 1  # on the smallest terminal, beside a serial of 24 letters
    for verdict in (None, *map(str, UnitVerdict)):
        for held in (False, True):
            for steps, waiting, signed in ((8, ("a",), 0), (8, (), 0), (8, (), 1), (8, (), 2)):
                unit = KnownUnit("A", "apa", 1, verdict, signed, 0, held=held, steps=steps, waiting=waiting)
                assert len(unit.state) <= width, unit.state


def test_a_note_is_shown_with_the_names_of_its_files_and_printed_with_their_hashes():
    line = StepNoted(
        "frf", "cracked", True, (NotedFile("a b.jpg", "0f" * 32, "/x"), NotedFile("c.png", "1e" * 32, "/"))
    ).line("Ann")
    assert "0f" * 32 in line
    assert without_hashes(line) == "cracked [a b.jpg] [c.png] (Ann)"


async def test_keys_behind_the_last_enter_wait_for_the_unit_and_change_no_field():
    async with running() as pilot:
        post(pilot, *"APA-07", "enter", "enter", "end", "up", "enter")
        await settled(pilot)
        assert type(pilot.app.screen).__name__ == "StepScreen"
        assert (pilot.app.session.serial, pilot.app.screen.step.name) == ("APA-07", "stroke")


async def test_a_contradiction_of_the_whole_unit_is_marked_after_a_restart_too():
    async with running() as pilot:
        await begin(pilot)
        await fill_values(pilot)
        await press(pilot, "f9")
        session = pilot.app.session
        judged = session.attempt.judged
        findings = [
            replace(f, verdict=Verdict.NO_RESULT, value=None, reason="contradicts the responses")
            if f.check == "stiffness"
            else f
            for f in judged.result.findings
        ]
        session.append(replace(judged, result=replace(judged.result, findings=tuple(findings))))
        await press(pilot, "escape", "escape")
        await begin(pilot)
        again = pilot.app.session
        assert again.judgements.status(again.step("stiffness")) is Status.NO_RESULT
        assert again.judgements.status(again.step("capacitance")) is Status.PASS


async def test_long_lines_beside_the_list_of_steps_go_on_below_their_first_letter(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(steps_screen, "card", lambda *_: Text("    " + "reason " * 20))
    async with running() as pilot:
        await begin(pilot)
        card = pilot.app.screen.query_one("#card")
        lines = [card.render_line(y).text for y in range(card.size.height)]
    assert len(lines) > 1
    assert all(re.match(" {4}[a-z]", line) for line in lines), lines


async def test_one_value_stands_with_one_U_beside_its_finding():
    async with running() as pilot:
        await begin(pilot)
        await open_step(pilot, "capacitance")
        await type_line(pilot, "4.99123 ± 0.0099")
        await type_line(pilot, "9.85")
        shown_value = str(field(pilot, "sensor_uF").query_one(".stored", Static).render())
        assert "±" not in shown_value
        found = pilot.app.session.judgements.of_step("capacitance").findings[0]
        assert shown_value == f"▪ {rounded(found.value, found.U)} µF"


async def test_a_refused_record_is_called_refused_in_list_and_summary_after_a_restart_too(records: Path):
    write_record(records / "frf_noise.mat", gain=6.0)  # the converter ends at 10 V
    async with running(loader("strut", records)) as pilot:
        await open_step(pilot, "frf")
        await press(pilot, "enter")
        assert "clipped" in reason(pilot, "low")
    with open_store() as store:
        (refused,) = (event.data for event in store.events("ST-01", "record_refused"))
    assert (refused["step"], refused["input"], refused["file"]) == ("frf", "low", "frf_noise.mat")
    assert refused["cause"]["code"] == "channel_clipped"
    async with running(loader("strut", records)) as pilot:
        await open_step(pilot, "frf")
        assert "clipped" in reason(pilot, "low")
        assert proposed(pilot, "low") is None
        await press(pilot, "escape")
        session = pilot.app.session
        assert session.judgements.status(session.step("frf")) is Status.REFUSED
        pilot.app.screen.query_one(StepList).stand_at("frf")
        await settled(pilot)
        assert "clipped" in words(pilot, "#card")
        assert "→ set the range of" in words(pilot, "#card")
        await press(pilot, "f9")
        responses = [f for f in session.judgements.result.findings if f.check == "frf"]
        assert responses
        assert all(session.records.refusal(f).file == "frf_noise.mat" for f in responses)
        assert all(
            session.records.refusal(f) is None for f in session.judgements.result.findings if f.check == "capacitance"
        )
        assert "→ frf_noise.mat: set the range of" in words(pilot, "#verdict")
        assert "refused: " in words(pilot, "#verdict")
        assert label_of(responses[0].quantity) not in words(pilot, "#verdict").partition("not measured:")[2]
        await press(pilot, "escape")
        write_record(records / "frf_noise.mat", ago_s=AGO_S - 1.0)
        await open_step(pilot, "frf")
        await press(pilot, "enter")
        assert links()["low"] == "frf_noise.mat"
        assert not session.state("frf").refused


def test_a_refusal_is_over_when_the_step_is_given_otherwise_or_anew(tmp_path: Path):
    bad, good = tmp_path / "bad.mat", tmp_path / "good.mat"
    write_record(bad, gain=20.0)
    write_record(good)
    with open_store() as store:
        session = open_session(store, home(), load_spec("strut"), "Ann", "ST-01")
        session.begin({})
        low, high = (session.step("frf").check.inputs[name] for name in ("low", "high"))

        def refused() -> set[str]:
            for declared in (low, high):
                with pytest.raises(RecordError):
                    session.records.link("frf", declared, bad)
            return set(session.state("frf").refused)

        assert refused() == {"low", "high"}
        session.records.link("frf", low, good)
        assert set(session.state("frf").refused) == {"high"}
        session.entries.remeasure("frf", "cable")
        assert not session.state("frf").refused
        assert session.attempt.undoable  # a refusal is no entry: it is not taken back
        session.close()


async def test_undo_that_is_pressed_twice_takes_nothing_of_another_step_and_says_what_it_took():
    async with running() as pilot:
        await begin(pilot)
        pilot.app.screen.query_one(StepList).stand_at("capacitance")
        await press(pilot, "enter")
        await type_line(pilot, "4.99")
        await press(pilot, "escape")
        pilot.app.screen.query_one(StepList).stand_at("flatness")
        await press(pilot, "enter")
        for height in ("0", "4.95"):
            await type_line(pilot, height)
        await press(pilot, "ctrl+z")
        assert "height 2 4.95 um" in told(pilot)
        post(pilot, "ctrl+z", "ctrl+z", "ctrl+z")
        await settled(pilot)
        session = pilot.app.session
        assert not session.state("flatness").entries
        assert len(session.state("capacitance").entries) == 1
        await press(pilot, "escape", "ctrl+z")
        assert "4.99 uF" in told(pilot)
        assert not session.state("capacitance").entries
    with open_store() as store:
        (known,) = known_units(store, {"apa": load_spec("apa-basic")})
    assert known.last == ""


async def test_after_a_question_in_front_the_cursor_is_where_it_was():
    """A complete step took the cursor into a field, and the next Enter did not go on."""
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await type_line(pilot, HEIGHTS)
        assert pilot.app.focused is None
        await press(pilot, "f8", "escape")
        assert pilot.app.focused is None
        await press(pilot, "enter")
        assert pilot.app.screen.step.name == "capacitance"


async def test_who_measured_stands_on_the_certificate_where_several_did():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await type_line(pilot, HEIGHTS)
        session = pilot.app.session
        assert not unit_folder.read(session.written() and session.folder).notes
        assert toml_of((session.folder / unit_folder.UNIT_FILE).read_bytes())["measured_by"] == {"flatness": ["Ann"]}
        session.operator = "Ben"
        await press(pilot, "enter")
        await type_line(pilot, "4.99")
        session.written()
        assert unit_folder.read(session.folder).notes == {
            "flatness": ["measured by Ann"], "capacitance": ["measured by Ben"],
        }  # fmt: skip


async def test_what_was_complete_when_the_program_was_killed_is_judged_in_the_list():
    async with running() as pilot:
        await begin(pilot)
        session = pilot.app.session
        inputs = session.step("capacitance").check.inputs
        for name, value in (("sensor_uF", 4.99), ("actuator_uF", 19.85)):  # as a kill leaves them: not judged
            session.entries.take("capacitance", inputs[name], Measured(value))
        await press(pilot, "escape")
        await begin(pilot)
        session = pilot.app.session
        assert session.judgements.status(session.step("capacitance")) is Status.FAIL
        rail = pilot.app.screen.query_one(StepList)
        assert "✗" in str(rail.get_cell("capacitance", "mark"))
        rail.stand_at("capacitance")
        await settled(pilot)
        assert "not judged" not in pilot.app.screen.query_one("#card")._hung.text.plain


async def test_a_judgement_during_which_a_value_was_entered_is_not_kept():
    async with running() as pilot:
        await begin(pilot)
        session = pilot.app.session
        inputs = session.step("capacitance").check.inputs
        for name, value in (("sensor_uF", 4.99), ("actuator_uF", 9.85)):
            session.entries.take("capacitance", inputs[name], Measured(value))
        upto = session.state("capacitance").upto

        def late(folder, spec, stated):
            session.entries.take("capacitance", inputs["sensor_uF"], Measured(1.2))
            session.written()
            return judge_here(folder, spec, stated)

        judge_step(session, "capacitance", late)
        assert upto not in session.state("capacitance").judgements
        session.undo.entry()
        assert session.judgements.of_step("capacitance") is None


@pytest.mark.parametrize(("size", "who"), [(NARROW, "Annemari…"), ((100, 30), "Annemarie Müller")])
async def test_serial_and_time_of_a_unit_stand_whole_and_a_name_as_far_as_there_is_room(size, who: str, monkeypatch):
    monkeypatch.setattr(units_table, "since_words", lambda *_: "26 Nov 26"[:8])
    serial = f"APA-2026-{'8' * 20}"
    async with running(size=size, given=Given("Annemarie Müller")) as pilot:
        await begin(pilot, serial)
        await press(pilot, "escape")
        row = pilot.app.screen.query_one("#known", DataTable).get_row_at(0)
        assert str(row[0]) == serial
        assert [str(cell).strip() for cell in row[-2:]] == [who, "26 Nov 2"]


@pytest.mark.parametrize("size", [NARROW, (140, 40)])
async def test_what_is_saved_stands_in_one_column_until_something_is_typed(tmp_path: Path, size):
    t = np.arange(0.0, 30.0, 0.01)
    for name in ("one.csv", "two.csv"):
        write_csv(tmp_path / name, {"t": t, "de": np.random.default_rng(len(name)).standard_normal(t.size) * 1e-8})
    async with running(loader("apa-basic", tmp_path), size) as pilot:
        await begin(pilot)
        session = pilot.app.session
        files = [i for i in session.step("stiffness").check.inputs.values() if isinstance(i, Series)]
        for declared, name in zip(files, ("one.csv", "two.csv"), strict=True):
            session.records.link("stiffness", declared, tmp_path / name)
        pilot.app.screen.query_one(StepList).stand_at("stiffness")
        await press(pilot, "enter", "up", "up")
        fields = [field for field in pilot.app.screen.query(Field) if field.place.is_file]
        assert pilot.app.focused in [field.input for field in fields]
        assert len({field.query_one(".stored").region.x for field in fields}) == 1
        room = pilot.app.focused.size.width
        await press(pilot, "x")
        assert pilot.app.focused.size.width > room


async def test_the_line_in_which_is_typed_is_on_the_screen_below_long_words():
    async with running() as pilot:
        lines = [QuestionLine("Passphrase", secret=True), QuestionLine("Reason")]
        await pilot.app.push_screen(Question("Sign APA-02", "not measured: Stroke, three stacks\n" * 22, lines))
        for _ in lines:
            line = pilot.app.focused
            await settled(pilot)  # the question scrolls to its line once it is laid out
            assert pilot.app.screen.region.contains_region(line.region)
            assert line.parent.region.contains_region(line.region)
            await press(pilot, "enter")


async def test_a_photo_that_a_note_holds_is_not_proposed_again(tmp_path: Path):
    records = tmp_path / "records"
    records.mkdir()
    (records / "IMG_0042.png").write_bytes(b"a crack")
    async with running(loader(records=records)) as pilot:
        await begin(pilot)
        for proposed in ("IMG_0042.png", ""):
            await press(pilot, "f5")
            assert pilot.app.screen.query(Input)[2].value == proposed
            await press(pilot, *"crack", *["enter"] * 4)
        (records / "IMG_0043.png").write_bytes(b"another")
        await press(pilot, "f5")
        assert pilot.app.screen.query(Input)[2].value == "IMG_0043.png"
        await press(pilot, "escape")
