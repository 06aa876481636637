"""What a laboratory states on its certificates: read strictly, signed by the bench, verified, and named if missing."""

import json
from dataclasses import replace

import pytest

from accept.base.home import home
from accept.certificate.contents.content import read
from accept.certificate.contents.iso17025 import missing
from accept.certificate.contents.laboratory import FILE, laboratory_of, number_of, statement_of
from accept.certificate.contents.statements import changes_words, statements
from accept.certificate.page.clauses import entered_words
from accept.certificate.trust import keys
from accept.certificate.verify import attachments
from accept.store import open_store
from accept.store.payloads import CertificateSigned
from accept.units import unit_folder
from specs.spec import load
from specs.strict import SpecError
from tests.accept.certificate.verify.test_statements import PHRASE, accept, certified, forged, plainly, unit, verified

WHOLE = """
name = "Example Institute"
address = "Example Street 1, 12345 Town"
site = "Building 7"
accreditation = "not accredited"
customer = "Hexapod"
certificate_number = "EX-{year} {serial}/{attempt}"
[methods]
flatness = "WI-11, revision 2"
others = "WI-12, revision 3"
"""


def states(text: str) -> None:
    home().mkdir(parents=True, exist_ok=True)
    (home() / FILE).write_text(text)


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
    assert statement_of(laboratory, ["stroke", "flatness"]) == {"name": "Example", "methods": {"stroke": "WI-1"}}


def test_numbers_are_not_given_twice():
    scheme, taken = "{serial}/{attempt}", set()
    for _ in range(4):
        taken.add(number_of(scheme, "A-1", 1, 2026, taken))
    assert taken == {"A-1/1", "A-1/1-2", "A-1/1-3", "A-1/1-4"}


def test_missing_statements_are_named_by_clause(tmp_path):
    spec = load("apa-basic")
    assert {m.clause for m in missing(None, spec)} == {f"7.8.2.1 {letter}" for letter in "bcdef"}
    states(WHOLE)
    assert missing(laboratory_of(home()), spec) == []
    folder = unit_folder.read(unit(tmp_path / "A-1", serial="A-1"))
    assert {m.clause for m in missing(laboratory_of(home()), spec, folder)} == {
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
    contents = read(attachments.read(first.read_bytes()).attachments())
    said = statements(contents)
    assert (
        said["Laboratory"] == "Example Institute; Example Street 1, 12345 Town; measured at Building 7; not accredited"
    )
    assert said["Methods"].startswith("WI-12, revision 3 (capacitance")
    assert said["Customer"] == "Hexapod"
    assert contents.provenance["number"].endswith(" A-1/1")
    assert "were entered without a recording" in entered_words(contents)
    assert said["Changed"] == ""
    second = certified(tmp_path, "A-1", serial="A-1", stroke=340.1)
    assert plainly(verified(second))
    contents = read(attachments.read(second.read_bytes()).attachments())
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
    contents = read(attachments.read(pdf.read_bytes()).attachments())
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
