"""Countersigning a unit that was not accepted asks what is to be done with it, and the answer is signed."""

import io
from pathlib import Path

import pytest
from pypdf import PdfReader

from accept.base.home import home
from accept.certificate import DispositionError, parse_disposition
from accept.certificate.contents.disposition import LONGEST
from accept.certificate.signature.stamp import stamp_style
from accept.certificate.trust import keys
from accept.certificate.trust.keys import Credential
from accept.commands.trust import countersign
from accept.store import open_store
from accept.store.payloads import Disposition
from tests.accept.certificate.certificate_help import WHEN
from tests.accept.certificate.verify.verify_help import credentials
from tests.accept.units.units import GOOD, make_unit
from tests.shared.command_line import accept
from tests.shared.kept_folder import KeptFolder, kept


def reject(place: Path) -> None:
    keys.init(home(), "correct horse", "Test Technician", "Grace Hopper", "battery staple")
    folder = make_unit(place / "a", "A", GOOD.replace("5.10", "1.72"))
    assert accept("report", folder, "--out", place / "A.pdf", "--spec", "apa-basic").exit_code == 3


once_rejected = kept(reject)


@pytest.fixture
def rejected(once_rejected: KeptFolder, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The certificate of a unit whose sensor stack is too small."""
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    return once_rejected.put_back(monkeypatch) / "A.pdf"


def test_a_rejected_unit_is_countersigned_with_a_disposition_only(rejected: Path) -> None:
    before = rejected.read_bytes()
    for words in ((), ("--disposition", "burn", "--because", "cold"), ("--disposition", "return")):
        done = accept("countersign", rejected, *words)
        assert done.exit_code == 6
        assert "A is rejected" in done.stderr or "the reason of a disposition" in done.stderr
        assert rejected.read_bytes() == before
    done = accept("countersign", rejected, "--disposition", "return", "--because", "stacks of the wrong size")
    assert done.exit_code == 0, done.stderr
    decision = "return to the supplier: stacks of the wrong size"
    assert f"A rejected: countersigned by Grace Hopper; disposition: {decision}" in done.stderr
    checked = accept("verify", rejected)
    assert checked.exit_code == 0
    assert f"countersigned, disposition: '{decision}'" in checked.stdout
    assert f"disposition by Grace Hopper: {decision}" in checked.stderr
    with open_store() as store:
        event = store.latest("A", "certificate_signed")
    assert event is not None
    stored = event.data["disposition"]
    assert (stored["choice"], stored["reason"]) == ("return", "stacks of the wrong size")
    assert stored["signed"]["person"] == "Grace Hopper"
    assert "qa, return: stacks of the wrong size" in accept("store", "log", "A").stdout


def test_a_unit_that_is_judged_while_the_passphrase_is_asked_for_is_not_countersigned(
    rejected: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is stored either: the disposition is about what quality assurance has seen."""
    before, opened = rejected.read_bytes(), countersign.qa_credential

    def asked(passphrase_file: Path | None, reason: str) -> Credential:
        folder = make_unit(rejected.parent / "later", "A", GOOD.replace("5.10", "1.70"))
        again = accept("batch", folder, "--spec", "apa-basic", "--out", rejected.parent / "o", "--no-certificates")
        assert again.exit_code == 3
        return opened(passphrase_file, reason)

    monkeypatch.setattr(countersign, "qa_credential", asked)
    done = accept("countersign", rejected, "--disposition", "use-as-is", "--because", "only the stroke was wanted")
    assert done.exit_code == 6, done.output
    assert "A: its history went on while the certificate was looked at" in done.stderr
    assert rejected.read_bytes() == before
    with open_store() as store:
        assert [e.data["role"] for e in store.events("A", "certificate_signed")] == ["technician"]


def test_the_technicians_passphrase_does_not_open_the_qa_key(rejected: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ACCEPT_QA_PASSPHRASE")
    monkeypatch.setenv("ACCEPT_PASSPHRASE", "battery staple")
    done = accept("countersign", rejected, "--disposition", "scrap", "--because", "too small")
    assert done.exit_code == 6
    assert "no passphrase: set ACCEPT_QA_PASSPHRASE" in done.stderr


def test_a_disposition_that_was_changed_does_not_verify(rejected: Path) -> None:
    accept("countersign", rejected, "--disposition", "scrap", "--because", "cracked shell")
    content = rejected.read_bytes()
    assert content.count(b"cracked shell") == 1
    rejected.write_bytes(content.replace(b"cracked shell", b"craCked shell"))
    assert accept("verify", rejected).exit_code == 3


def test_an_accepted_unit_needs_none() -> None:
    assert parse_disposition("A", "accepted", "", "") is None
    with pytest.raises(DispositionError, match="needs no disposition"):
        parse_disposition("A", "accepted", "scrap", "")


@pytest.mark.parametrize("reason", ["", " \t", "x" * (LONGEST + 1), "a\x1b[2J"])
def test_a_reason_is_one_printable_line(reason: str) -> None:
    with pytest.raises(DispositionError, match="reason of a disposition"):
        parse_disposition("A", "rejected", "rework", reason)


def test_the_box_of_the_countersignature_shows_it() -> None:
    _, qa = credentials()
    reason = "the customer takes it for a prototype that needs a third of the stroke, mail of 2026-11-20"
    box = stamp_style(qa, WHEN, (187, 71), Disposition("use-as-is", reason)).background
    lines = PdfReader(io.BytesIO(box.pdf)).pages[0].extract_text().splitlines()
    assert "Disposition: use as it is" in lines
    assert reason in " ".join(lines)


def test_what_is_typed_is_taken_as_it_is_meant() -> None:
    found = parse_disposition("A", "conditional", " Use-As-Is ", " within  the customer's\nlimits ")
    assert found == Disposition("use-as-is", "within the customer's limits")
