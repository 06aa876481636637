"""A unit that was rejected or incomplete is judged again for a reason, which event and certificate state."""

from collections.abc import Callable
from pathlib import Path

import pytest

from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.statements import statements
from accept.certificate.verify.attachments import read
from accept.certificate.verify.rejudge import read_certificate
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
    return read(read_certificate(pdf))


@pytest.fixture(params=[by_report, by_batch], ids=["report", "batch"])
def judge(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., Path]:
    """Judge the unit with this text of its file, and return its certificate."""
    return lambda text, *words: (make_unit(tmp_path / "units" / "A", "A", text), request.param(tmp_path, *words))[1]


@pytest.mark.parametrize(("words", "reason"), [(("--reason", REASON), REASON), ((), "")])
def test_a_rejected_unit(judge: Callable[..., Path], words: tuple[str, ...], reason: str) -> None:
    """Without a terminal and without the option it is judged, and states that no reason was given."""
    judge(BAD, "--reason", "of no use to a first judgement")
    pdf = judge(GOOD, *words)
    assert reasons() == [None, reason]
    assert stated(pdf).provenance["reason"] == reason
    assert (reason or "no reason was given") in statements(stated(pdf))["Attempt"]
    assert accept("verify", pdf).exit_code == 0


def test_an_accepted_unit_needs_no_reason(judge: Callable[..., Path]) -> None:
    judge(GOOD)
    pdf = judge(GOOD.replace("5.10", "5.11"))
    assert reasons() == [None, None]
    assert "reason" not in stated(pdf).provenance


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
