"""A nonconformance of the part holds the unit, by whatever way it is judged, until quality assurance has decided."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature, encode_dss_signature
from pypdf import PdfReader

from accept.base.home import home
from accept.certificate import read_contents
from accept.certificate.trust import keys
from accept.fleet import golden
from accept.judging import load_spec
from accept.judging.reservations.nonconformance import decide
from accept.store import Store, open_store
from accept.store.decisions import DecisionError, Signer
from accept.store.payloads import CertificateSigned, Disposition, EntryUndone, NonconformanceDecided
from accept.workflow import certify
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.steps.unit_list import KnownUnit, known_unit
from accept.workflow.worker.judging import judge_whole_unit
from checks.declare import Measured
from tests.accept.workflow.test_workflow import fill, filled
from tests.shared.command_line import accept

WHY = "quality assurance is asked"
CRACKED = "stiffness: flexure cracked (Ann)"


@pytest.fixture
def store() -> Iterator[Store]:
    with open_store() as opened:
        yield opened


@pytest.fixture
def session(store: Store) -> Iterator[Session]:
    with filled(store) as opened:
        yield opened


def batch(folder: Path, out: Path) -> dict[str, object]:
    done = accept("batch", folder, "--spec", "apa-basic", "--out", out, "--operator", "Ann")
    (entry,) = json.loads((out / "results.json").read_text())["units"]
    return entry | {"exit": done.exit_code}


def test_the_unit_is_held_and_no_finding_is_spoiled(session: Session) -> None:
    """Each finding is a statement of conformity about what was measured; the unit as a whole is not accepted."""
    before = judge_whole_unit(session).findings
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    result = judge_whole_unit(session)
    assert (result.verdict, result.word, result.nonconformances) == ("conditional", "held", (CRACKED,))
    assert result.findings == before
    assert {f.verdict for f in result.findings} == {"pass"}


def test_a_plain_note_holds_nothing_and_can_be_undone(session: Session) -> None:
    session.entries.note("stiffness", "looks dusty")
    assert judge_whole_unit(session).verdict == "accepted"
    session.undo.entry()
    assert judge_whole_unit(session).verdict == "accepted"


def test_no_undo_releases_it(session: Session) -> None:
    """Not by the key, and not by an event that a script writes: a walk of a technician lifted a hold so, and signed."""
    noted = session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    with pytest.raises(EntryError, match="'flexure cracked' holds this unit"):
        session.undo.entry()
    assert judge_whole_unit(session).nonconformances == (CRACKED,)
    session.append(EntryUndone(noted.seq))
    assert list(session.judgements.nonconformances) == [CRACKED]
    assert judge_whole_unit(session).verdict == "conditional"
    session.close()
    again = open_session(session.store, home(), load_spec("apa-basic"), "Ben", "APA-02")
    assert list(again.judgements.nonconformances) == [CRACKED]
    again.close()


def test_an_incomplete_unit_is_called_held_too(session: Session, tmp_path: Path) -> None:
    """In the list of units, by the line on its serial, by batch and by verify; it was called incomplete alone."""
    step = session.step("stiffness")
    session.entries.remeasure(step.name, "slipped")
    specs = {"apa": session.spec}

    def known() -> KnownUnit:
        unit = known_unit(session.store, "APA-02", specs)
        assert unit is not None
        return unit

    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    assert known().words.startswith("attempt 1: held, ")
    assert judge_whole_unit(session).word == "held, incomplete"
    assert certify.Signing(session).sign("correct horse", WHY).valid
    assert known().state == "held, signed"
    assert known().words == "attempt 1: held, incomplete, signed"
    assert "APA-02 held, incomplete; signed by 'Ann'" in accept("verify", session.attempt.certificate).output
    done = accept("batch", session.folder, "--spec", "apa-basic", "--out", tmp_path / "out", "--operator", "Ann")
    assert "held, incomplete" in done.output


def test_a_failed_unit_stays_rejected(session: Session) -> None:
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    session.entries.take("stroke", session.step("stroke").check.inputs["stroke_um"], Measured(100.0))
    assert judge_whole_unit(session).verdict == "rejected"


def test_batch_and_report_by_store_and_by_folder(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the same serial in a folder without the note, by the store; and in a bench that knows only the folder."""
    shutil.copytree(judge_whole_unit(session) and session.folder, plain := tmp_path / "plain")
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    judge_whole_unit(session)
    for folder in (plain, session.folder):
        entry = batch(folder, tmp_path / "out")
        assert (entry["verdict"], entry["nonconformances"], entry["exit"]) == ("conditional", [CRACKED], 4)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "elsewhere"))
    assert batch(session.folder, tmp_path / "there")["verdict"] == "conditional"
    assert batch(plain, tmp_path / "there")["verdict"] == "conditional"  # known there by now
    report = accept("report", session.folder, "--spec", "apa-basic", "--out", tmp_path / "r.pdf", "--operator", "Ann")
    assert report.exit_code == 4, report.output


def test_certificate_and_verify_say_so(session: Session) -> None:
    """On page 1; a certificate from before the note is not plainly valid any more."""
    judge_whole_unit(session)
    before = judge_whole_unit(session) and certify.Signing(session).sign("correct horse")
    assert before.valid
    first = Path(str(session.attempt.certificate))
    kept = first.read_bytes()
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    first.with_name("kept.pdf").write_bytes(kept)
    assert accept("verify", first.with_name("kept.pdf")).exit_code == 4
    assert certify.Signing(session).sign("correct horse", WHY).valid
    pdf = Path(str(session.attempt.certificate))
    page = " ".join(PdfReader(pdf).pages[0].extract_text().split())
    assert f"Held by a nonconformance: {CRACKED}" in page
    done = accept("verify", pdf)
    assert (done.exit_code, "held" in done.stdout) == (0, True), done.output
    assert "HELD CONDITIONAL: QUALITY ASSURANCE DECIDES IN ITS BOX BELOW" in page
    assert "What to do" not in page
    assert accept("verify", pdf, "--require", "accepted").exit_code == 3


@pytest.mark.parametrize(("choice", "verdict"), [("rework", "accepted"), ("scrap", "conditional"), ("", "conditional")])
def test_the_next_attempt_follows_the_disposition(session: Session, choice: str, verdict: str) -> None:
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    certify.Signing(session).sign("correct horse", WHY)
    if choice:
        countersigned = certify.Signing(session).countersign("battery staple", choice, "seen under the lens")
        assert countersigned.valid
        assert judge_whole_unit(session).verdict == "conditional"  # what was signed stays as it is
        assert session.attempt.certificate is not None
    session.begin({}, "reworked")
    fill(session)
    result = judge_whole_unit(session)
    assert (result.verdict, result.nonconformances) == (verdict, () if choice == "rework" else (CRACKED,))


@pytest.mark.parametrize("note", [True, False])
def test_a_certificate_that_leaves_it_out_is_not_valid(session: Session, note: bool) -> None:
    """Judged again from the attached unit.toml, which has the note."""
    from dataclasses import replace

    from accept.certificate.verify import rejudge
    from accept.certificate.verify.result_diff import differences

    if note:
        session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    certify.Signing(session).sign("correct horse", WHY)
    contents = read_contents(Path(str(session.attempt.certificate)).read_bytes())
    forged = {key: value for key, value in contents.result.items() if key != "nonconformances"}
    forged["verdict"] = "accepted"
    again = rejudge.rejudge(replace(contents, result=forged))
    assert bool(differences(forged, again.to_json())) == note


def again(session: Session) -> str:
    """The verdict of another attempt."""
    session.begin({}, "measured again")
    fill(session)
    return str(judge_whole_unit(session).verdict)


def test_a_disposition_that_nobody_signed_releases_nothing(session: Session, store: Store) -> None:
    """Written into the store by a program of the insider's own: without a signature, with that of a technician, with
    that of another unit, and with one that counted before."""
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    certify.Signing(session).sign("correct horse", WHY)
    certify.Signing(session).countersign("battery staple", "return", "seen under the lens")
    session.refresh()
    last = store.latest("APA-02", CertificateSigned.KIND)
    assert last is not None
    told = last.data
    for signed in (None, told["disposition"]["signed"]):
        store.append(
            last.what,
            "APA-02",
            told | {"disposition": {"choice": "rework", "reason": "x", "signed": signed}},
            who="Quinn",
        )
    technician = keys.unlock(home(), "technician", "correct horse")
    with pytest.raises(DecisionError, match="not of quality assurance"):
        decide(store, "APA-02", Disposition("rework", "x"), lambda: Signer(technician.key, technician.certificate))
    assert again(session) == "conditional"


def test_quality_assurance_decides_without_a_certificate(
    session: Session, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A decision is signed, is about what holds the unit then, and counts once."""
    asked = ("store", "dispose", "APA-02", "--disposition", "rework", "--because", "polished")
    refused = accept(*asked)  # before anybody is asked for a passphrase
    assert (refused.exit_code, refused.stderr) == (6, "accept: APA-02: no nonconformance in the store holds it\n")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    assert again(session) == "conditional"
    done = accept(*asked)
    assert done.exit_code == 0, done.output
    assert again(session) == "accepted"
    assert "rework: polished" in accept("store", "log", "APA-02").stdout
    decided = store.latest("APA-02", NonconformanceDecided.KIND)
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    assert decided is not None
    store.append(decided.what, "APA-02", decided.data, who="Quinn")
    assert again(session) == "conditional"


def test_the_reason_of_a_decision_is_never_the_passphrase(
    session: Session, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would stand in the store and on the certificate in clear."""
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    judge_whole_unit(session)
    certify.Signing(session).sign("correct horse", WHY)
    monkeypatch.setattr(golden, "goldens", lambda *_: {"APA-02": None})  # so that there is something to decide
    monkeypatch.setattr(golden, "stopped_by", lambda *_: store.latest("APA-02", "unit_judged"))
    before, chosen = store.head().seq, ("--disposition", "rework", "--because", " battery staple")
    for asked in (
        ("store", "dispose", "APA-02", *chosen),
        ("store", "void", "APA-02", 1, "--reason", "battery staple"),
        ("golden", "retire", "APA-02", "--reason", "battery staple"),
        ("golden", "resolve", "--reason", "battery staple"),
        ("countersign", str(session.attempt.certificate), *chosen),
    ):
        done = accept(*asked)
        assert done.exit_code not in (0, 1, 2), done.output
        assert "the reason is the passphrase" in done.output
        assert "battery staple" not in done.output
    assert store.head().seq == before


def test_a_disposition_counts_once_however_its_signature_is_written(
    session: Session, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of an ECDSA signature (r, s), (r, n - s) holds too, and a PEM has more than one spelling."""
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    assert again(session) == "conditional"
    assert accept("store", "dispose", "APA-02", "--disposition", "rework", "--because", "polished").exit_code == 0
    session.entries.note("stiffness", "flexure cracked", nonconformance=True)
    event = store.latest("APA-02", NonconformanceDecided.KIND)
    assert event is not None
    decided = NonconformanceDecided.of(event)
    signed = decided.disposition.signed
    assert signed is not None
    r, s = decode_dss_signature(bytes.fromhex(signed.signature))
    n = 0xFFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551  # the order of P-256 [FIPS186-4]
    for other in (
        replace(signed, signature=encode_dss_signature(r, n - s).hex()),
        replace(signed, certificate=signed.certificate + "\n"),
    ):
        again_signed = replace(decided, disposition=replace(decided.disposition, signed=other))
        store.write(again_signed, "APA-02", who="Quinn")
        assert again(session) == "conditional"
