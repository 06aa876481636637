"""Every screen with a pilot: what a technician does, what the store holds afterwards."""

import asyncio
import errno
import os
import time
from pathlib import Path

import pytest
from rich.text import Text
from textual.widgets import DataTable, Input, Label, Static

from accept.base.home import home
from accept.certificate.trust import key_changes, keys
from accept.commands.trust.verify import VerifyOptions, verifier
from accept.store import Store, StoreError, open_store
from accept.tui.screens.start import Given
from accept.tui.widgets.banner import Banner
from accept.tui.widgets.fields import Field
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.plot import PanelView
from accept.tui.widgets.step_list import HELD, StepList
from accept.workflow.state.unit_state import fold_run
from checks.acceptance import CHECKS
from tests.accept.tui.tui_help import (
    WIDE,
    begin,
    fill_basic,
    loader,
    press,
    running,
    settled,
    sign_first,
    title,
    type_line,
    words,
)
from tests.accept.units.units import DATA


def stored(what: str | None = None) -> list[dict]:
    with open_store() as store:
        return [event.data for event in store.events("APA-02", what)]


def screen(pilot) -> str:
    return type(pilot.app.screen).__name__


def qa_key(person: str, passphrase: str) -> None:
    """A key for quality assurance, as `accept keys request` and `accept keys issue` make it."""
    place = keys.folder(home())
    _, asked = key_changes.request(home(), keys.QA, person, passphrase)
    issued = key_changes.issue_request(place, asked, (place / keys.AUTHORITY_PASSPHRASE).read_text().strip())
    key_changes.install(home(), issued)


@pytest.mark.slow
async def test_a_unit_from_start_to_countersigned_certificate_by_keys_alone():
    async with running() as pilot:
        await begin(pilot)
        await fill_basic(pilot)
        table = pilot.app.screen.query_one(DataTable)
        assert [str(table.get_cell(key, "mark")).strip() for key in table.rows] == ["✓"] * 4
        await press(pilot, "f9")
        assert pilot.app.screen.query_one(Banner).word == "accepted"
        assert words(pilot, "#verdict").startswith("All 5 quantities pass")
        await sign_first(pilot)
        assert "✓ verified: APA-02 accepted" in words(pilot, "#certificate")
        qa_key("Quinn", "battery staple")
        await press(pilot, "f3")
        await type_line(pilot, "battery staple")
        assert "countersigned" in words(pilot, "#certificate")
        await press(pilot, "f4")
        assert screen(pilot) == "StartScreen"
        assert pilot.app.screen.query_one("#operator", Input).value == "Ann"
        assert pilot.app.done.verdicts == {"APA-02": "accepted"}
    content = (home() / "certificates" / "APA-02.pdf").read_bytes()
    report = await asyncio.to_thread(verifier(VerifyOptions()), content)  # it runs an event loop of its own
    assert report.valid
    assert report.countersigned


async def test_a_rejected_unit_is_countersigned_with_what_is_to_be_done_with_it():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        for line in ("1.72", "9.85"):
            await type_line(pilot, line)
        await press(pilot, "escape", "f9")
        await sign_first(pilot, "for quality assurance")
        qa_key("Quinn", "battery staple")
        await press(pilot, "f3")
        assert any("use-as-is, rework" in label.render().plain for label in pilot.app.screen.query(Label))
        await type_line(pilot, "")
        assert "decide what is to be done with it" in words(pilot, "#wrong")  # and the question stays
        for line in ("return", "sensor stack too small", "battery staple"):
            await type_line(pilot, line)
        assert "disposition: 'return to the supplier: sensor stack too small'" in words(pilot, "#certificate")


async def test_nonsense_is_refused_beside_the_field_and_nothing_is_stored():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        before = len(stored())
        for typed, reason in (("abc", "not a number"), ("4.99 V", "fit here; use µF"), ("1e9", "not plausible")):
            field = pilot.app.screen.query(Field).first()
            pilot.app.screen.set_focus(field.input)
            field.input.value = ""
            await type_line(pilot, typed)
            assert reason in str(field.query_one(".reason").render())
            assert field.input.value == typed  # what was typed is kept for mending
        assert len(stored()) == before


async def test_repeat_readings_show_their_scatter():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "down", "enter")
        await type_line(pilot, "365")
        await press(pilot, "up", *"366", "f4")
        shown = str(pilot.app.screen.query(Field).first().query_one(".stored").render())
        assert "2 readings" in shown
        assert "s = 0.71" in shown  # 1 / sqrt(2)


async def test_undo_and_measuring_anew():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "down", "enter")
        await type_line(pilot, "365")
        assert "✓ pass" in title(pilot)
        await press(pilot, "ctrl+z")
        assert "not done" in title(pilot)
        await type_line(pilot, "200")
        assert "✗ fail" in title(pilot)
        await press(pilot, "f8")
        await type_line(pilot, "gauge was loose")
        assert "not done" in title(pilot)
        await type_line(pilot, "365")
        assert "✓ pass" in title(pilot)
    assert [e["value"] for e in stored("value_taken")] == [365, 200, 365]
    assert stored("step_remeasured")[0]["reason"] == "gauge was loose"
    assert len(stored("entry_undone")) == 1


async def test_notes_and_nonconformance():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "f5")
        await type_line(pilot, "scratch on the shell")
        for unclear in ("j", "ok", "x"):  # no answer: an unclear one must not leave the unit free
            await type_line(pilot, unclear)
            assert "expected y, n" in words(pilot, "#wrong")
        await press(pilot, "ctrl+u")
        for line in ("y", "", ""):
            await type_line(pilot, line)
        await press(pilot, "ctrl+z")
        assert "only quality assurance releases it" in words(pilot, "#status")
    noted = {"step": "flatness", "text": "scratch on the shell", "nonconformance": True, "typed": True}
    assert stored("step_noted") == [noted]
    assert not stored("entry_undone")


def reds(shown: Text) -> str:
    """What is shown in bold red."""
    return " ".join(shown.plain[span.start : span.end] for span in shown.spans if "bold red" in str(span.style))


@pytest.mark.slow
async def test_a_nonconformance_is_red_and_first_wherever_one_decides():
    """On the list of steps, the summary and the question before the signature."""
    keys.init(home(), "correct horse", "Ann")
    async with running() as pilot:
        await begin(pilot)
        await fill_basic(pilot)
        await press(pilot, "end", "f5")
        await type_line(pilot, "flexure cracked")
        await press(pilot, "ctrl+u")
        for line in ("y", "", ""):
            await type_line(pilot, line)
        card = pilot.app.screen.query_one("#card", Hanging).render().text
        assert card.plain.startswith("HELD by a nonconformance at Stiffness: flexure cracked (Ann)")
        assert "flexure cracked" in reds(card)
        steps = pilot.app.screen.query_one(StepList)
        assert [str(cell.style) for cell in steps.get_row("stiffness")[:2]] == [HELD, HELD]
        await press(pilot, "f9")
        verdict = pilot.app.screen.query_one("#verdict", Hanging).render().text
        assert "HELD" in reds(verdict)
        assert "flexure cracked" in reds(verdict)
        assert "ACCEPTED" not in verdict.plain
        await press(pilot, "f2")
        asked = pilot.app.screen.query_one(".words", Label).content
        assert "flexure cracked" in reds(asked)


@pytest.mark.slow
async def test_a_known_serial_goes_on_where_it_stood():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await type_line(pilot, "0 -2.5 -3 0 -1.5 1 -2 -4")
    async with running() as pilot:
        await press(pilot, *"APA-02")
        assert "Enter opens APA-02 · attempt 1" in words(pilot, "#about")
        await press(pilot, "enter")
        table = pilot.app.screen.query_one(DataTable)
        assert str(table.get_cell("flatness", "mark")).strip() == "✓"
        assert table.cursor_row == 1  # the first step that is not complete


@pytest.mark.slow
async def test_whose_key_is_needed_is_said_before_a_passphrase_is_asked():
    keys.init(home(), "correct horse", "Ann")
    async with running(given=Given("Bob")) as pilot:
        await begin(pilot)
        await press(pilot, "f9", "f2")
        assert screen(pilot) == "Summary"
        assert "the key at this bench is that of Ann" in words(pilot, "#status")
        assert "keys request --role technician --name Bob" in words(pilot, "#status")
        assert "not signed. Judged in the name of Bob (typed)" in words(pilot, "#certificate")
        await press(pilot, "escape", "escape")
        await press(pilot, *"APA-02")
        assert "Bob cannot sign here" in words(pilot, "#about")
        assert "begun by Bob" in words(pilot, "#unit-card")


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "disk is full"),
        (StoreError("store: another program holds it locked"), "holds it locked"),
    ],
)
async def test_when_storing_fails_the_entry_is_kept_and_enter_tries_again(error, told, monkeypatch):
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "down", "enter")
        append = Store.append_many

        def broken(*_, **__):
            raise error

        monkeypatch.setattr(Store, "append_many", broken)
        await type_line(pilot, "365")
        field = pilot.app.screen.query(Field).first()
        assert told in words(pilot, "#status")
        assert field.input.value == "365"
        monkeypatch.setattr(Store, "append_many", append)
        await press(pilot, "enter")
        assert "✓ pass" in title(pilot)


async def test_an_unexpected_error_is_not_swallowed(monkeypatch):
    async def provoke() -> None:
        async with running() as pilot:
            await begin(pilot)
            await press(pilot, "down", "down", "enter")
            monkeypatch.setattr(Store, "append_many", lambda *_, **__: {}["bug"])
            await type_line(pilot, "365")

    with pytest.raises(KeyError, match="bug"):
        await provoke()


@pytest.mark.needs_data
async def test_records_are_picked_and_the_bode_plot_appears():
    async with running(loader("strut", DATA / "units" / "S-01"), WIDE) as pilot:
        await type_line(pilot, "S-01")
        while screen(pilot) == "StartScreen":
            await press(pilot, "enter")
        assert screen(pilot) == "Steps"
        await press(pilot, "enter")
        for name in ("frf_noise.mat", "frf_noise_hf.mat"):
            await type_line(pilot, name)
        assert "Axial resonance" in words(pilot, "#findings")
        titles = [str(view.border_title) for view in pilot.app.screen.query(PanelView)]
        assert any("Vs / Va" in title for title in titles)
        await press(pilot, "f7")
        assert screen(pilot) == "Plots"
        first = words(pilot, "#which")
        await press(pilot, "f7")
        assert words(pilot, "#which") != first
        assert "phase" in str(pilot.app.screen.query(PanelView).last().render())
        await press(pilot, "escape")
        assert screen(pilot) == "StepScreen"


async def test_a_file_that_is_no_record_is_refused(tmp_path: Path):
    (tmp_path / "bad.csv").write_text("x_mm,y_mm\n1,2\n")
    async with running(loader(records=tmp_path)) as pilot:
        await begin(pilot)
        await press(pilot, "enter", "ctrl+f", "f2")
        assert screen(pilot) == "Pick"
        await press(pilot, "enter")
        assert "z_um" in str(pilot.app.screen.query(Field).first().query_one(".reason").render())
    assert not stored("record_linked")


async def test_files_that_fit_come_first_and_letters_filter(tmp_path: Path):
    """The newest file is a table without heights: the older one that fits stands on top, the other is marked."""
    heights = "x_mm,y_mm,z_um\n" + "".join(f"{x},{y},0\n" for x in (-29.5, -16, 16, 29.5) for y in (-9, 9))
    (tmp_path / "flat.csv").write_text(heights)
    (tmp_path / "note.csv").write_text("x_mm,y_mm\n1,2\n")
    os.utime(tmp_path / "flat.csv", (1, 1))
    async with running(loader(records=tmp_path)) as pilot:
        await begin(pilot)
        await press(pilot, "enter", "f2")  # the step opens with the table: something is there for it
        table = pilot.app.screen.query_one(DataTable)
        assert [str(table.get_row_at(i)[0]) for i in (0, 1)] == ["flat.csv", "note.csv"]
        assert [str(table.get_row_at(i)[1]) for i in (0, 1)] == ["yes", "no"]
        assert "lacks" not in words(pilot, "#preview")
        await press(pilot, "down")
        assert "Does not fit, lacks: z_um" in words(pilot, "#preview")  # red before: "no" stood alone
        await press(pilot, "up")
        await press(pilot, "n", "o")
        assert str(table.get_row_at(0)[0]) == "note.csv"
        await press(pilot, "backspace", "backspace", "enter")
        assert screen(pilot) == "StepScreen"
    assert stored("record_linked")


POINTS = "x_mm,y_mm,z_um\n" + "".join(f"{x},{y},0\n" for x in (-29.5, -16, 16, 29.5) for y in (-9, 9))


def arrived(path: Path, seconds_ago: float) -> Path:
    """A table of heights that was written to its end so long ago."""
    path.write_text(POINTS)
    os.utime(path, (time.time() - seconds_ago,) * 2)
    return path


async def test_a_record_of_another_unit_or_still_being_written_is_not_proposed(tmp_path: Path):
    arrived(tmp_path / "flat.csv", 10)
    async with running(loader(records=tmp_path)) as pilot:
        await begin(pilot, "APA-01")
        await press(pilot, "enter", "enter", "escape", "escape")
        await begin(pilot)
        await press(pilot, "enter", "ctrl+f")
        assert pilot.app.screen.dialogue.proposed(0) is None
        arrived(tmp_path / "now.csv", 0)
        await pilot.app.screen.look_again()
        await settled(pilot)
        assert pilot.app.screen.dialogue.proposed(0) is None
    assert not stored("record_linked")


@pytest.mark.slow
async def test_every_check_has_a_step_made_from_its_declaration_alone():
    """A new check needs no line here: each declared input of each form has its field."""
    async with running(loader("apa")) as pilot:
        await begin(pilot, "APA-09")
        steps = pilot.app.session.steps
        assert {step.name for step in steps} == {name for name, check in CHECKS.items() if "apa" in check.kinds}
        table = pilot.app.screen.query_one(DataTable)
        for row, each in enumerate(steps):
            table.move_cursor(row=row)
            await press(pilot, "enter")
            step = pilot.app.screen.step
            assert step is each
            for form in step.check.forms:
                names = {field.place.declared.name for field in pilot.app.screen.query(Field)}
                assert names == {i.name for i in pilot.app.screen.dialogue.form.inputs}
                await press(pilot, *(["ctrl+f"] if len(step.check.forms) > 1 else []))
                assert form in step.check.forms
            await press(pilot, "escape")


async def test_help_on_every_screen():
    async with running() as pilot:
        await press(pilot, "f1")
        assert screen(pilot) == "Help"
        await press(pilot, "escape")
        await begin(pilot)
        for keys in (["f1"], ["enter", "f1"]):
            await press(pilot, *keys)
            assert screen(pilot) == "Help"
            told = "\n".join(str(part.render()) for part in pilot.app.screen.query(Static))
            assert ("^F          Other input" in told) == (len(keys) == 2)  # not in the footer, and here nevertheless
            await press(pilot, "escape")
        await press(pilot, "escape", "f9", "f1")
        assert screen(pilot) == "Help"


async def test_the_operator_and_the_serial_come_from_the_command_line():
    async with running(given=Given("Bob", "APA-02")) as pilot:
        await press(pilot, "enter", "enter")
        assert screen(pilot) == "Steps"
    with open_store() as store:
        events = list(store.events("APA-02"))
        assert events[0].who == "Bob"
        assert fold_run("APA-02", events).attempt.number == 1


async def test_arrows_go_from_line_to_line_where_the_form_is_longer_than_the_screen():
    async with running(loader("strut-basic")) as pilot:
        await type_line(pilot, "ST-01")
        for _ in range(6):
            if screen(pilot) == "StartScreen":
                await press(pilot, "enter")
        await press(pilot, "enter")
        assert pilot.app.screen.query_one("#body").max_scroll_y > 0
        lines = [field.input for field in pilot.app.screen.query(Field)]
        assert lines[0].has_focus
        await press(pilot, "down")
        assert lines[1].has_focus
        await press(pilot, "up")
        assert lines[0].has_focus
