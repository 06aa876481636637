"""Photos and other files of a note: copied, hashed, on the certificate if they are to be."""

import hashlib
import io
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image
from pypdf import PdfReader

from accept.base.home import home
from accept.certificate import InvalidCertificate, content_of, read_contents
from accept.certificate.page.document import render
from accept.certificate.verify import attachments
from accept.judging import judge_unit, load_spec
from accept.judging.reservations.nonconformance import open_nonconformances
from accept.store import open_store
from accept.units import unit_folder
from accept.workflow import certify
from accept.workflow.entry.parse_entry import EntryError, parse_path
from accept.workflow.entry.record_folder import new_photo
from accept.workflow.session import Session
from accept.workflow.session.entries import NOTES_FOLDER
from accept.workflow.session.open_session import open_session
from accept.workflow.worker.judging import judge_step, judge_whole_unit
from checks.declare import Measured

PHOTO = b"\xff\xd8 a crack"
DIGEST = hashlib.sha256(PHOTO).hexdigest()


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    path = tmp_path / "crack.jpg"
    path.write_bytes(PHOTO)
    return path


@pytest.fixture
def session():
    with open_store() as store:
        opened = open_session(store, home(), load_spec("apa-basic"), "Ann", "APA-02")
        opened.begin({})
        step = opened.step("capacitance")
        opened.entries.take("capacitance", step.check.inputs["sensor_uF"], Measured(4.99))
        yield opened
        opened.close()


def lines(session: Session) -> list[str]:
    """What the unit's folder says on flatness, and a batch reads."""
    judge_step(session, "capacitance")
    unit = unit_folder.read(session.folder)
    notes = [note for note in judge_unit(unit, session.spec).notes if note.startswith("flatness: ")]
    return [note.removeprefix('flatness: typed note: "').removesuffix('"') for note in notes]


def test_what_was_read_from_an_instrument_is_told_from_what_was_typed_in_the_unit_s_folder(session: Session):
    def read_with() -> dict[str, list[str]]:
        judge_step(session, "capacitance")
        content: dict[str, list[str]] = unit_folder.toml_of((session.folder / unit_folder.UNIT_FILE).read_bytes()).get(
            "read_with", {}
        )
        return content

    inputs = session.step("capacitance").check.inputs
    assert read_with() == {}  # typed
    session.entries.take("capacitance", inputs["actuator_uF"], Measured(9.85, 0.003), source="LCR-819 SIM-1")
    assert read_with() == {"capacitance": ["typed", "LCR-819 SIM-1"]}
    session.entries.take("capacitance", inputs["sensor_uF"], Measured(4.98), source="LCR-819 SIM-1")
    assert read_with() == {"capacitance": ["LCR-819 SIM-1"]}  # what was replaced does not count
    unit_folder.read(session.folder)


def test_a_photo_is_copied_hashed_and_named_on_the_certificate(session: Session, photo: Path):
    session.entries.note("flatness", "scratch", files=[photo])
    assert (session.folder / NOTES_FOLDER / "crack.jpg").read_bytes() == PHOTO
    assert lines(session) == [f"scratch; file crack.jpg, SHA-256 {DIGEST} (Ann)"]


def test_a_certificate_with_a_photo_verifies_and_names_its_hash(session: Session, photo: Path):
    certify.trust.init(session.home, "correct horse", "Ann")
    session.entries.note("capacitance", "scratch", files=[photo])
    session.entries.note("capacitance", "flexure cracked", True, [photo])
    assert DIGEST in judge_whole_unit(session).nonconformances[0]
    assert certify.Signing(session).sign("correct horse", "only the notes are wanted").valid
    attached = PdfReader(session.attempt.certificate).attachments.values()
    line = f"scratch; file crack.jpg, SHA-256 {DIGEST} (Ann)"
    assert any(line.encode() in content for contents in attached for content in contents)


def test_a_picture_is_printed_if_it_is_asked_for_and_verified(session: Session, tmp_path: Path):
    certify.trust.init(session.home, "correct horse", "Ann")
    photo = tmp_path / "crack.png"
    Image.effect_noise((3000, 1500), 60.0).save(photo)
    session.entries.note("capacitance", "scratch", files=[photo], printed=True)
    judge_whole_unit(session)
    assert certify.Signing(session).sign("correct horse", "only the notes are wanted").valid
    pdf = Path(session.attempt.certificate)
    shown = [(page, image) for page in PdfReader(pdf).pages for image in page.images]
    assert [image.image.size for _, image in shown] == [(1200, 600)]
    small = (session.folder / NOTES_FOLDER / "crack.print.jpg").read_bytes()
    text = shown[0][0].extract_text().replace("\n", "")
    assert hashlib.sha256(small).hexdigest() in text.replace(" ", "")
    contents = read_contents(pdf.read_bytes())
    assert contents.files["notes/crack.print.jpg"] == small
    other = io.BytesIO()
    Image.new("RGB", (1200, 600)).save(other, "JPEG")
    forged = replace(contents, files={**contents.files, "notes/crack.print.jpg": other.getvalue()})
    assert render(forged) != render(contents)
    with pytest.raises(InvalidCertificate, match="is not the file that was judged"):
        attachments._check_hashes(forged)


def test_a_picture_that_is_off_the_certificate_or_gone_is_not_printed(session: Session, tmp_path: Path):
    photo = tmp_path / "crack.png"
    Image.new("RGB", (40, 20)).save(photo)
    session.entries.note("capacitance", "table is wobbly", files=[photo], internal=True, printed=True)
    judge_whole_unit(session)
    assert not unit_folder.read(session.folder).pictures
    session.entries.note("capacitance", "scratch", files=[photo], printed=True)
    result = judge_whole_unit(session)
    assert unit_folder.read(session.folder).pictures == {"capacitance": ["notes/crack.print.jpg"]}
    contents = content_of(result, session.spec, session.folder, "Ann", size_limit=0)
    assert "not attached" in "".join(page.extract_text() for page in PdfReader(io.BytesIO(render(contents))).pages)


def test_what_is_no_picture_is_refused_before_anything_is_stored(session: Session, photo: Path):
    before = session.run.seq
    with pytest.raises(EntryError, match="no picture that can be printed"):
        session.entries.note("flatness", "scratch", files=[photo], printed=True)
    assert session.refresh().seq == before


def test_another_photo_of_the_same_name_replaces_none(session: Session, photo: Path):
    session.entries.note("flatness", "one", files=[photo])
    photo.write_bytes(b"another")
    session.entries.note("flatness", "two", files=[photo])
    assert [[file.name for file in note.files] for note in session.state("flatness").notes] == [
        ["crack.jpg"],
        ["crack-2.jpg"],
    ]
    assert (session.folder / NOTES_FOLDER / "crack.jpg").read_bytes() == PHOTO


def test_an_internal_note_stays_off_the_certificate(session: Session, photo: Path):
    session.entries.note("flatness", "table is wobbly", files=[photo], internal=True)
    assert lines(session) == []
    assert session.state("flatness").notes[0].text == "table is wobbly"


def test_a_nonconformance_with_a_photo_holds_the_unit_once_and_is_never_internal(session: Session, photo: Path):
    session.entries.note("flatness", "flexure cracked", True, [photo], internal=True)
    (line,) = lines(session)
    assert DIGEST in line
    notes = unit_folder.read(session.folder).notes
    assert len(open_nonconformances(session.store, "APA-02", notes)) == 1


def test_a_file_that_is_not_there_stores_nothing(session: Session, tmp_path: Path):
    with pytest.raises(OSError, match="crack"):
        session.entries.note("flatness", "scratch", files=[tmp_path / "crack.png"])
    with pytest.raises(EntryError):
        session.entries.note("flatness", " ")
    assert not session.state("flatness").notes


@pytest.mark.parametrize(
    "text",
    ["/data/my photo.jpg", "'/data/my photo.jpg'", '"/data/my photo.jpg"', r"/data/my\ photo.jpg ",
     "file:///data/my%20photo.jpg"],
)  # fmt: skip
@pytest.mark.skipif(os.sep != "/", reason="as terminals of Linux and macOS drop a file")
def test_a_path_is_read_as_a_file_manager_drops_it(text: str):
    assert parse_path(text, Path("/records")) == Path("/data/my photo.jpg")


def test_a_relative_path_is_in_the_folder_of_records():
    assert parse_path("crack.jpg", Path("/records")) == Path("/records/crack.jpg")


def test_a_photo_taken_just_now_is_proposed_and_no_older_one(photo: Path):
    assert new_photo(photo.parent) == "crack.jpg"
    os.utime(photo, (time.time() - 3600,) * 2)
    assert new_photo(photo.parent) == ""
    assert new_photo(photo.parent / "nowhere") == ""
