"""A simulated unit is never taken for a measured one: on paper, in the results, by `accept verify`, with real keys."""

import csv
import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from pypdf import PdfReader
from typer.testing import Result

from accept.base.documents.results import SIMULATED
from accept.base.home import home
from accept.certificate import Validity, read_certificate, rejudge
from accept.certificate.trust import keys
from accept.commands.trust.verify import VerifyOptions, verifier
from accept.judging import load_spec
from accept.simulate.faults import KINDS
from accept.store import open_store
from accept.units import toml_edit, unit_folder
from accept.units.unit_folder import UnitError
from accept.workflow import certify
from accept.workflow.bench import Workbench
from accept.workflow.dialogue.begin import Begun
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.open_bench import BenchServices
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.training import open_training
from accept.workflow.worker.judging import judge_whole_unit
from specs.bench import load_bench
from tests.accept.certificate.verify.verify_help import verify
from tests.accept.units.units import GOOD, make_unit
from tests.accept.workflow.test_workflow import fill
from tests.shared.command_line import accept
from tests.shared.kept_folder import KeptFolder, kept

MARKED = GOOD.replace("[", "simulated = true\n[", 1)


def batch(folder: Path, out: Path, *more: object) -> Result:
    return accept("batch", folder, "--spec", "apa-basic", "--out", out, *more)


def shown(pdf: Path) -> list[str]:
    """Text of each page, blanks as one."""
    return [" ".join(page.extract_text().split()) for page in PdfReader(pdf).pages]


def judge_marked(place: Path) -> None:
    make_unit(place / "in" / "A-2", "A-2", MARKED)
    done = batch(place / "in", place / "out")
    assert (done.exit_code, SIMULATED in done.stdout, SIMULATED in done.stderr) == (0, True, True)


certified = kept(judge_marked)


@pytest.fixture
def certificate(certified: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> Path:
    return certified.put_back(monkeypatch) / "out" / "certificates" / "A-2.pdf"


def test_every_page_says_so(certificate: Path) -> None:
    pages = shown(certificate)
    assert all(SIMULATED in page for page in pages), pages
    assert "ACCEPTANCE CERTIFICATE" not in " ".join(pages)
    assert "measured and judged" not in " ".join(pages)
    info = PdfReader(certificate).metadata
    assert info is not None
    assert SIMULATED in str(info.title)


def test_results_of_the_batch_and_in_the_certificate_say_so(certificate: Path) -> None:
    out = certificate.parents[1]
    (unit,) = json.loads((out / "results.json").read_text())["units"]
    assert unit["simulated"] is True
    attached = PdfReader(certificate).attachments
    assert json.loads(attached["results.json"][0])["simulated"] is True
    rows = list(csv.DictReader((out / "results.csv").read_text(encoding="utf-8").splitlines()))
    assert {row["simulated"] for row in rows} == {"True"}
    suites = ET.parse(out / "junit.xml").getroot()
    assert [p.get("value") for p in suites.iter("property") if p.get("name") == "simulated"] == ["true"]


def test_results_of_a_measured_unit_are_as_before(tmp_path: Path) -> None:
    make_unit(tmp_path / "in" / "A-3", "A-3")
    batch(tmp_path / "in", tmp_path / "out")
    (unit,) = json.loads((tmp_path / "out" / "results.json").read_text())["units"]
    assert "simulated" not in unit
    pdf = tmp_path / "out" / "certificates" / "A-3.pdf"
    assert "SIMULATED" not in " ".join(shown(pdf))
    assert accept("verify", pdf).exit_code == 0


def test_verify_never_takes_it_for_an_acceptance(certificate: Path) -> None:
    done = accept("verify", certificate)
    assert done.exit_code == 4, done.output
    assert done.stdout.startswith(SIMULATED)
    assert accept("verify", certificate, "--require", "accepted").exit_code == 3
    document = json.loads(accept("verify", certificate, "--json", "-").stdout)
    assert (document["outcome"], document["simulated"], document["verdict"]) == ("signed", True, "accepted")
    report = verifier(VerifyOptions())(read_certificate(certificate))
    assert (report.outcome, report.simulated) == (Validity.SIGNED, True)


def test_quality_assurance_does_not_countersign_it(certificate: Path) -> None:
    before = certificate.read_bytes()
    done = accept("countersign", certificate)
    assert (done.exit_code, certificate.read_bytes() == before) == (4, True), done.output


def test_a_result_that_does_not_say_so_contradicts_its_folder(certificate: Path) -> None:
    """The mark is in unit.toml, which the certificate attaches and judges again."""

    def silent(contents):  # as another program would judge it
        again = rejudge(contents)
        return type(again)(**{**vars(again), "simulated": False})

    ca = keys.certificate_of(keys.folder(home()) / f"{keys.CA}.pem")
    report = verify(read_certificate(certificate), [ca], silent)
    assert report.outcome is Validity.NOT_VALID
    assert "simulated" in report.reason


@pytest.mark.parametrize("wrong", ['"no"', "0", "1"])
def test_a_mark_that_is_neither_true_nor_false_is_refused(tmp_path: Path, wrong: str) -> None:
    make_unit(tmp_path / "A", "A", GOOD.replace("[", f"simulated = {wrong}\n[", 1))
    with pytest.raises(UnitError, match="simulated"):
        unit_folder.read(tmp_path / "A")


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_simulated_unit_has_the_mark(tmp_path: Path, kind: str) -> None:
    words = ("--kind", kind, "--low-s", 3, "--high-s", 3, "--no-repeats", "--out", tmp_path / "U")
    assert accept("simulate", "unit", *words).exit_code == 0
    assert unit_folder.read(tmp_path / "U").header.simulated


def test_the_published_units_of_the_demo_are_measured(tmp_path: Path) -> None:
    from accept.simulate import published_units

    assert not any(unit_folder.read(path).header.simulated for path in published_units.write_units(tmp_path))


def trained(bench: Workbench, serial: str) -> Session:
    """A unit of a training with every value, whatever its serial looks like."""
    opened = bench.session(serial, "apa", "Ann")
    if opened.run.attempt is None:
        opened.begin({})
    fill(opened)
    return opened


@pytest.mark.slow
def test_a_training_marks_its_unit_and_signs_it_as_before(tmp_path: Path) -> None:
    """The bench's real keys sign no acceptance of its folder."""
    bench = open_training("apa-basic", 5)
    try:
        session = trained(bench, "A-2")
        keys.init(bench.home, "correct horse", "Ann", "Quinn", "battery staple")
        assert judge_whole_unit(session).simulated
        assert certify.Signing(session).sign("correct horse").valid  # for who trains
        assert certify.Signing(session).countersign("battery staple").valid
        pdf = Path(str(session.attempt.certificate))
        folder = session.folder
        session.close()
    finally:
        bench.close()
    assert all(SIMULATED in page for page in shown(pdf))
    named = accept("verify", pdf, "--trust", keys.folder(bench.home) / f"{keys.CA}.pem")
    assert (named.exit_code, named.stdout.startswith(SIMULATED)) == (4, True), named.output
    assert batch(folder, tmp_path / "out").exit_code == 0
    signed = tmp_path / "out" / "certificates" / "A-2.pdf"
    assert all(SIMULATED in page for page in shown(signed))
    assert accept("verify", signed).exit_code == 4


def test_a_unit_of_an_earlier_training_gets_the_mark_when_it_is_opened(tmp_path: Path) -> None:
    bench = open_training("apa-basic", 5)
    with_none = open_session(bench.store, bench.home, load_spec("apa-basic"), "Ann", "A-2")
    with_none.begin({})
    with_none.close()
    session = trained(bench, "A-2")
    assert judge_whole_unit(session).simulated
    session.close()
    bench.close()


def test_the_workflow_keeps_the_mark_of_a_folder(tmp_path: Path) -> None:
    """And takes nothing of a simulated unit into an attempt that is measured."""
    make_unit(tmp_path / "A-2", "A-2", MARKED)
    taken = unit_folder.read(tmp_path / "A-2")
    with open_store() as store:
        spec = load_spec("apa-basic")
        bench = Workbench(store, home(), {"apa": spec}, BenchServices(), taken=taken)
        session, _ = bench.open_unit(Begun("A-2", "apa", "Ann"))
        assert judge_whole_unit(session).simulated
        session.close()
        plain = Workbench(store, home(), {"apa": spec}, BenchServices())
        session, _ = plain.open_unit(Begun("A-2", "apa", "Ann"))
        assert judge_whole_unit(session).simulated  # the same attempt, without the folder
        session.close()
        session, _ = plain.open_unit(Begun("A-2", "apa", "Ann", reason="measured now"))
        assert not session.attempt.simulated
        session.close()
        session, problems = bench.open_unit(Begun("A-2", "apa", "Ann"))
        assert "simulated" in problems[0]
        assert not any(step.entries for step in session.attempt.steps.values())
        session.close()
        plain.close()
        bench.close()


SIMULATED_BENCH = """
name = "a simulated bench"
stage = "stage.json"
[instruments.lcr]
driver = "offline"
measures = ["capacitance"]
"""


def test_what_simulated_instruments_read_has_the_mark(tmp_path: Path) -> None:
    """At the real bench too; and they go into no attempt that is measured."""
    (tmp_path / "bench.toml").write_text(SIMULATED_BENCH)
    file, spec = load_bench(tmp_path / "bench.toml"), load_spec("apa-basic")
    assert file.simulated
    with open_store() as store:
        bench = Workbench(store, home(), {"apa": spec}, BenchServices(), stated=file)
        session, _ = bench.open_unit(Begun("A-5", "apa", "Ann"))
        assert judge_whole_unit(session).simulated
        session.close()
        plain = Workbench(store, home(), {"apa": spec}, BenchServices())
        session, _ = plain.open_unit(Begun("A-5", "apa", "Ann"))
        assert judge_whole_unit(session).simulated  # once read by them, the attempt stays theirs
        session.close()
        plain.open_unit(Begun("A-6", "apa", "Ann"))[0].close()
        with pytest.raises(EntryError):
            bench.open_unit(Begun("A-6", "apa", "Ann"))
        plain.close()
        bench.close()


def test_a_section_that_simulated_instruments_measured_marks_its_folder(tmp_path: Path) -> None:
    make_unit(tmp_path / "A-7", "A-7")
    toml_edit.enter(tmp_path / "A-7", "capacitance", {"sensor_uF": 5.0})
    assert not unit_folder.read(tmp_path / "A-7").header.simulated
    toml_edit.enter(tmp_path / "A-7", "capacitance", {"sensor_uF": 5.0}, simulated=True)
    assert unit_folder.read(tmp_path / "A-7").header.simulated
