"""The workflow without screens: events, their fold, the unit's folder, judging, signing."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader

from accept.base.home import home
from accept.certificate import DispositionError, SigningRefused, Verification, read_contents
from accept.certificate.trust import keys
from accept.fleet import golden
from accept.judging import load_spec
from accept.store import Store, open_store
from accept.store.decisions import Signer
from accept.store.payloads import CertificateSigned, EntryUndone, GoldenMissed, UnitJudged
from accept.units import unit_folder
from accept.workflow import certify
from accept.workflow.entry.parse_entry import EntryError, parse_number
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.session.unit import UnitBusy
from accept.workflow.state.unit_state import fold_run
from accept.workflow.steps.status import Status
from accept.workflow.worker.judging import Elsewhere, judge_here, judge_step, judge_whole_unit
from accept.workflow.worker.not_done import NotDone
from accept.workflow.worker.process import WorkerProcess
from checks.declare import Measured
from tests.shared.record_files import write_csv

REASON = "only the stroke was wanted"
HEIGHTS = (0, -2.5, -3, 0, -1.5, 1, -2, -4)  # APA 2 of [STB] 2.1.2


@pytest.fixture
def store():
    with open_store() as opened:
        yield opened


@contextmanager
def begun(store: Store, spec: str = "apa-basic") -> Iterator[Session]:
    opened = open_session(store, home(), load_spec(spec), "Ann", "APA-02")
    opened.begin({})
    yield opened
    opened.close()


@contextmanager
def filled(store: Store) -> Iterator[Session]:
    """Every value of a unit is entered, at a bench with keys."""
    keys.init(home(), "correct horse", "Ann", "Quinn", "battery staple")
    with begun(store) as opened:
        fill(opened)
        yield opened


@pytest.fixture
def session(store: Store):
    with begun(store) as opened:
        yield opened


def declared(session: Session, step: str, name: str):
    return session.step(step).check.inputs[name]


def take(session: Session, step: str, name: str, value: float, **more):
    return session.entries.take(step, declared(session, step, name), Measured(value), **more)


def fill(session: Session, k: float = 1.75) -> None:
    for index, z in enumerate(HEIGHTS):
        take(session, "flatness", "z_um", z, index=index)
    for step, name, value in (
        ("capacitance", "sensor_uF", 4.99),
        ("capacitance", "actuator_uF", 9.85),
        ("stroke", "stroke_um", 365.5),
        ("stiffness", "k_N_per_um", k),
    ):
        take(session, step, name, value)


def test_a_unit_from_first_entry_to_verified_certificate(session: Session):
    certify.trust.init(session.home, "correct horse", "Ann", "Quinn", "battery staple")
    fill(session)
    assert judge_whole_unit(session).verdict == "accepted"
    report = certify.Signing(session).sign("correct horse")
    assert report.valid
    assert not report.countersigned
    assert certify.Signing(session).countersign("battery staple").countersigned
    assert [s.role for s in session.attempt.signatures] == ["technician", "qa"]
    assert session.store.check() is None


@pytest.fixture
def signed(session: Session) -> Path:
    """An accepted certificate, which the technician has signed."""
    certify.trust.init(session.home, "correct horse", "Ann", "Quinn", "battery staple")
    fill(session)
    assert judge_whole_unit(session).verdict == "accepted"
    assert certify.Signing(session).sign("correct horse").valid
    return Path(session.attempt.certificate)


def another_certificate(session: Session) -> bytes:
    """The valid one of another unit of this bench."""
    other = open_session(session.store, session.home, session.spec, "Ann", "APA-03")
    other.begin({})
    fill(other, 1.71)
    assert judge_whole_unit(other).verdict == "accepted"
    assert certify.Signing(other).sign("correct horse").valid
    other.close()
    return Path(other.attempt.certificate).read_bytes()


def meanwhile(monkeypatch: pytest.MonkeyPatch, happens: Callable[[], object]) -> None:
    """Something happens once, just after the certificate was verified."""
    verify = certify._verify

    def followed(*given: object) -> Verification:
        report = verify(*given)
        monkeypatch.setattr(certify, "_verify", verify)
        happens()
        return report

    monkeypatch.setattr(certify, "_verify", followed)


def countersignatures(store: Store, serial: str) -> list[CertificateSigned]:
    events = store.events(serial, CertificateSigned.KIND)
    return [given for given in map(CertificateSigned.of, events) if given.role == "qa"]


def test_only_the_certificate_that_the_technician_signed_is_countersigned(session: Session, signed: Path) -> None:
    other = another_certificate(session)
    signed.write_bytes(other)
    with pytest.raises(SigningRefused, match="not the certificate of APA-02 that the technician signed"):
        certify.Signing(session).countersign("battery staple")
    assert signed.read_bytes() == other
    assert countersignatures(session.store, "APA-02") == []


def test_what_was_verified_is_what_is_countersigned(
    session: Session, signed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine, other = signed.read_bytes(), another_certificate(session)
    meanwhile(monkeypatch, lambda: signed.write_bytes(other))
    report = certify.Signing(session).countersign("battery staple")
    assert (report.serial, report.countersigned) == ("APA-02", True)
    assert signed.read_bytes().startswith(mine)


def test_a_unit_that_is_judged_meanwhile_is_not_countersigned(
    session: Session, signed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = signed.read_bytes()
    judged = UnitJudged.of(session.store.latest("APA-02", UnitJudged.KIND))
    meanwhile(monkeypatch, lambda: session.store.write(judged, "APA-02", who="Bob"))
    with pytest.raises(SigningRefused, match="APA-02: its history went on while the certificate"):
        certify.Signing(session).countersign("battery staple")
    assert signed.read_bytes() == mine
    assert countersignatures(session.store, "APA-02") == []


def test_a_unit_that_is_not_accepted_is_signed_with_a_reason_only(session: Session):
    certify.trust.init(session.home, "correct horse", "Ann", "Quinn", "battery staple")
    take(session, "stroke", "stroke_um", 365.5)
    assert judge_whole_unit(session).verdict == "incomplete"
    for nothing in ("", "  ", "x" * 121):
        with pytest.raises(DispositionError):
            certify.Signing(session).sign("correct horse", nothing)
    assert session.attempt.certificate is None
    report = certify.Signing(session).sign("correct horse", "only the  stroke was wanted")
    assert report.valid
    assert CertificateSigned.of(session.store.latest(session.serial, CertificateSigned.KIND)).reason == REASON
    pdf = Path(session.attempt.certificate)
    assert read_contents(pdf.read_bytes()).provenance["signed_because"] == REASON
    assert REASON in " ".join(PdfReader(pdf).pages[0].extract_text().split())
    assert certify.Signing(session).countersign("battery staple", "use-as-is", "for a trial").countersigned


def test_nothing_is_signed_without_the_passphrase(session: Session):
    certify.Signing(session).make_keys("correct horse")
    fill(session)
    for wrong in ("", "wrong"):
        with pytest.raises(certify.trust.KeysError):
            certify.Signing(session).sign(wrong)
    assert session.attempt.certificate is None
    assert not list(session.store.events(what="certificate_signed"))


def test_folder_holds_what_the_state_holds(session: Session, tmp_path: Path):
    write_csv(tmp_path / "heights.csv", {"x_mm": np.arange(4.0), "y_mm": np.arange(4.0) ** 2, "z_um": np.zeros(4)})
    session.records.link("flatness", declared(session, "flatness", "points"), tmp_path / "heights.csv")
    take(session, "capacitance", "sensor_uF", 4.99)
    judge_step(session, "capacitance")
    read = unit_folder.read(session.folder)
    assert read.sections["flatness"].files == ["heights.csv"]
    assert read.sections["capacitance"].entries["sensor_uF"] == Measured(4.99)
    assert (session.folder / "heights.csv").read_bytes() == (tmp_path / "heights.csv").read_bytes()


def test_another_file_of_the_same_name_does_not_replace_the_first(session: Session, tmp_path: Path):
    points = declared(session, "flatness", "points")
    for height in (0.0, 1.0):
        columns = {"x_mm": np.arange(4.0), "y_mm": np.arange(4.0) ** 2, "z_um": np.full(4, height)}
        write_csv(tmp_path / "heights.csv", columns)
        session.records.link("flatness", points, tmp_path / "heights.csv")
    link = session.state("flatness").link("points")
    assert link is not None
    assert link.file == "heights-2.csv"
    assert (session.folder / "heights.csv").is_file()


def test_undo_is_an_event_and_brings_back_what_was_before(session: Session):
    before = len(list(session.store.events("APA-02")))
    take(session, "capacitance", "sensor_uF", 4.99)
    take(session, "capacitance", "sensor_uF", 5.99)
    session.undo.entry()
    assert [r.value for r in session.state("capacitance").readings("sensor_uF")] == [4.99]
    session.undo.entry()
    assert session.judgements.status(session.step("capacitance")) is Status.NOT_DONE
    with pytest.raises(EntryError):
        session.undo.entry()
    assert len(list(session.store.events("APA-02"))) == before + 4  # two entries, two undos: nothing was erased


def test_remeasuring_keeps_earlier_values_and_undo_brings_them_back(session: Session):
    take(session, "stroke", "stroke_um", 365.5)
    judge_step(session, "stroke")
    session.entries.remeasure("stroke", "gauge was loose")
    assert session.judgements.status(session.step("stroke")) is Status.NOT_DONE
    assert [e.value for e in session.state("stroke").earlier] == [365.5]
    assert session.state("stroke").reasons == ("gauge was loose",)
    session.undo.entry()
    assert (
        session.judgements.status(session.step("stroke")) is Status.PASS
    )  # the judgement of the same entries holds again


def test_a_reason_and_a_note_must_say_something(session: Session):
    for empty in ("", "  \n "):
        with pytest.raises(EntryError):
            session.entries.remeasure("stroke", empty)
        with pytest.raises(EntryError):
            session.entries.note("stroke", empty)


def test_repeats_are_averaged_and_their_scatter_adds_to_the_stated_uncertainty(session: Session):
    for value, repeat in ((4.9, False), (5.0, True), (5.1, True)):
        take(session, "capacitance", "sensor_uF", value, repeat=repeat)
    take(session, "capacitance", "actuator_uF", 9.85)
    finding = judge_step(session, "capacitance").findings[0]
    stated, scatter = 0.005 * 5.0, 0.1  # the spec's half percent; standard deviation of 4.9, 5.0, 5.1
    assert finding.value == pytest.approx(5.0, rel=1e-12)
    assert finding.U == pytest.approx(np.hypot(stated, 2 * scatter / np.sqrt(3)), rel=1e-12)


def test_a_correction_replaces_the_repeats(session: Session):
    take(session, "stroke", "stroke_um", 300.0)
    take(session, "stroke", "stroke_um", 302.0, repeat=True)
    take(session, "stroke", "stroke_um", 365.5)
    assert [r.value for r in session.state("stroke").readings("stroke_um")] == [365.5]


def test_state_is_the_same_after_a_restart(session: Session, store: Store):
    fill(session)
    judge_step(session, "stroke")
    session.entries.note("stroke", "smells burnt", nonconformance=True)
    session.close()
    again = open_session(store, home(), session.spec, "Bob", "APA-02")
    assert again.run == session.run
    assert (
        again.judgements.status(again.step("stroke")) is Status.HELD
    )  # by the nonconformance; the stroke itself passes
    again.close()


def test_a_new_attempt_leaves_the_old_one_alone(session: Session):
    fill(session)
    old = session.attempt
    session.begin({}, "dropped on the floor")
    assert session.run.attempts[0] == old
    assert session.attempt.number == 2
    assert session.attempt.reason == "dropped on the floor"
    assert session.folder.name == "attempt-2"
    assert all(session.judgements.status(step) is Status.NOT_DONE for step in session.steps)


def test_a_bench_that_missed_its_golden_units_stores_no_verdict(session: Session, store: Store):
    fill(session)
    store.write(GoldenMissed(("GOLD",), {"GOLD": ("stroke_um moved",)}), who="Ann")
    with pytest.raises(golden.BenchStopped, match="not judged, because the bench missed its golden units"):
        judge_whole_unit(session)
    assert session.attempt.verdict is None
    keys.init(home(), "correct horse", "Bob", "Grace", "battery staple")
    qa = keys.unlock(home(), "qa", "battery staple")
    golden.resolve(store, "the probe was loose", lambda: Signer(qa.key, qa.certificate))
    assert judge_whole_unit(session).verdict == "accepted"


def test_an_entry_after_the_verdict_makes_it_stale(session: Session):
    fill(session)
    judge_whole_unit(session)
    assert session.attempt.verdict == "accepted"
    take(session, "stroke", "stroke_um", 100.0)
    assert session.attempt.verdict is None
    assert session.judgements.result is None
    judge_whole_unit(session)
    assert session.attempt.verdict == "rejected"
    session.undo.entry()
    assert session.attempt.verdict is None


def test_a_certificate_holds_as_long_as_the_same_is_found_again(session: Session, store: Store):
    """After a restart the summary judges once more: what was signed stays signed, unless something else is found."""
    certify.Signing(session).make_keys("correct horse")
    fill(session)
    judge_whole_unit(session)
    certify.Signing(session).sign("correct horse")
    signed = session.attempt.certificate
    assert signed is not None
    session.close()
    again = open_session(store, home(), session.spec, "Ann", "APA-02")
    judge_whole_unit(again)
    assert again.attempt.certificate == signed
    take(again, "stroke", "stroke_um", 364.0)
    judge_whole_unit(again)
    assert again.attempt.verdict == "accepted"
    assert again.attempt.certificate is None
    again.close()


def test_a_step_that_lacks_something_it_can_do_without_stands_until_it_was_judged(store: Store, tmp_path: Path):
    session = open_session(store, home(), load_spec("apa"), "Ann", "APA-03")
    session.begin({})
    session.steps = tuple(step for step in session.steps if step.name in ("sensor_highpass", "frf"))
    assert session.judgements.next_step() is session.steps[0]
    t = np.arange(0.0, 2.0, 0.01)
    write_csv(tmp_path / "sweep.csv", {"t": t, "Va": np.sin(t), "Vs": np.sin(t)})
    with_resistor = session.steps[0].check.inputs["with_resistor"]
    session.records.link("sensor_highpass", with_resistor, tmp_path / "sweep.csv")
    assert session.judgements.next_step() is session.steps[0]  # the sweep without the resistor may still come
    judge_step(session, "sensor_highpass")
    assert session.judgements.status(session.steps[0]) is Status.NO_RESULT  # a loopback is no high-pass
    assert session.judgements.next_step() is session.steps[0]
    session.close()


def test_a_batch_over_another_folder_is_no_verdict_of_the_attempt(session: Session, store: Store):
    fill(session)
    result = {"serial": "APA-02", "kind": "apa", "verdict": "accepted", "findings": []}
    payload = {"path": "/elsewhere/APA-02", "inputs": {}, "spec_sha256": "", "code_sha256": "", "result": result}
    store.append("unit_judged", "APA-02", payload, who="batch")
    assert session.refresh().attempt.verdict is None


def test_a_second_program_at_the_same_unit_is_refused(session: Session, store: Store):
    with pytest.raises(UnitBusy, match="APA-02"):
        open_session(store, home(), session.spec, "Bob", "APA-02")
    session.close()
    open_session(store, home(), session.spec, "Bob", "APA-02").close()


def test_serials_must_fit(store: Store):
    for wrong in ("", "../x", "a b", "-x", "x" * 65):
        with pytest.raises(EntryError):
            open_session(store, home(), load_spec("apa"), "Ann", wrong)


def test_every_undoable_prefix_folds(session: Session):
    """After any number of events the fold is theirs alone: a kill anywhere leaves a state to go on from."""
    fill(session)
    session.entries.remeasure("stroke", "why not")
    session.undo.entry()
    events = list(session.store.events("APA-02"))
    for length in range(1, len(events) + 1):
        run = fold_run("APA-02", events[:length])
        assert run.seq == events[length - 1].seq
    assert events[-1].what == EntryUndone.KIND


@pytest.mark.parametrize(
    ("text", "unit_name", "value"),
    [
        ("4.99 uF", "uF", 4.99),
        ("4,99", "uF", 4.99),
        ("4.99uF", "uF", 4.99),
        ("4990 nF", "uF", 4.99),
        ("4.99 µF", "uF", 4.99),
        ("0.3655 mm", "um", 365.5),
        ("1.7 N/µm", "N/um", 1.7),
        ("1.7e6 N/m", "N/um", 1.7),
        ("80.6 kΩ", "ohm", 80600.0),
        ("6400 g", "kg", 6.4),
        ("-2.5", "um", -2.5),
        (" 12 %", "percent", 12.0),
    ],
)
def test_typed_values(text: str, unit_name: str, value: float):
    assert parse_number(text, unit_name).value == pytest.approx(value, rel=1e-12)  # one multiplication of doubles


def test_typed_uncertainty():
    assert parse_number("4.99 ± 0.02 uF", "uF") == Measured(4.99, 0.02)
    assert parse_number("4,99 +/- 0,02", "uF") == Measured(4.99, 0.02)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "abc",
        "4.99 V",
        "4.9.9",
        "1,234.5",
        "nan",
        "inf",
        "1e999",
        "--4",
        "4.99 uF uF",
        "4.99 ± 0",
        "٤",
        "9" * 99,
    ],
)
def test_nonsense_is_refused_with_a_reason(text: str):
    with pytest.raises(EntryError, match=r"Example|enter|use|expected|above zero"):
        parse_number(text, "uF")


def test_a_step_judged_while_the_unit_is_does_not_take_the_result_away(session: Session):
    fill(session)

    def slowly(folder, spec, stated):
        judge_step(session, "flatness")
        return judge_here(folder, spec, stated)

    assert judge_whole_unit(session, slowly) is session.judgements.result


def test_a_computation_that_is_stopped_before_its_work_begins_does_not_begin(session: Session, monkeypatch):
    fill(session)
    worker = WorkerProcess()
    monkeypatch.setattr(worker, "_started", None)  # no process is asked for
    computation = Elsewhere(worker, session)
    computation.cancel()  # Escape, while the folder is written or another computation has its turn
    with pytest.raises(NotDone, match="stopped"):
        computation.judge()
    assert session.judgements.result is None


def test_an_entry_made_while_the_unit_is_judged_asks_for_another_judgement(session: Session):
    fill(session)

    def slowly(folder, spec, stated):
        result = judge_here(folder, spec, stated)
        take(session, "capacitance", "sensor_uF", 1.0)
        return result

    assert judge_whole_unit(session, slowly).verdict == "accepted"
    assert session.judgements.result is None
    assert judge_whole_unit(session).verdict == "rejected"
