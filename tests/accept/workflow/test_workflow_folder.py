"""What goes between the workflow and a unit folder: days, notes, and a folder that is taken up."""

from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np
import pytest
import tomlkit

from accept.base.home import home
from accept.judging import judge_unit, load_spec
from accept.store import open_store
from accept.units import unit_folder
from accept.units.unit_folder import UnitError
from accept.workflow import certify
from accept.workflow.dialogue.begin import Begun
from accept.workflow.open_bench import open_bench
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.state.unit_state import fold_run
from accept.workflow.steps.status import Status
from accept.workflow.worker.judging import judge_step, judge_whole_unit
from accept.workflow.worker.process import WorkerProcess
from checks.declare import Measured
from specs.bench import ChannelSource
from tests.accept.workflow.test_workflow import fill, take
from tests.shared.record_files import write_csv

UNIT = {
    "serial": "APA-05",
    "kind": "apa",
    "measured": {"flatness": date(2026, 5, 1), "capacitance": date(2026, 5, 2)},
    "notes": {"stroke": ["belongs to the first lot (Ann)"]},
    "flatness": {"points": "heights.csv"},
    "capacitance": {"sensor_uF": 4.9, "actuator_uF": {"value": 9.66, "U": 0.03}},
    "stroke": {"stroke_um": 361.5},
}


@pytest.fixture
def store():
    with open_store() as opened:
        yield opened


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "APA-05"
    place.mkdir()
    heights = {"x_mm": np.arange(4.0), "y_mm": np.arange(4.0) ** 2, "z_um": np.array([0.0, 1.0, 0.5, 0.2])}
    write_csv(place / "heights.csv", heights)
    (place / "unit.toml").write_text(tomlkit.dumps(UNIT))
    return place


@pytest.fixture(autouse=True)
def judged_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test here judges in the other process: none is started."""
    monkeypatch.setattr(WorkerProcess, "warm", lambda self: None)


def opened(folder: Path | None, reason: str | None = None) -> tuple[Session, list[str]]:
    bench = open_bench("apa-basic", folder=folder)
    return bench.open_unit(Begun("APA-05", "apa", "Ann", reason=reason))


def fresh(store) -> Session:
    session = open_session(store, home(), load_spec("apa-basic"), "Ann", "APA-02")
    session.begin({})
    return session


def test_a_folder_is_taken_up_as_it_is(folder: Path):
    session, problems = opened(folder)
    assert problems == []
    assert {s.name: session.judgements.status(s) for s in session.steps if session.state(s.name).entries} == {
        "flatness": Status.TAKEN,
        "capacitance": Status.TAKEN,
        "stroke": Status.TAKEN,
    }
    verdict = judge_whole_unit(session)
    session.close()
    theirs, mine = unit_folder.read(folder), unit_folder.read(session.folder)
    assert mine.sections.keys() == theirs.sections.keys()
    assert mine.sections["capacitance"].entries == theirs.sections["capacitance"].entries
    assert dict(mine.measured) | {"stroke": None} == dict(theirs.measured) | {"stroke": None}
    again = judge_unit(theirs, load_spec("apa-basic"))
    assert verdict.findings == again.findings  # the same as a batch over the folder says


def test_taking_it_up_again_adds_nothing_and_brings_nothing_back(folder: Path):
    session, _ = opened(folder)
    before = [e.seq for e in session.store.events("APA-05", "value_taken")]
    session.undo.entry()
    take(session, "capacitance", "sensor_uF", 5.0)
    session.close()
    session, _ = opened(folder)
    assert [e.seq for e in session.store.events("APA-05", "value_taken")] == [*before, max(before) + 2]
    assert [r.value for r in session.state("capacitance").readings("sensor_uF")] == [5.0]
    assert not session.state("stroke").entries  # it was undone
    session.close()


def test_a_new_attempt_takes_the_folder_again(folder: Path):
    session, _ = opened(folder)
    session.close()
    session, _ = opened(folder, reason="came back")
    assert session.attempt.number == 2
    assert session.state("stroke").entries
    session.close()


def test_the_labs_own_names_of_channels_go_along(tmp_path: Path):
    t = np.arange(0.0, 30.0, 0.01)
    write_csv(tmp_path / "cc.csv", {"t": t, "ENC": 1e-6 * np.sin(t)})
    head = 'serial = "APA-05"\nkind = "apa"\n[channels]\nde = "ENC"\n'
    (tmp_path / "unit.toml").write_text(head + '[stiffness]\nclosed_circuit = "cc.csv"\nmass_kg = 6.4\n')
    session, problems = opened(tmp_path)
    assert problems == []
    judge_step(session, "stiffness")
    assert unit_folder.read(session.folder).channels == {"de": ChannelSource(name="ENC")}
    session.close()


def test_a_record_that_is_gone_is_said_and_the_rest_is_taken(folder: Path):
    (folder / "heights.csv").unlink()
    session, problems = opened(folder)
    assert len(problems) == 1
    assert "heights.csv" in problems[0]
    assert session.state("stroke").entries
    session.close()


def test_a_folder_of_another_kind_is_refused_before_anything_is_stored(folder: Path, store):
    with pytest.raises(UnitError, match="judges 'strut'"):
        open_bench("strut-basic", folder=folder)
    assert store.head().seq == 0


def test_the_days_are_written_by_the_workflow(store):
    session = fresh(store)
    fill(session)
    judge_whole_unit(session)
    today = datetime.now(UTC).date()
    days = unit_folder.read(session.folder).measured
    session.close()
    assert set(days) == {"flatness", "capacitance", "stroke", "stiffness"}
    assert set(days.values()) <= {today, date.fromordinal(today.toordinal() - 1)}  # midnight may pass meanwhile


def test_notes_and_reasons_reach_the_certificate(store):
    session = fresh(store)
    certify.Signing(session).make_keys("correct horse")
    fill(session)
    session.entries.remeasure("stroke", "gauge was loose")
    take(session, "stroke", "stroke_um", 365.5)
    session.entries.note("flatness", "scratch on the shell", nonconformance=True)
    result = judge_whole_unit(session)
    report = certify.Signing(session).sign(
        "correct horse", "quality assurance is asked"
    )  # judged again from its own attachments, notes included
    session.close()
    assert report.valid
    assert 'stroke: typed note: "measured again: gauge was loose"' in result.notes
    assert 'flatness: typed note: "NONCONFORMANCE: scratch on the shell (Ann)"' in result.notes


def test_a_note_after_the_signature_asks_for_a_new_one(store):
    session = fresh(store)
    certify.Signing(session).make_keys("correct horse")
    fill(session)
    judge_whole_unit(session)
    certify.Signing(session).sign("correct horse")
    session.entries.note("stroke", "smells burnt", nonconformance=True)
    assert session.attempt.verdict is None
    assert session.attempt.certificate is None
    judge_whole_unit(session)
    assert certify.Signing(session).sign("correct horse", "quality assurance is asked").valid
    session.close()


def test_what_is_no_note_is_refused(tmp_path: Path):
    for wrong in ('stroke = "one"', "stroke = [1]", 'nothing = ["one"]'):
        (tmp_path / "unit.toml").write_text(f'serial = "A"\nkind = "apa"\n[notes]\n{wrong}\n')
        with pytest.raises(UnitError, match="notes"):
            unit_folder.read(tmp_path)


def test_entries_of_a_program_before_fold_as_they_did(store):
    """Days, evidence and channels came later: a store that has none of them is read."""
    session = fresh(store)
    event = session.entries.take("stroke", session.step("stroke").check.inputs["stroke_um"], Measured(365.5))
    assert not {"day", "evidence"} & set(event.data)
    run = fold_run("APA-02", store.events("APA-02"))
    assert run.attempt.step("stroke").day == event.time[:10]
    session.close()
