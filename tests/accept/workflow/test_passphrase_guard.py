"""A passphrase that is typed where words are kept is stored nowhere."""

from pathlib import Path

import pytest

from accept.base.home import home
from accept.certificate import SigningRefused
from accept.certificate.trust import keys
from accept.judging import load_spec
from accept.store import open_store
from accept.workflow import certify
from accept.workflow.bench import Workbench
from accept.workflow.certify import Signing
from accept.workflow.dialogue.begin import Begun
from accept.workflow.dialogue.summary_effects import Ask, AskedLine
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.entry.passphrase_guard import is_passphrase, may_be_passphrase
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.open_bench import BenchServices
from accept.workflow.session import Session
from accept.workflow.worker.judging import judge_whole_unit
from checks.declare import Measured

ANN, QUINN, AUTHORITY = "correct horse", "battery staple", "for the office"
BEGUN = {"serial": "APA-02", "kind": "apa", "operator": "Ann"}


@pytest.fixture
def bench():
    with open_store() as store:
        keys.init(home(), ANN, "Ann", "Quinn", QUINN, authority_passphrase=AUTHORITY)
        opened = Workbench(store, home(), {"apa": load_spec("apa-basic")}, BenchServices())
        yield opened
        opened.services.close()


@pytest.fixture
def session(bench: Workbench):
    opened, _ = bench.open_unit(Begun(**BEGUN))
    yield opened
    opened.close()


def everything_stored() -> bytes:
    """Every file of the bench but the keys."""
    files = (path for path in home().rglob("*") if path.is_file() and "keys" not in path.parts)
    return b"\n".join(path.read_bytes() for path in files)


@pytest.mark.parametrize("typed", [ANN, f" {ANN} ", QUINN, AUTHORITY])
def test_a_passphrase_of_every_key_is_known(bench: Workbench, typed: str) -> None:
    assert is_passphrase(bench.home, typed)


@pytest.mark.parametrize(
    "typed", ["", "correct", "correct horses", "Correct horse", "4.99 ± 0.02 uF", "\ud800 correct"]
)
def test_other_text_is_none(bench: Workbench, typed: str) -> None:
    assert not is_passphrase(bench.home, typed)


def test_a_bench_without_keys_has_no_passphrase(tmp_path: Path) -> None:
    assert not is_passphrase(tmp_path, ANN)


def test_values_are_tried_at_no_key_and_long_numbers_are() -> None:
    """A height costs no tenth of a second; eight digits may be a passphrase, and are no value that is measured."""
    assert not any(map(may_be_passphrase, ("365.5 um", "0 -2.5 -3 0 -1.5 1 -2 -4", "1234567")))
    assert may_be_passphrase("19751204")


@pytest.mark.parametrize(
    "wrong", [{"serial": ANN}, {"operator": ANN}, {"operator": QUINN}, {"parts": {"stack": ANN}}, {"reason": ANN}]
)
def test_no_unit_is_begun_with_a_passphrase(bench: Workbench, wrong: dict) -> None:
    with pytest.raises(EntryError, match="is a passphrase"):
        bench.open_unit(Begun(**{**BEGUN, **wrong}))
    assert not list(bench.store.events("APA-02"))
    assert not any(word.encode() in everything_stored() for word in (ANN, QUINN))


def test_no_note_and_no_reason_is_a_passphrase(session: Session) -> None:
    session.entries.take("stroke", session.step("stroke").check.inputs["stroke_um"], Measured(365.5))
    for store_it in (session.entries.note, session.entries.remeasure):
        with pytest.raises(EntryError, match="is a passphrase"):
            store_it("stroke", ANN)
    assert ANN.encode() not in everything_stored()


def test_a_signing_reason_is_required_and_no_passphrase(session: Session) -> None:
    judge_whole_unit(session)
    assert "why you sign" in certify.Signing(session).reason_problem(" ", [ANN])
    assert certify.Signing(session).reason_problem(f"{ANN} ", [ANN]) == NOT_TAKEN
    assert certify.Signing(session).reason_problem("only begun", [ANN]) == ""
    with pytest.raises(SigningRefused, match="is a passphrase"):
        certify.Signing(session).sign(ANN, ANN)
    certify.Signing(session).sign(ANN, "only begun")
    assert certify.Signing(session).disposition_problem("scrap", QUINN, [QUINN]) == NOT_TAKEN
    assert "expected one of" in certify.Signing(session).disposition_problem("keep", "-", [QUINN])
    assert certify.Signing(session).disposition_problem("scrap", "", [QUINN])
    assert certify.Signing(session).disposition_problem("scrap", "cracked", [QUINN]) == ""
    with pytest.raises(SigningRefused, match="is a passphrase"):
        certify.Signing(session).countersign(QUINN, "scrap", QUINN)
    assert not any(word.encode() in everything_stored() for word in (ANN, QUINN))


def test_no_passphrase_is_chosen_that_stands_in_the_record(session: Session) -> None:
    session.entries.note("stroke", "gauge exchanged")
    for said in ("gauge exchanged", "why it is signed"):
        assert "choose another" in certify.Signing(session).new_passphrase_problem(said, ["why it is signed"])
    assert "8 or more" in certify.Signing(session).new_passphrase_problem("short", [])
    assert certify.Signing(session).new_passphrase_problem("a new passphrase", ["why it is signed"]) == ""


def problem(session: Session, *lines: tuple[AskedLine, str], then: str = "sign") -> str:
    """Why the last line of a question cannot stay."""
    asked = Ask(then, "", "", tuple(line for line, _ in lines))
    return Signing(session).problem(asked, len(lines) - 1, [text for _, text in lines])


def test_a_question_refuses_what_cannot_be_signed_with(session: Session) -> None:
    judge_whole_unit(session)
    why, first = (AskedLine.WHY, "nothing was measured"), (AskedLine.PASSPHRASE, ANN)
    assert "why you sign" in problem(session, (AskedLine.WHY, ""))
    assert not problem(session, why)
    with pytest.raises(SigningRefused, match="That is a passphrase"):  # of the shift: the reason is there in clear
        Signing(session).sign(ANN, f" {ANN} ")
    assert "Wrong passphrase" in problem(session, why, (AskedLine.PASSPHRASE, "battery horse"))
    assert "no passphrase was typed" in problem(session, why, (AskedLine.PASSPHRASE, ""))
    assert not problem(session, why, first)
    assert "Wrong passphrase" in problem(session, (AskedLine.QA_PASSPHRASE, ANN), then="countersign")
    assert not problem(session, (AskedLine.QA_PASSPHRASE, QUINN), then="countersign")


def test_a_new_passphrase_is_long_said_nowhere_and_typed_twice(session: Session) -> None:
    judge_whole_unit(session)
    why = AskedLine.WHY, "nothing was measured"

    def chosen(first: str, *again: str) -> str:
        lines = [why, (AskedLine.PASSPHRASE, first), *((AskedLine.REPEATED, text) for text in again)]
        return problem(session, *lines, then="first keys")

    assert "8 or more" in chosen("short")
    assert "choose another passphrase" in chosen(why[1])
    assert "differ" in chosen("a new passphrase", "another")
    assert not chosen("a new passphrase")
    assert not chosen("a new passphrase", "a new passphrase")


def test_whose_key_is_needed_is_known_before_a_passphrase_is_asked_for(bench: Workbench) -> None:
    session, _ = bench.open_unit(Begun(**BEGUN | {"operator": "Bob"}))
    known = Signing(session).keys(keys.TECHNICIAN)
    assert "the key at this bench is that of Ann" in known.problem
    assert "keys request --role technician --name Bob" in known.problem
    assert not Signing(session).keys(keys.QA).problem
    session.close()
