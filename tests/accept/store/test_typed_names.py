"""Who acts: the name of somebody with a key at this bench asks for the key; every other name is stored and shown as
typed."""

import json
from dataclasses import replace
from datetime import UTC, date, datetime
from functools import partial
from pathlib import Path

import pytest
from pypdf import PdfReader
from typer.testing import Result

from accept.base.home import home
from accept.certificate.trust import encrypted_key, keys, spec_approval
from accept.fleet import findings_file
from accept.fleet.trend import stored_baselines
from accept.store import NewEvent, open_store
from accept.store.payloads import BaselineSet, CertificateSigned, SpecApproved, UnitJudged
from specs.spec import load
from tests.accept.fleet.judgements import add, judgement
from tests.accept.units.units import GOOD, make_unit
from tests.shared import command_line

accept = partial(command_line.accept, code=0)
TECHNICIANS, QAS = "correct horse", "battery staple"


@pytest.fixture(autouse=True)
def bench(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bench of Ada, technician, and Grace Hopper, quality assurance; nobody gave a passphrase."""
    monkeypatch.setattr(encrypted_key, "ITERATIONS", 10)
    monkeypatch.delenv("ACCEPT_PASSPHRASE", raising=False)
    monkeypatch.delenv("ACCEPT_OPERATOR", raising=False)
    monkeypatch.setenv("LOGNAME", "robot")
    keys.init(home(), TECHNICIANS, "Ada Lovelace", "Grace Hopper", QAS)


def names_in_log() -> list[str]:
    return [line.split("  ")[2] for line in accept("store", "log").stdout.splitlines()]


def batch(unit: Path, operator: str, *more: object, code: int = 0) -> Result:
    out = unit.parent / "out"
    return accept(
        "batch", unit, "--spec", "apa-basic", "--out", out, "--operator", operator, "--no-certificates", *more,
        code=code,
    )  # fmt: skip


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    return make_unit(tmp_path / "u", "A-1", GOOD)


@pytest.mark.parametrize(
    "name",
    [
        "Grace Hopper",
        "grace  hopper ",
        "GraceHopper",
        "Gr\u0430ce Hopper",  # the Cyrillic letter that looks like an a
        "Grace\u200b Hopper",  # a space of no width
        "Grace\u00a0Hopper",
        "Grace\u2010Hopper",
        "Ｇrace Hopper",
        "Grace Hopper\ufe00",  # a selector of a variant, which shows nothing
        "\u3164Grace Hopper",  # a filler, which shows nothing
    ],
)
def test_the_name_of_a_key_holder_asks_for_the_key(unit: Path, name: str) -> None:
    done = batch(unit, name, code=6)
    assert "Grace Hopper has a key at this bench" in done.stderr
    assert "ACCEPT_QA_PASSPHRASE" in done.stderr
    assert names_in_log() == []


def test_no_other_key_opens_a_name(unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_PASSPHRASE", TECHNICIANS)
    assert "does not open" in batch(unit, "Grace Hopper", code=6).stderr
    assert names_in_log() == []


def test_a_key_holder_with_the_key_is_not_marked(unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", QAS)
    batch(unit, "grace hopper")
    assert set(names_in_log()) == {"Grace Hopper"}  # as the key has it
    with open_store() as store:
        assert not any("typed" in event.data for event in store.events())


def test_a_typed_name_works_as_before_and_is_marked_wherever_it_is_shown(unit: Path, tmp_path: Path) -> None:
    batch(unit, "Ann")
    assert set(names_in_log()) == {"Ann (typed)"}
    with open_store() as store:
        event = store.latest("A-1", UnitJudged.KIND)
        assert event is not None
        assert (event.who, event.data["typed"]) == ("Ann", True)
    assert "Ann (typed)" in accept("history", "A-1").stdout
    assert "Ann (typed)" in accept("list").stdout
    accept("site", "--out", tmp_path / "site")
    assert "Ann (typed)" in "".join(p.read_text() for p in (tmp_path / "site").glob("*.js"))
    listed = tmp_path / "list.json"
    accept("history", "A-1", "--json", listed)
    assert '"operator":"Ann"' in listed.read_text().replace(" ", "")
    assert '"typed":true' in listed.read_text().replace(" ", "")


def test_the_login_name_is_typed_too(unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Anybody sets it for one command."""
    monkeypatch.setenv("LOGNAME", "Grace Hopper")
    out = ("--spec", "apa-basic", "--no-certificates", "--out", unit.parent / "out")
    assert "Grace Hopper has a key" in accept("batch", unit, *out, code=6).stderr
    monkeypatch.setenv("LOGNAME", "robot")
    accept("batch", unit, *out)
    assert set(names_in_log()) == {"robot (typed)"}


def test_who_signs_is_not_asked_twice(unit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_PASSPHRASE", TECHNICIANS)
    accept("report", unit, "--spec", "apa-basic", "--out", tmp_path / "a.pdf", "--operator", "ada lovelace")
    assert set(names_in_log()) == {"Ada Lovelace"}


def test_a_report_in_the_name_of_a_key_holder_is_not_written_without_the_key(unit: Path, tmp_path: Path) -> None:
    words = ("report", unit, "--spec", "apa-basic", "--out", tmp_path / "a.pdf", "--operator")
    assert "Ada Lovelace has a key" in accept(*words, "Ada Lovelace", code=6).stderr
    assert not (tmp_path / "a.pdf").exists()
    accept(*words, "Ann")
    assert "Ann (typed)" in PdfReader(tmp_path / "a.pdf").pages[0].extract_text()


def test_an_instrument_that_is_only_named_in_the_folder_is_not_looked_up(
    unit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page says that the values were read from it."""
    monkeypatch.setenv("ACCEPT_PASSPHRASE", TECHNICIANS)
    text = (unit / "unit.toml").read_text()
    (unit / "unit.toml").write_text(text.replace("[flatness]", '[read_with]\nstroke = ["C1216, 9"]\n[flatness]', 1))
    accept("report", unit, "--spec", "apa-basic", "--out", tmp_path / "a.pdf", "--operator", "Ada Lovelace")
    line = next(line for line in accept("verify", tmp_path / "a.pdf").stderr.splitlines() if "not looked up" in line)
    assert line.endswith(": read_with")


def typed_judgement(serial: str, who: str) -> NewEvent:
    event = judgement(serial, {"stroke_um": 360.0 + 3.0 * (len(who) % 5)})
    return replace(event, payload={**event.payload, "typed": True})


def test_a_judgement_that_its_judge_signed_is_not_shown_as_typed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in the workflow: what is measured is stored under the typed name, the signature in the end is the key's."""
    technician = keys.unlock(home(), keys.TECHNICIAN, TECHNICIANS)
    signed, own = CertificateSigned("a.pdf", "ab" * 32, keys.TECHNICIAN), "Ada Lovelace"
    with open_store() as store:
        store.append_many([typed_judgement(f"A-{n}", own) for n in range(5)], who=own)
        store.append_many([typed_judgement("A-5", "Grace Hopper")], who="Grace Hopper")
        store.write(signed, "A-1", who=technician.person)
        store.write(signed, "A-2", who=own)  # nobody opened a key
        store.write(signed, "A-3", who=technician.person)
        store.append_many([typed_judgement("A-3", own)], who=own)  # after the signature
        store.write(replace(signed, role=keys.QA), "A-4", who=technician.person)
        store.write(signed, "A-5", who=technician.person)  # another person
    typed = {row.split()[0] for row in accept("list").stdout.splitlines() if "(typed)" in row}
    assert typed == {"A-0", "A-2", "A-3", "A-4", "A-5"}
    assert "(typed)" not in accept("history", "A-1").stdout


def test_the_file_of_findings_learns_of_a_later_signature(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(findings_file, "FEW", 0)
    technician = keys.unlock(home(), keys.TECHNICIAN, TECHNICIANS)
    with open_store() as store:
        store.append_many([typed_judgement("A-1", "Ada Lovelace")], who="Ada Lovelace")
    assert "(typed)" in accept("list").stdout  # the file is written here
    with open_store() as store:
        store.write(CertificateSigned("a.pdf", "ab" * 32, keys.TECHNICIAN), "A-1", who=technician.person)
    assert "(typed)" not in accept("list").stdout


@pytest.fixture
def charted() -> None:
    with open_store() as store:
        days = [date(2026, 3 + n // 20, 1 + n % 20) for n in range(30)]
        values = [{"stroke_um": 360.0 + 3.0 * (n % 5)} for n in range(30)]
        add(store, [judgement(f"A-{n}", values[n], day=day) for n, day in enumerate(days)])


BASELINE = ("trend", "stroke_um", "--baseline", "2026-03-01..2026-03-20")


def test_a_baseline_is_signed_by_quality_assurance(charted: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """It decides what an alarm is; any name could be typed for it."""
    assert "ACCEPT_QA_PASSPHRASE" in accept(*BASELINE, "--operator", "Ann", code=6).stderr
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", QAS)
    accept(*BASELINE, "--operator", "Ann")
    assert names_in_log()[-1] == "Grace Hopper"
    assert "set and signed by Grace Hopper" in accept("trend", "stroke_um").stderr
    with open_store() as store:
        (event,) = store.events(what=BaselineSet.KIND)
        signed = BaselineSet.of(event)
        changed = replace(signed, sigma=99.0)
        store.write(replace(signed, mean=0.0, signed=None), who="Ann")
        store.write(changed, who="Grace Hopper")  # with the signature of another one
        (counts,) = stored_baselines(store, "stroke_um", "all").values()
    assert (counts.stated, counts.problem) == (signed, None)


def test_a_bench_without_a_key_of_quality_assurance_says_that_nobody_signed_its_baseline(charted: None) -> None:
    """As in stores of versions before, which signed none."""
    for path in keys.person_files(home(), keys.QA):
        path.unlink()
    accept(*BASELINE, "--operator", "Ann")
    assert names_in_log()[-1] == "Ann (typed)"
    assert "set by Ann (typed), it is not signed by quality assurance" in accept("trend", "stroke_um").stderr


def test_the_approval_of_a_spec_is_an_event_with_its_signature(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", QAS)
    mine = tmp_path / "mine.toml"
    accept("spec", "copy", "apa-basic", mine)
    assert "not approved: quality assurance has not signed it" in accept("spec", "show", mine).stdout
    accept("spec", "approve", mine)
    assert names_in_log()[-1] == "Grace Hopper"
    assert "mine: approved" in accept("store", "log", "--what", "spec_approved").stdout
    with open_store() as store:
        (event,) = store.events(what=SpecApproved.KIND)
    spec = load(mine)
    assert event.spec == f"mine@{spec.sha256}"
    (kept,) = (home() / "approved-specs").iterdir()
    assert SpecApproved.of(event).approval == json.loads(kept.read_text())
    assert f"approved by Grace Hopper on {event.time[:10]}, event {event.seq}" in accept("spec", "show", mine).stdout


def test_an_approval_of_an_earlier_program_holds_and_its_event_is_missed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", QAS)
    mine = tmp_path / "mine.toml"
    accept("spec", "copy", "apa-basic", mine)
    spec, key = load(mine), keys.unlock(home(), keys.QA, QAS)
    spec_approval.write(home(), spec_approval.approve(spec, key, datetime.now(UTC)))
    said = accept("spec", "show", mine).stdout
    assert "approved by Grace Hopper on " in said
    assert "its event is not in the store: approve it again" in said


def test_a_golden_unit_goes_through_the_same_door(charted: None) -> None:
    assert "Ada Lovelace has a key" in accept("golden", "name", "A-1", "--operator", "ADA LOVELACE", code=6).stderr
    accept("golden", "name", "A-1", "--operator", "Ann")
    assert "Ann (typed)" in accept("golden", "list").stdout
    assert "has a key" in accept("golden", "check", "--operator", "Ada Lovelace", code=6).stderr


def test_events_from_before_bear_no_mark() -> None:
    with open_store() as store:
        store.append("unit_refused", "", {"path": "x", "reason": "no unit.toml"}, who="Grace Hopper")
    assert names_in_log() == ["Grace Hopper"]
