"""A certificate with another result names the one that it replaces and says why; one that is wanted later is of the
attempt that was judged; two programs never state one number for two judgements."""

import json
import subprocess
import sys
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import pytest

from accept.base.home import home
from accept.batch.pipeline import Pipeline
from accept.batch.services import JudgingServices
from accept.certificate import DispositionError, read_contents
from accept.certificate.contents.statements import statements
from accept.certificate.trust import encrypted_key, keys
from accept.judging import load_spec
from accept.store import open_store
from accept.store import store as store_module
from accept.store.event import Overtaken
from accept.store.payloads import AttemptStarted, UnitJudged
from accept.units import unit_folder
from accept.workflow import certify
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.worker.judging import judge_whole_unit
from checks.declare import Measured
from specs.bench import load_bench
from tests.accept.units.units import GOOD, make_unit
from tests.accept.workflow.test_same_judgement import GIVEN
from tests.shared.command_line import accept

WHY = "the customer found a digit exchanged"
JUDGED = date(2026, 9, 25)
BENCH = """name = "bench 1"
[instruments.probe]
driver = "offline"
measures = ["capacitance", "flatness", "stroke", "stiffness"]
serial = "P1"
calibration = { certificate = "P-1", due = 2026-10-01 }
"""


@pytest.fixture(autouse=True)
def _bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encrypted_key, "ITERATIONS", 10)
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "correct horse")
    keys.init(home(), "correct horse", "Test Technician", "Grace", "battery staple")


def judged(serial: str) -> list[UnitJudged]:
    with open_store() as store:
        return [UnitJudged.of(event) for event in store.events(serial, UnitJudged.KIND)]


def test_a_batch_refuses_what_would_be_amended_without_a_reason_and_goes_on(tmp_path: Path) -> None:
    """Of four units two have changed; the others are as they were."""
    units, out = tmp_path / "units", tmp_path / "out"
    for n in range(4):
        make_unit(units / f"A-{n}", f"A-{n}")
    batch = ("batch", units, "--spec", "apa-basic", "--out", out, "--workers", 1)
    assert accept(*batch).exit_code == 0
    kept = (out / "certificates" / "A-1.pdf").read_bytes()
    for n in (1, 2):
        make_unit(units / f"A-{n}", f"A-{n}", GOOD.replace("5.10", f"5.0{n}"))
    make_unit(units / "A-9", "A-9")
    done = accept(*batch)
    assert done.exit_code == 4, done.output
    results = json.loads((out / "results.json").read_text())
    assert {u["serial"]: u["certificate"] for u in results["units"]} == {
        "A-0": "certificates/A-0.pdf", "A-1": None, "A-2": None, "A-3": "certificates/A-3.pdf",
        "A-9": "certificates/A-9.pdf",
    }  # fmt: skip
    assert [Path(r["path"]).name for r in results["refused"]] == ["A-1", "A-2"]
    assert "no reason was given why it is replaced: --reason" in results["refused"][0]["reason"]
    assert (out / "certificates" / "A-1.pdf").read_bytes() == kept
    assert accept("verify", out / "certificates" / "A-1.pdf").exit_code == 4  # a later attempt is stored
    done = accept(*batch, "--reason", WHY)
    assert done.exit_code == 0, done.output
    assert len(judged("A-1")) == 2
    pdf = out / "certificates" / "A-1.pdf"
    assert statements(read_contents(pdf.read_bytes()))["Amended"] == f"replaces certificate A-1/1: {WHY}"
    assert accept("verify", pdf, "--require", "accepted,current").exit_code == 0


def test_a_report_without_a_reason_says_what_is_missing(tmp_path: Path) -> None:
    for sensor in ("5.10", "5.11"):
        unit = make_unit(tmp_path / "u", "A-1", GOOD.replace("5.10", sensor))
        done = accept("report", unit, "--spec", "apa-basic", "--out", tmp_path / f"{sensor}.pdf")
    assert (done.exit_code, "certificate A-1/1 has another result" in done.stderr) == (6, True), done.output
    assert not (tmp_path / "5.11.pdf").exists()


def test_the_number_of_the_replaced_certificate_stands_on_the_page(tmp_path: Path) -> None:
    (home() / "laboratory.toml").write_text('name = "Lab"\ncertificate_number = "EX-{year} {serial}/{attempt}"\n')
    for sensor in ("5.10", "5.11"):
        unit, pdf = make_unit(tmp_path / "u", "A-1", GOOD.replace("5.10", sensor)), tmp_path / f"{sensor}.pdf"
        accept("report", unit, "--spec", "apa-basic", "--out", pdf, "--reason", WHY)
    year = datetime.now(UTC).year
    assert statements(read_contents(pdf.read_bytes()))["Amended"] == f"replaces certificate EX-{year} A-1/1: {WHY}"
    done = accept("verify", pdf)
    assert f"amended: replaces certificate EX-{year} A-1/1: {WHY}" in done.stderr
    assert WHY in accept("store", "log", "A-1").output


def test_the_same_data_need_no_reason_when_the_store_knows_more(tmp_path: Path) -> None:
    """A part that was judged since."""
    strut = 'serial = "S-1"\nkind = "apa"\n[parts]\napa = "X-1"\n'
    unit = make_unit(tmp_path / "S-1", "S-1", strut + GOOD[GOOD.index("[flatness]") :])
    words = ("report", unit, "--spec", "apa-basic", "--out")
    assert accept(*words, tmp_path / "1.pdf").exit_code == 0
    bad = make_unit(tmp_path / "X-1", "X-1", GOOD.replace("5.10", "1.72"))
    accept("batch", bad, "--spec", "apa-basic", "--out", tmp_path / "out", "--no-certificates")
    assert accept(*words, tmp_path / "2.pdf").exit_code == 4
    assert "the same data" in statements(read_contents((tmp_path / "2.pdf").read_bytes()))["Amended"]


def pipeline(store: store_module.Store, bench: Path, on: date, *, signs: bool) -> Pipeline:
    credential = keys.unlock(home(), keys.TECHNICIAN, "correct horse") if signs else None
    specs = {"apa": load_spec("apa-basic")}
    services = JudgingServices(store, "Test Technician", credential)
    return Pipeline(store, specs, "Test Technician", services, bench_file=load_bench(bench), on=on)


def settled(bench: Path, folder: Path, on: date, certificate: Path | None) -> str:
    unit = unit_folder.read(folder)
    with open_store() as store:
        made = pipeline(store, bench, on, signs=certificate is not None)
        job = made.prepare(unit, made.ask(unit), certificate)
        return str(made.settle(job, job.judge()).result.verdict)


def test_a_certificate_of_a_later_day_is_of_the_day_of_the_judgement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twelve days later a calibration has expired: the judgement stands, and the certificate says of which day."""
    bench, unit = tmp_path / "bench.toml", make_unit(tmp_path / "A-1", "A-1")
    bench.write_text(BENCH)

    class Then(datetime):
        @classmethod
        def now(cls, tz: object = None) -> datetime:  # type: ignore[override]
            return datetime(JUDGED.year, JUDGED.month, JUDGED.day, 9, tzinfo=UTC)

    with monkeypatch.context() as earlier:
        earlier.setattr(store_module, "datetime", Then)
        assert settled(bench, unit, JUDGED, None) == "accepted"
    pdf = tmp_path / "a.pdf"
    assert settled(bench, unit, JUDGED + timedelta(days=12), pdf) == "accepted"
    assert len(judged("A-1")) == 1
    said = statements(read_contents(pdf.read_bytes()))
    assert said["Attempt"] == "1, judged on 2026-09-25"
    assert said["Calibration"] == "bench file bench 1 of 2026-09-25: 4 instruments, all valid"
    done = accept("verify", pdf, "--require", "current")
    assert "attempt: 1, judged on 2026-09-25" in done.stderr
    assert "as in this bench's store" in done.stderr
    again = settled(bench, unit, JUDGED + timedelta(days=13), tmp_path / "b.pdf")
    assert again == "conditional"  # it is judged anew, and the calibration has expired
    assert len(judged("A-1")) == 2


TWO = """
import sys
from pathlib import Path
from accept.base.home import home
from accept.batch.pipeline import Pipeline
from accept.batch.services import JudgingServices
from accept.certificate.trust import keys
from accept.judging import load_spec
from accept.store import open_store
from accept.units import unit_folder
folder, pdf = map(Path, sys.argv[1:])
unit, credential = unit_folder.read(folder), keys.unlock(home(), keys.TECHNICIAN, "correct horse")
with open_store() as store:
    specs, why = {"apa": load_spec("apa-basic")}, "judged twice"
    made = Pipeline(
        store, specs, "Test Technician", JudgingServices(store, "Test Technician", credential), reason=why
    )
    job = made.prepare(unit, made.ask(unit), pdf)
    judgement = job.judge()
    print("ready", flush=True)
    sys.stdin.readline()
    made.settle(job, judgement)
"""


def test_two_programs_at_once_have_an_attempt_each(tmp_path: Path) -> None:
    """Both have asked the store before either has stored its verdict."""
    with open_store():
        pass
    running = []
    for name, text in (("good", GOOD), ("bad", GOOD.replace("5.10", "1.72"))):
        unit = make_unit(tmp_path / name, "A-1", text)
        order = [sys.executable, "-c", TWO, str(unit), str(tmp_path / f"{name}.pdf")]
        running.append(subprocess.Popen(order, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
    for one in running:
        assert one.stdout is not None
        assert one.stdout.readline() == "ready\n"
    for one in running:
        assert one.stdin is not None
        one.stdin.write("\n")
        one.stdin.flush()
    for one in running:
        one.communicate(timeout=120)
        assert one.returncode == 0
    pdfs = [tmp_path / "good.pdf", tmp_path / "bad.pdf"]
    stated = [read_contents(pdf.read_bytes()).provenance["attempt"] for pdf in pdfs]
    assert sorted(stated) == [1, 2]
    done = {attempt: accept("verify", pdf) for attempt, pdf in zip(stated, pdfs, strict=True)}
    assert done[2].exit_code == 0, done[2].output
    assert (done[1].exit_code, "a later attempt" in done[1].stdout) == (4, True), done[1].output


def take(session: Session) -> None:
    """Type the values of a good unit."""
    for step, inputs in GIVEN.items():
        for name, values in inputs.items():
            for index, value in enumerate(values):
                at = index if len(values) > 1 else None
                session.entries.take(step, session.step(step).check.inputs[name], Measured(float(value)), index=at)


def test_in_the_workflow_another_certificate_of_the_attempt_needs_its_reason() -> None:
    """A value is corrected after it was signed. A new attempt has the reason that it was begun for."""
    with open_store() as store:
        session = open_session(store, home(), load_spec("apa-basic"), "Test Technician", "APA-02")
        session.begin({})
        take(session)
        certify.Signing(session).sign("correct horse")
        assert certify.Signing(session).reason_problem("", ()) == ""  # nothing is replaced
        session.entries.take("stroke", session.step("stroke").check.inputs["stroke_um"], Measured(366.5))
        judge_whole_unit(session)
        assert "replace certificate APA-02/1" in certify.Signing(session).reason_problem("", ())
        with pytest.raises(DispositionError, match="replacing certificate APA-02/1"):
            certify.Signing(session).sign("correct horse")
        assert certify.Signing(session).sign("correct horse", WHY).current
        pdf = Path(str(session.attempt.certificate))
        assert statements(read_contents(pdf.read_bytes()))["Amended"] == f"replaces certificate APA-02/1: {WHY}"
        session.close()


def test_a_session_that_was_left_open_signs_as_of_the_day_of_judging(tmp_path: Path) -> None:
    (tmp_path / "bench.toml").write_text(BENCH.replace("2026-10-01", "2126-10-01"))
    ago = datetime.now(UTC) - timedelta(days=9)
    with open_store() as store:
        stated = load_bench(tmp_path / "bench.toml")
        session = open_session(store, home(), load_spec("apa-basic"), "Test Technician", "APA-02", stated)
        with pytest.MonkeyPatch.context() as earlier:
            clock = type("Clock", (datetime,), {"now": classmethod(lambda *_: ago)})
            earlier.setattr("accept.batch.pipeline.datetime", clock)
            earlier.setattr(store_module, "datetime", clock)
            session.begin({})
            take(session)
            judge_whole_unit(session)
        found = certify.Signing(session).sign("correct horse")
        pdf = Path(str(session.attempt.certificate))
        session.close()
    assert found.valid, found.reason
    assert statements(read_contents(pdf.read_bytes()))["Attempt"] == f"1, judged on {ago:%Y-%m-%d}"


def test_nothing_is_stored_after_an_event_that_was_not_read() -> None:
    with open_store() as store:
        first = store.write(AttemptStarted(1, "apa", {}, ""), "A-1", who="Ada", after=0)
        store.write(AttemptStarted(1, "apa", {}, ""), "B-1", who="Ada")
        with pytest.raises(Overtaken, match="event 1"):
            store.write(AttemptStarted(1, "apa", {}, ""), "A-1", who="Ada", after=0)
        store.write(AttemptStarted(2, "apa", {}, "worn"), "A-1", who="Ada", after=first.seq)
        assert [event.seq for event in store.events("A-1")] == [1, 3]
        assert store.check() is None
