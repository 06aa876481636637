"""A unit that was rejected or incomplete is judged again for a reason, which event and certificate state."""

from collections.abc import Callable
from pathlib import Path

import pytest

from accept.certificate import CertificateContent, read_certificate, read_contents
from accept.certificate.contents.statements import statements
from accept.commands.units import batch, report
from accept.store import open_store
from accept.store.payloads import UnitJudged
from tests.accept.batch.test_copies import accept
from tests.accept.units.units import GOOD, make_unit

BAD = GOOD.replace("5.10", "1.72")
REASON = "the plug was loose"


def by_report(place: Path, *words: object) -> Path:
    pdf = place / "certificate.pdf"
    accept("report", place / "units" / "A", "--spec", "apa-basic", "--out", pdf, *words)
    return pdf


def by_batch(place: Path, *words: object) -> Path:
    accept("batch", place / "units", "--spec", "apa-basic", "--out", place / "out", "--workers", 1, *words)
    return place / "out" / "certificates" / "A.pdf"


def reasons() -> list[str | None]:
    """Return the reasons of the unit's judgements as they are stored."""
    with open_store() as store:
        return [UnitJudged.of(e).reason for e in store.events("A", UnitJudged.KIND)]


def stated(pdf: Path) -> CertificateContent:
    return read_contents(read_certificate(pdf))


@pytest.fixture(params=[by_report, by_batch], ids=["report", "batch"])
def judge(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., Path]:
    """Judge the unit with this text of its file, and return its certificate."""
    return lambda text, *words: (make_unit(tmp_path / "units" / "A", "A", text), request.param(tmp_path, *words))[1]


def test_a_rejected_unit(judge: Callable[..., Path]) -> None:
    judge(BAD, "--reason", "of no use to a first judgement")
    pdf = judge(GOOD, "--reason", REASON)
    assert reasons() == [None, REASON]
    assert stated(pdf).provenance["reason"] == REASON
    assert statements(stated(pdf))["Amended"] == f"replaces certificate A/1: {REASON}"
    assert accept("verify", pdf).exit_code == 0


def test_another_verdict_is_certified_without_a_reason_and_says_so(judge: Callable[..., Path]) -> None:
    """Neither a rejection nor the measurement after it waits for words."""
    judge(BAD)
    pdf = judge(GOOD)
    assert reasons() == [None, ""]
    assert statements(stated(pdf))["Attempt"].startswith("2, replaces 'rejected'")
    assert statements(stated(pdf))["Amended"] == "replaces certificate A/1: no reason was given"
    done = accept("verify", pdf, "--require", "accepted,current")
    assert (done.exit_code, "no reason was given" in done.stderr) == (0, True), done.output


def test_without_a_reason_no_accepted_unit_is_amended(judge: Callable[..., Path]) -> None:
    """Without a terminal and without the option it is judged and stored, and the certificate before is superseded; the
    one with a reason is then of that attempt."""
    pdf = judge(GOOD)
    before = pdf.read_bytes()
    other = GOOD.replace("5.10", "5.11")
    judge(other)
    assert pdf.read_bytes() == before
    done = accept("verify", pdf)
    assert (done.exit_code, "a later attempt" in done.stdout) == (4, True), done.output
    pdf = judge(other, "--reason", REASON)
    assert len(reasons()) == 2
    assert statements(stated(pdf))["Amended"] == f"replaces certificate A/1: {REASON}"
    done = accept("verify", pdf, "--require", "accepted,current")
    assert (done.exit_code, REASON in done.stderr) == (0, True), done.output
    assert REASON in accept("store", "log", "A").output


def test_an_accepted_unit_that_is_measured_again_needs_a_reason(judge: Callable[..., Path]) -> None:
    judge(GOOD)
    pdf = judge(GOOD.replace("5.10", "5.11"), "--reason", REASON)
    assert reasons() == [None, REASON]
    assert statements(stated(pdf))["Amended"] == f"replaces certificate A/1: {REASON}"
    assert REASON in accept("store", "log", "A").output


def test_the_same_result_again_amends_nothing(judge: Callable[..., Path]) -> None:
    judge(GOOD)
    pdf = judge(f"{GOOD}# the same values\n")
    assert reasons() == [None, None]
    assert not statements(stated(pdf))["Amended"]


def test_at_a_terminal_it_is_asked(judge: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    for command in (batch, report):
        monkeypatch.setattr(command, "ask", lambda words: asked.append(words) or REASON)
    judge(BAD)
    judge(GOOD)
    assert reasons() == [None, REASON]
    assert len(asked) == 1
    assert "rejected" in asked[0]


def test_a_reason_that_no_certificate_can_state_is_refused(tmp_path: Path) -> None:
    make_unit(tmp_path / "units" / "A", "A", GOOD)
    done = accept("report", tmp_path / "units" / "A", "--out", tmp_path / "a.pdf", "--reason", "x" * 201)
    assert done.exit_code == 6
    assert reasons() == []
