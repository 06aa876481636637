"""What a laboratory states on its certificates: read strictly, signed by the bench, verified, and named if missing."""

import json
from dataclasses import replace

import pytest

from accept.base.home import home
from accept.certificate import LABORATORY_FILE, laboratory_of, missing_statements, read_certificate, read_contents
from accept.certificate.contents.content import read
from accept.certificate.contents.laboratory import number_of, statement_of
from accept.certificate.contents.statements import changes_words, statements
from accept.certificate.page.clauses import entered_words, instruments_words, provided_words
from accept.certificate.trust import keys
from accept.store import Store, open_store
from accept.store.payloads import BenchStated, CertificateSigned
from accept.units import unit_folder
from specs.spec import load, parse
from specs.strict import SpecError
from tests.accept.certificate.verify.test_statements import PHRASE, accept, certified, forged, plainly, unit, verified

WHOLE = """
name = "Example Institute"
address = "Example Street 1, 12345 Town"
contact = "lab@example.org"
site = "Building 7"
accreditation = "not accredited"
customer = "Hexapod"
customer_contact = "Ms Example, tel. 12"
sampling = "every unit"
certificate_number = "EX-{year} {serial}/{attempt}"
[methods]
flatness = "WI-11, revision 2"
others = "WI-12, revision 3"
"""


def states(text: str) -> None:
    home().mkdir(parents=True, exist_ok=True)
    (home() / LABORATORY_FILE).write_text(text)


@pytest.fixture
def bench(monkeypatch):
    keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple")
    monkeypatch.setenv("ACCEPT_PASSPHRASE", PHRASE)
    states(WHOLE)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("nmae = 'x'", "nmae"),
        ("name = ''", "name"),
        ("name = 7", "name"),
        ("[methods]\nstrok = 'x'", "strok"),
        ("certificate_number = '{serial}'", "one number"),
        ("certificate_number = '{serial}{attempt}'", "one number"),
        ("certificate_number = '{serial}-{attempt}'", "one number"),  # 'A-1' with 12, 'A-1-1' with 2
        ("certificate_number = '{serial}/{attempt} {lot}'", "lot"),
        ("certificate_number = '{0}/{attempt}'", "0"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_its_key(text, word):
    states(text)
    with pytest.raises(SpecError, match=word):
        laboratory_of(home())


def test_what_is_not_stated_is_left_out():
    assert laboratory_of(home() / "elsewhere") is None
    states("name = 'Example'\n[methods]\nstroke = 'WI-1'")
    laboratory = laboratory_of(home())
    assert statement_of(laboratory, ["stroke", "flatness"]).to_json() == {
        "name": "Example",
        "methods": {"stroke": "WI-1"},
    }


def test_numbers_are_not_given_twice():
    scheme, taken = "{serial}/{attempt}", set()
    for _ in range(4):
        taken.add(number_of(scheme, "A-1", 1, 2026, taken))
    assert taken == {"A-1/1", "A-1/1-2", "A-1/1-3", "A-1/1-4"}


def test_missing_statements_are_named_by_clause(tmp_path):
    spec = load("apa-basic")
    assert {m.clause for m in missing_statements(None, spec)} == {f"7.8.2.1 {letter}" for letter in "bcdefk"}
    states(WHOLE)
    assert missing_statements(laboratory_of(home()), spec) == []
    folder = unit_folder.read(unit(tmp_path / "A-1", serial="A-1"))
    assert {m.clause for m in missing_statements(laboratory_of(home()), spec, folder)} == {
        "7.8.2.1 g", "7.8.2.1 h", "7.8.2.1 i", "7.8.3.1 a",
    }  # fmt: skip
    assert accept("spec", "check", "apa-basic").exit_code == 0
    assert accept("spec", "check", "apa-basic", "--iso17025").exit_code == 0
    states("name = 'Example'")
    done = accept("spec", "check", "apa-basic", "--iso17025")
    assert (done.exit_code, "7.8.2.1 f" in done.stdout, "7.8.2.1 b: name" in done.stdout) == (4, True, False)
    states("nmae = 'Example'")
    assert accept("spec", "check", "apa-basic", "--iso17025").exit_code == 6


@pytest.mark.slow
def test_certificates_state_the_laboratory_and_are_verified(bench, tmp_path):
    first = certified(tmp_path, "A-1", serial="A-1").rename(tmp_path / "first.pdf")
    assert plainly(verified(first))
    contents = read(read_contents(first.read_bytes()).attachments())
    said = statements(contents)
    assert (
        said["Laboratory"]
        == "Example Institute; Example Street 1, 12345 Town; lab@example.org; measured at Building 7; not accredited"
    )
    assert said["Methods"].startswith("WI-12, revision 3 (capacitance")
    assert said["Customer"] == "Hexapod; Ms Example, tel. 12"
    assert contents.provenance["number"].endswith(" A-1/1")
    assert "were entered without a recording" in entered_words(contents)
    assert said["Changed"] == ""
    second = certified(tmp_path, "A-1", serial="A-1", stroke=340.1)
    assert plainly(verified(second))
    contents = read(read_contents(second.read_bytes()).attachments())
    assert contents.provenance["number"].endswith(" A-1/2")
    assert "Stroke" in changes_words(contents)
    assert "Sensor" not in changes_words(contents)  # as before
    with open_store() as store:
        numbers = [CertificateSigned.of(e).number for e in store.events("A-1", CertificateSigned.KIND)]
    assert numbers == [f"EX-{n[3:7]} A-1/{i}" for i, n in enumerate(numbers, 1)]


@pytest.mark.slow
@pytest.mark.parametrize("field", ["laboratory", "number", "before"])
def test_a_statement_that_was_changed_is_found(bench, tmp_path, field):
    """By who holds the technician's key: the bench's signature does not cover it, and the store knows better."""
    certified(tmp_path, "A-1", serial="A-1")
    pdf = certified(tmp_path, "A-1", serial="A-1", stroke=362.1)
    contents = read(read_contents(pdf.read_bytes()).attachments())
    old = json.loads(json.dumps(contents.provenance[field]))
    new = {"laboratory": lambda: old | {"accreditation": "accredited"}, "number": lambda: "EX-1999 A-1/7",
           "before": lambda: old | {"stroke_um": {"value": 362.0, "U": 0.5}}}[field]()  # fmt: skip
    done = verified(forged(tmp_path / "f.pdf", replace(contents, provenance={**contents.provenance, field: new})))
    assert done.exit_code in (3, 4), done.output


@pytest.mark.slow
def test_a_wrong_file_stops_before_the_unit_is_judged(bench, tmp_path):
    states("nmae = 'x'")
    done = accept("report", unit(tmp_path / "A-1", serial="A-1"), "--spec", "apa-basic", "--out", tmp_path / "a.pdf")
    assert (done.exit_code, "laboratory.toml" in done.output) == (6, True), done.output
    with open_store() as store:
        assert store.latest("A-1", "unit_judged") is None


PROVIDED = """
[origin]
type = "APA300ML"
manufacturer = "Maker"
[provided]
stroke = "Measuring Ltd, D-K-00000"
capacitance = "customer"
"""


def test_what_others_provided_is_stated_and_verified(bench, tmp_path):
    """7.8.2.1 p and 7.8.2.2: by the customer, who answers for it, or by an external provider. In an order that is not
    that of the alphabet, as which the attachment has it: the page is drawn again from there."""
    folder = unit(tmp_path / "A-1", serial="A-1")
    (folder / "unit.toml").write_text((folder / "unit.toml").read_text() + PROVIDED)
    assert unit_folder.read(folder).header.provided == {"capacitance": "customer", "stroke": "Measuring Ltd, D-K-00000"}
    pdf = tmp_path / "a.pdf"
    accept("report", folder, "--spec", "apa-basic", "--out", pdf)
    words = provided_words(read_contents(read_certificate(pdf)).result)
    assert words == (
        "Capacitance by the customer, who answers for what it provided; "
        "Stroke by Measuring Ltd, D-K-00000, an external provider"
    )
    assert accept("verify", pdf).exit_code == 0


@pytest.mark.parametrize("line", ["capacitanse = 'customer'", "capacitance = ''", "capacitance = 7"])
def test_a_provider_of_nothing_is_refused(tmp_path, line):
    folder = unit(tmp_path / "A-1", serial="A-1")
    (folder / "unit.toml").write_text((folder / "unit.toml").read_text() + f"\n[provided]\n{line}\n")
    with pytest.raises(unit_folder.UnitError, match=r"\[provided\]"):
        unit_folder.read(folder)


def test_the_temperature_of_a_spec_with_a_coefficient_needs_its_U(tmp_path):
    text = load("apa-basic").text.replace("U_percent = 0.5", "U_percent = 0.5\npercent_per_C = 0.4")
    spec = parse(text.encode(), "apa with a coefficient")
    folder = unit(tmp_path / "A-1", serial="A-1")
    plain = (folder / "unit.toml").read_text()
    for stated, named in (("21.5", True), ("{ value = 21.5, U = 0.5 }", False)):
        (folder / "unit.toml").write_text(f"{plain}\n[environment]\ntemperature_C = {stated}\n")
        assert ("7.8.3.1 c" in {m.clause for m in missing_statements(None, spec, unit_folder.read(folder))}) is named


BENCH = """
name = "bench 1"
[instruments.lcr]
driver = "offline"
measures = ["capacitance"]
model = "LCR-819"
serial = "E9123456"
calibration = { certificate = "GW-2026-7", issuer = "Calibration Ltd", due = 2099-03-01 }
"""


def test_the_instruments_on_the_page_are_those_of_the_bench(bench, tmp_path):
    """The spec names an instrument too: one that was not used must not stand on the page."""
    (tmp_path / "bench.toml").write_text(BENCH)
    pdf = tmp_path / "a.pdf"
    folder = unit(tmp_path / "A-1", serial="A-1")
    accept("report", folder, "--spec", "apa-basic", "--out", pdf, "--bench", tmp_path / "bench.toml")
    contents = read_contents(read_certificate(pdf))
    words = instruments_words(contents)
    assert "Capacitance: LCR-819 E9123456" in words
    assert contents.instruments["capacitance"] not in words
    assert f"{contents.instruments['stroke']} (named by the spec)" in words
    assert any("GW-2026-7 of Calibration Ltd" in note for note in contents.result["notes"])
    assert accept("verify", pdf).exit_code in (0, 4)


@pytest.mark.slow
def test_a_file_that_is_written_meanwhile_makes_no_certificate_that_the_store_contradicts(bench, tmp_path, monkeypatch):
    """The file changes at the moment at which the bench stores what it states."""
    write = Store.write

    def changing(store, payload, subject="", **more):
        if isinstance(payload, BenchStated):
            states(WHOLE.replace("Example Institute", "Another Institute"))
        return write(store, payload, subject, **more)

    monkeypatch.setattr(Store, "write", changing)
    pdf = certified(tmp_path, "A-1", serial="A-1")
    contents = read(read_contents(pdf.read_bytes()).attachments())
    with open_store() as store:
        stated = [BenchStated.of(event) for event in store.events(what=BenchStated.KIND)][-1]
    assert contents.provenance["laboratory"]["name"] == stated.laboratory["name"]
    assert plainly(verified(pdf))
