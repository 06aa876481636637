"""A serial that looks like one that the store knows, a letter for a digit, is held until a person tells them apart."""

import json
from pathlib import Path

import pytest

from accept.base.documents.results import UnitHeader
from accept.base.spelling import difference, look_alike
from accept.commands.units import batch, report
from accept.store import Store, open_store
from accept.workflow.open_bench import open_bench
from accept.workflow.steps.unit_list import known_units
from accept.workflow.worker.process import WorkerProcess
from tests.accept.batch.test_folder_name import judged, unit
from tests.accept.tui.tui_help import press, running, type_line, words
from tests.shared.command_line import accept
from tests.shared.kept_folder import KeptFolder, kept


def judge_one(place: Path) -> None:
    unit(place / "units" / "APA-10", "APA-10", 1.68)
    assert accept("batch", place / "units", "--out", place / "out", "--spec", "apa-basic").exit_code == 0


one_judged = kept(judge_one)


@pytest.fixture
def known(one_judged: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The results of a batch with APA-10."""
    return one_judged.put_back(monkeypatch) / "out"


def test_it_is_conditional_until_it_is_confirmed_once(
    tmp_path: Path, known: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = unit(tmp_path / "more" / "APA-1O", "APA-1O")
    assert accept("batch", folder, "--out", known, "--spec", "apa-basic").exit_code == 4
    found = judged(known)["APA-1O"]
    assert (found["verdict"], found["folder"]) == ("conditional", {"alike": "APA-10"})
    assert {f["cause"]["code"] for f in found["findings"]} == {"serial_alike"}
    assert "looks like APA-10" in found["findings"][0]["reason"]
    assert accept("verify", known / "certificates" / "APA-1O.pdf").exit_code == 0
    assert accept("batch", known.parent / "units", "--out", known, "--spec", "apa-basic").exit_code == 0  # it was first

    asked: list[str] = []
    monkeypatch.setattr(report, "confirm", lambda question: asked.append(question) or True)
    monkeypatch.setattr(batch, "confirm", lambda question: asked.append(question) or True)
    done = accept("report", folder, "--spec", "apa-basic", "--out", tmp_path / "c.pdf")
    assert done.exit_code == 0, done.output
    assert ["character 6 is the letter O, not the digit 0" in question for question in asked] == [True]
    assert accept("verify", tmp_path / "c.pdf").exit_code == 0
    monkeypatch.setenv("ACCEPT_OPERATOR", "Somebody Else")
    unit(folder, "APA-1O", 1.7)
    assert accept("batch", folder, "--out", known, "--spec", "apa-basic", "--no-certificates").exit_code == 0
    assert len(asked) == 1
    assert "folder" not in judged(known)["APA-1O"]


def test_two_in_one_batch_are_not_both_accepted(tmp_path: Path) -> None:
    unit(tmp_path / "u" / "A-5", "A-5", 1.68)
    unit(tmp_path / "u" / "A-S", "A-S")
    assert accept("batch", tmp_path / "u", "--out", tmp_path / "o", "--spec", "apa-basic").exit_code == 4
    verdicts = {serial: found["verdict"] for serial, found in judged(tmp_path / "o").items()}
    assert sorted(verdicts.values()) == ["accepted", "conditional"]


def test_capitals_that_an_earlier_program_let_in_are_asked_about(
    tmp_path: Path, known: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, pdf = unit(tmp_path / "more" / "apa-10", "apa-10"), tmp_path / "c.pdf"
    with monkeypatch.context() as earlier:
        earlier.setattr(Store, "other_spelling", lambda *_: None)
        accept("report", folder, "--spec", "apa-basic", "--out", pdf)
    monkeypatch.setattr(report, "confirm", lambda _: True)
    unit(folder, "apa-10", 1.7)
    assert accept("report", folder, "--spec", "apa-basic", "--out", pdf, "--reason", "anew").exit_code == 0
    done = accept("verify", pdf)
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize("serial", ["APA-010", "APA_10", "APA10", "apa.0010"])
def test_zeros_and_separators_are_asked_about(tmp_path: Path, known: Path, serial: str) -> None:
    folder = unit(tmp_path / "more" / serial, serial)
    assert accept("batch", folder, "--out", known, "--spec", "apa-basic").exit_code == 4
    found = judged(known)[serial]
    assert (found["verdict"], found["folder"]) == ("conditional", {"alike": "APA-10"})
    assert "looks like APA-10" in found["findings"][0]["reason"]
    assert difference(serial, "APA-10").endswith("in leading zeros or separators")


@pytest.mark.parametrize(
    "pair", [("A-1", "A-10"), ("A-1.1", "A-11"), ("B-8", "8-B"), ("A-100", "A-1"), ("10-1", "1-01-1")]
)
def test_other_numbers_are_other_units(pair: tuple[str, str]) -> None:
    assert not look_alike(*pair)
    assert not look_alike(*reversed(pair))


def test_a_serial_that_was_not_confirmed_is_not_judged(
    tmp_path: Path, known: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "confirm", lambda _: False)
    folder = unit(tmp_path / "APA-1O", "APA-1O")
    done = accept("report", folder, "--spec", "apa-basic", "--out", tmp_path / "c.pdf")
    assert done.exit_code == 6
    with open_store() as store:
        assert not list(store.events("APA-1O", "unit_judged"))


async def test_the_workflow_asks_at_the_scan_and_once(known: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(WorkerProcess, "warm", lambda self: None)
    for again in (False, True):
        async with running() as pilot:
            screen = pilot.app.screen
            for name, value in (("operator", "Ben"), ("serial", "APA-1O")):
                screen.query_one(f"#{name}").value = value
            await pilot.pause()
            await press(pilot, "enter")
            while pilot.app.screen is screen:
                await press(pilot, "enter")
            if not again:
                assert type(pilot.app.screen).__name__ == "Question"
                assert "character 6 is the letter O, not the digit 0" in words(pilot, ".words")
                await type_line(pilot, "APA-10")
                assert "not confirmed" in words(pilot, "#status")
                await press(pilot, "enter")
                await type_line(pilot, "APA-1O")
            assert type(pilot.app.screen).__name__ == "Steps"
    with open_store() as store:
        (said,) = store.events("APA-1O", "serial_confirmed")
    assert (said.who, said.data["unlike"]) == ("Ben", ["APA-10"])


async def test_a_tray_asks_about_the_scan(known: Path) -> None:
    async with running() as pilot:
        await press(pilot, "f6")
        await type_line(pilot, "APA-1O")
        assert "letter O" in words(pilot, ".words")
        await type_line(pilot, "APA-10")
        assert "APA-1O was not confirmed, and not added" in words(pilot, "#status")
        await type_line(pilot, "APA-1O")
        await type_line(pilot, "APA-1O")
        assert "APA-1O added (1)" in words(pilot, "#status")
        await type_line(pilot, "APA-11")
        assert "APA-11 added (2)" in words(pilot, "#status")
    bench = open_bench("apa-basic")
    assert {"APA-1O", "APA-11"} <= {each.serial for each in known_units(bench.store, bench.specs)}
    assert len(list(bench.store.events("APA-1O", "serial_confirmed"))) == 1
    bench.close()


def test_a_part_that_looks_like_a_known_one_is_doubted(tmp_path: Path, known: Path) -> None:
    from accept.judging.reservations.parts import part_doubts

    with open_store() as store:
        assert "character 6 is the letter O" in "".join(
            part_doubts(store, UnitHeader(serial="S-1", kind="strut", parts={"apa": "APA-1O"}))
        )
        assert part_doubts(store, UnitHeader(serial="S-1", kind="strut", parts={"apa": "APA-10"})) == []


def test_the_cause_of_a_held_unit_is_named_in_the_yield(tmp_path: Path, known: Path) -> None:
    folder = unit(tmp_path / "more" / "APA-1O", "APA-1O")
    accept("batch", folder, "--out", known, "--spec", "apa-basic", "--no-certificates")
    assert "serial in doubt" in accept("yield").output
    assert json.loads((known / "results.json").read_text())


@pytest.mark.parametrize(
    "part", ["APA-10\u200b", "\u0391PA-10", "APA\u201110", "APA-10 ", "AP\u00adA-10", "APA-1\uff10"]
)
def test_a_part_in_letters_of_another_script_is_not_an_unknown_one(tmp_path: Path, known: Path, part: str) -> None:
    """The page would show the serial of a part that the store knows, perhaps as rejected."""
    folder = unit(tmp_path / "more" / "B-7", "B-7", 1.7)
    text = (folder / "unit.toml").read_text()
    (folder / "unit.toml").write_text(f'{text}[parts]\nsensor = "{part}"\n')
    assert accept("batch", folder, "--out", known, "--spec", "apa-basic").exit_code == 4
    (doubt,) = judged(known)["B-7"]["part_doubts"]
    assert doubt.isascii()
    assert "has characters that no serial has" in doubt
    assert accept("verify", known / "certificates" / "B-7.pdf").stdout.startswith("valid: B-7 conditional")
