"""The workflow judges, signs and holds what the store has of a unit, whatever lies in its folder and whoever judges it
meanwhile."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from accept.base.home import home
from accept.certificate import SigningRefused
from accept.store import Store, open_store
from accept.store.payloads import CertificateSigned, StepJudged, UnitJudged
from accept.units import UNIT_FILE
from accept.workflow import certify
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.session import Session
from accept.workflow.worker.judging import judge_here, judge_step, judge_whole_unit
from tests.accept.units.units import GOOD, make_unit
from tests.accept.workflow.test_workflow import declared, filled
from tests.shared.command_line import accept

PLACES = [(x, y) for x in (-29.5, -16, 16, 29.5) for y in (9, -9)]
FLAT = "x_mm,y_mm,z_um\n" + "".join(f"{x},{y},{z}\n" for (x, y), z in zip(PLACES, range(8), strict=True))
BENT = FLAT.replace("16,9,4\n", "16,9,60\n")


@pytest.fixture
def store() -> Iterator[Store]:
    with open_store() as opened:
        yield opened


@pytest.fixture
def session(store: Store) -> Iterator[Session]:
    with filled(store) as opened:
        yield opened


def link(session: Session, folder: Path, text: str) -> Path:
    """Take a table of heights and return its copy in the unit's folder."""
    folder.mkdir(exist_ok=True)
    (folder / "heights.csv").write_text(text)
    session.entries.remeasure("flatness", "with a table")
    session.records.link("flatness", declared(session, "flatness", "points"), folder / "heights.csv")
    taken = session.state("flatness").link("points")
    assert taken is not None
    return session.folder / taken.file


def test_a_record_that_was_exchanged_in_the_folder_is_not_judged(session: Session, tmp_path: Path) -> None:
    """Red before: accepted, signed and plainly valid, while the store had the hash of the record that was taken, and
    that the step had failed by it."""
    copy = link(session, tmp_path / "rig", BENT)
    (finding,) = judge_step(session, "flatness").findings
    assert finding.verdict == "fail"
    copy.write_text(FLAT)
    for judge in (lambda: judge_step(session, "flatness"), lambda: judge_whole_unit(session)):
        with pytest.raises(EntryError, match=r"heights.csv is not what was entered \(sha256 .* F2: take it again"):
            judge()
    with pytest.raises(EntryError, match="is not what was entered"):
        certify.Signing(session).sign("correct horse")
    assert len([*session.store.events("APA-02", StepJudged.KIND)]) == 1
    assert not [*session.store.events("APA-02", UnitJudged.KIND)]
    link(session, tmp_path / "later", FLAT)
    assert judge_whole_unit(session).verdict == "accepted"


def test_entries_that_were_exchanged_while_they_are_judged_are_not(session: Session) -> None:
    """Red before: the store had a stroke of 365.5 um, and the certificate 350."""

    def judge(folder: Path, *given: object):
        (folder / UNIT_FILE).write_text((folder / UNIT_FILE).read_text().replace("365.5", "350.0"))
        return judge_here(folder, *given)

    with pytest.raises(EntryError, match=r"unit.toml is not what was entered .* Judge once more"):
        judge_whole_unit(session, judge)
    assert not [*session.store.events("APA-02", UnitJudged.KIND)]
    assert judge_whole_unit(session).verdict == "accepted"


def test_what_was_judged_elsewhere_meanwhile_is_not_signed_over(session: Session, tmp_path: Path) -> None:
    """Red before: an accepted certificate was signed after the rejection, which it did not state."""
    assert judge_whole_unit(session).verdict == "accepted"
    text = GOOD.replace("5.10", "5.06").replace("373.2", "150.5").replace("1.70", "1.68").replace("10.03", "9.98")
    done = accept(
        "batch", make_unit(tmp_path / "b", "APA-02", text), "--spec", "apa-basic", "--out", tmp_path / "o",
        "--no-certificates", "--operator", "Ann K.",
    )  # fmt: skip
    assert done.exit_code == 3, done.output
    with pytest.raises(SigningRefused, match=r"it was judged meanwhile, rejected in .*/b; judged .* it is held"):
        certify.Signing(session).sign("correct horse", "")
    assert not [*session.store.events("APA-02", CertificateSigned.KIND)]
    assert not list((home() / "certificates").glob("*"))


def test_a_note_that_says_nonconformance_is_one(session: Session) -> None:
    """Red before where the note was not for the certificate: the unit was accepted."""
    session.entries.note("stroke", "Non-conformance: flexure cracked", internal=True)
    assert judge_whole_unit(session).nonconformances == ("stroke: flexure cracked (Ann)",)


def test_a_pipe_is_no_photo(session: Session, tmp_path: Path) -> None:
    """Red before: the screen waited for ever for what was to be printed."""
    os.mkfifo(tmp_path / "photo.jpg")
    with pytest.raises(OSError, match="is a pipe or a device"):
        session.entries.note("stroke", "see the photo", files=[tmp_path / "photo.jpg"], printed=True)
