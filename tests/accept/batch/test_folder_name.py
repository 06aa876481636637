"""A folder that was copied, and whose `unit.toml` still has the serial of the first unit, is asked about."""

import json
from pathlib import Path

import pytest

from accept.commands.units import batch, report
from accept.judging.reservations.folder_name import is_other_serial
from accept.store import open_store
from accept.workflow.dialogue.begin import Begun
from accept.workflow.open_bench import open_bench
from accept.workflow.worker.process import WorkerProcess
from tests.accept.tui.tui_help import loader, press, running, type_line, words
from tests.accept.units.units import make_unit
from tests.shared.command_line import accept


def unit(folder: Path, serial: str, k: float = 1.695) -> Path:
    make_unit(folder, serial)
    text = (folder / "unit.toml").read_text()
    (folder / "unit.toml").write_text(text.replace("k_N_per_um = 1.70", f"k_N_per_um = {k}"))
    return folder


def judged(out: Path) -> dict[str, dict]:
    return {u["serial"]: u for u in json.loads((out / "results.json").read_text())["units"]}


@pytest.mark.parametrize(
    ("name", "serial", "other"),
    [
        ("Q-07", "Q-06", True),
        ("q-07", "Q-06", True),
        ("Q-6", "Q-06", False),
        ("Q-06", "Q-06", False),
        ("2026-11-20 Q-06", "Q-06", False),
        ("tuesday", "Q-06", False),
        ("APA", "STRUT", False),
    ],
)
def test_which_name_reads_like_another_serial(name: str, serial: str, other: bool) -> None:
    assert is_other_serial(name, serial) is other


def test_a_folder_with_another_serial_as_its_name_is_conditional(tmp_path: Path) -> None:
    units, out = tmp_path / "units", tmp_path / "out"
    unit(units / "Q-06", "Q-06", 1.68)
    unit(units / "monday", "Q-08", 1.70)
    assert accept("batch", units, "--out", out, "--spec", "apa-basic").exit_code == 0
    copied = unit(tmp_path / "more" / "Q-07", "Q-09")
    done = accept("batch", copied, "--out", out, "--spec", "apa-basic")
    assert done.exit_code == 4
    found = judged(out)["Q-09"]
    assert (found["verdict"], found["folder"]) == ("conditional", {"name": "Q-07"})
    assert {f["cause"]["code"] for f in found["findings"]} == {"folder_name"}
    assert accept("verify", out / "certificates" / "Q-09.pdf").exit_code == 0
    renamed = copied.rename(copied.with_name("Q-09"))
    assert accept("batch", renamed, "--out", out, "--spec", "apa-basic").exit_code == 0
    assert "folder" not in judged(out)["Q-09"]


def test_the_name_of_a_unit_that_the_store_knows_is_doubted(tmp_path: Path) -> None:
    accept("batch", unit(tmp_path / "bracket", "bracket", 1.68), "--out", tmp_path / "o", "--spec", "apa-basic")
    other = unit(tmp_path / "more" / "bracket", "APA-3")
    assert accept("report", other, "--spec", "apa-basic", "--out", tmp_path / "r.pdf").exit_code == 4


@pytest.mark.parametrize(("answer", "code"), [(True, 0), (False, 6)])
def test_at_a_terminal_it_is_asked_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answer: bool, code: int
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(report, "confirm", lambda words: asked.append(words) or answer)
    monkeypatch.setattr(batch, "confirm", lambda words: asked.append(words) or answer)
    folder = unit(tmp_path / "Q-07", "Q-06")
    done = accept("report", folder, "--spec", "apa-basic", "--out", tmp_path / "q.pdf")
    assert (done.exit_code, len(asked)) == (code, 1)
    assert "Q-07" in asked[0]
    assert "Q-06" in asked[0]
    if answer:
        with open_store() as store:
            (event,) = store.events("Q-06", "unit_judged")
        assert event.data["result"]["folder"] == {"name": "Q-07", "confirmed_by": "Test Technician"}
        assert accept("verify", tmp_path / "q.pdf").exit_code == 0
        assert accept("batch", folder, "--out", tmp_path / "o", "--spec", "apa-basic").exit_code == 0
        assert len(asked) == 1  # the same unit.toml was confirmed
        unit(tmp_path / "Q-07", "Q-06", 1.7)
        accept("batch", folder, "--out", tmp_path / "o", "--spec", "apa-basic")
        assert len(asked) == 2


def test_another_serial_takes_nothing_from_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(WorkerProcess, "warm", lambda self: None)
    bench = open_bench("apa-basic", folder=unit(tmp_path / "Q-06", "Q-06"))
    session, problems = bench.open_unit(Begun("Q-11", "apa", "Ann"))
    assert ["Q-06" in words for words in problems] == [True]
    assert all(not session.state(step.name).entries for step in session.steps)
    session.close()
    bench.store.close()


async def test_the_workflow_asks_for_the_serial_on_the_label(tmp_path: Path) -> None:
    """Another serial than that of the folder goes no further; the right one does."""
    async with running(loader(folder=unit(tmp_path / "Q-07", "Q-06"))) as pilot:
        screen = pilot.app.screen
        screen.query_one("#serial").focus()
        await press(pilot, *["enter"] * 2)
        assert type(pilot.app.screen).__name__ == "Question"
        await type_line(pilot, "Q-07")
        assert pilot.app.screen is screen
        assert "not confirmed" in words(pilot, "#status")
        await press(pilot, "enter")
        await type_line(pilot, "Q-06")
        assert type(pilot.app.screen).__name__ == "Steps"
