"""What a report must state beside its results: as far as the unit's folder states it, and nothing invented."""

import io
from dataclasses import replace
from pathlib import Path

import pytest
from pypdf import PdfReader

from accept.certificate import CertificateContent
from accept.certificate.page.clauses import (
    COVERAGE,
    SCOPE,
    days_words,
    entered_words,
    environment_words,
    item_words,
    operator_words,
    rule_words,
)
from accept.certificate.page.document import render
from accept.units.unit_folder import UNIT_FILE
from tests.accept.certificate.certificate_help import certificate_contents


def finding(check: str, rule: str = "guarded", value: float | None = 1.0) -> dict[str, object]:
    return {"check": check, "rule": rule, "value": value}


def test_days_are_a_span_and_checks_without_a_day_are_named():
    result = {
        "measured": {"flatness": "2026-10-20", "capacitance": "2026-10-13"},
        "findings": [finding("flatness"), finding("capacitance"), finding("stroke"), finding("frf", value=None)],
    }
    assert days_words(result) == "2026-10-13 to 2026-10-20; no day is stated for Stroke"
    assert days_words({"findings": [finding("flatness")]}) == ""


def test_item_and_environment_are_what_is_stated():
    result = {
        "origin": {"lot": "W40", "customer": "Lab"},
        "environment": {"temperature_C": {"value": 21.5, "U": 0.5}, "humidity_percent": {"value": 45.0, "U": None}},
    }
    assert item_words(result) == "customer Lab, lot W40"  # as in an attachment, whatever the order in unit.toml
    assert environment_words(result) == "temperature 21.5 ± 0.5 °C, relative humidity 45 %"
    assert item_words({}) == environment_words({}) == ""


@pytest.mark.parametrize(
    ("section", "who"),
    [
        ("", set()),
        ('[notes]\nflatness = ["measured by Ben", "measured by hand (Cem)"]', set()),
        ('[measured_by]\nflatness = ["Anna"]\ncapacitance = ["anna"]', set()),
        ('[measured_by]\nflatness = ["Ben"]', {"Ben"}),
        ('[measured_by]\nflatness = ["Ben"]\ncapacitance = ["Anna", "Cem"]', {"Ben", "Anna", "Cem"}),
    ],
)
def test_the_operator_signs_and_is_not_said_to_have_measured_what_others_did(
    tmp_path: Path, section: str, who: set[str]
):
    contents = replace(certificate_contents(tmp_path), operator="Anna")
    unit = f"{contents.files[UNIT_FILE].decode()}\n{section}\n".encode()
    words = operator_words(replace(contents, files={**contents.files, UNIT_FILE: unit}))
    signs, _, others = words.partition("; measured by ")
    names = set(filter(None, others.removesuffix(": see Notes").split(", ")))
    assert names == {name if name == "Anna" else f"{name} (typed)" for name in who}  # Anna's key signs
    assert signs == ("Anna (signs)" if who else "Anna")


def test_what_was_read_from_an_instrument_is_not_said_to_be_entered(tmp_path: Path):
    contents = certificate_contents(tmp_path)
    before = entered_words(contents)
    checks = [name for name in ("Flatness", "Capacitance") if name in before]
    assert checks[-1:] == ["Capacitance"]
    unit = contents.files[UNIT_FILE].decode() + '\n[read_with]\ncapacitance = ["LCR-819 SIM-1", "typed"]\n'
    words = entered_words(replace(contents, files={**contents.files, UNIT_FILE: unit.encode()}))
    (read,) = [part for part in words.split("; ") if "LCR-819 SIM-1, typed" in part]
    assert "Capacitance" in read
    assert "entered" not in read
    assert "Capacitance" not in words.replace(read, "")


def test_every_rule_of_a_finding_is_in_words_once():
    words = rule_words({"findings": [finding("a"), finding("b"), finding("c", "simple")]})
    assert words.count("Decision rule guarded: ") == 1
    assert words.count("simple:") == 1
    assert "shared" not in words
    assert COVERAGE in words
    assert SCOPE in words


def test_the_page_labels_the_date_of_issue_and_defines_each_term_once(tmp_path: Path):
    pages = PdfReader(io.BytesIO(render(certificate_contents(tmp_path)))).pages
    text = " ".join(" ".join(page.extract_text() for page in pages).split())
    assert text.count("date of issue") == 1
    assert text.count("P(false)") - text.count("Rule P(false) Verdict") == 1


def page_text(contents: CertificateContent) -> str:
    pages = PdfReader(io.BytesIO(render(contents))).pages
    return " ".join(" ".join(page.extract_text() for page in pages).split())


def test_each_limit_stands_with_its_source(tmp_path: Path):
    """Which requirement is met needed the attached spec ([ISO17025] 7.8.6.2 b)."""
    text = page_text(certificate_contents(tmp_path))
    assert "Limit: [STB] 2.2" in text
    assert "Limit: [STB] 2.3" in text


def test_what_only_a_program_compares_stands_behind_all_that_is_measured(tmp_path: Path):
    text = page_text(certificate_contents(tmp_path))
    before, _, behind = text.partition("How this certificate is checked")
    contents = certificate_contents(tmp_path)
    assert contents.spec_sha256 not in before
    assert contents.spec_sha256 in behind
    for row in ("Store", "Bench", "Record"):
        assert f" {row} " not in before.replace("Record all", "")
        assert f" {row} " in behind
    assert behind.index(" Store ") < behind.index(" Record ")


def test_an_amendment_says_so_below_its_title(tmp_path: Path):
    contents = certificate_contents(tmp_path)
    amended = replace(contents, provenance={**contents.provenance, "amends": "EX-2026 APA-03/1"})
    assert "Amendment to certificate EX-2026 APA-03/1." in page_text(amended).partition("Findings")[0]
    assert "Amendment" not in page_text(contents)
