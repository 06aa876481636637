"""A technician with his key, the bench's own key and a patched program, who also writes the store's database: what a
clean program at quality assurance says of what he signed."""

import re
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from accept import units
from accept.base.child_processes import bounded
from accept.base.home import home
from accept.base.names import KeyHolder
from accept.batch import services
from accept.certificate import CertificateContent, Validity, certify, read_contents, rejudge
from accept.certificate.contents.content import RESULTS
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import commissioning, encrypted_key, keys
from accept.certificate.trust.keys import QA, TECHNICIAN
from accept.certificate.verify import structure
from accept.fleet import golden
from accept.judging import judge
from accept.judging.reservations.nonconformance import decide, open_nonconformances
from accept.judging.reservations.reservations import Reservations
from accept.store import Event, open_store
from accept.store import store as appending
from accept.store.decisions import DecisionError, Signer
from accept.store.opening import DATABASE
from accept.store.payloads import Disposition, StepNoted
from accept.store.store import Store
from accept.units import unit_folder
from tests.accept.certificate.verify.test_statements import PHRASE, accept, certified, own_spec, plainly, unit, verified
from tests.accept.certificate.verify.verify_help import verify

CONCESSION = ("--disposition", "use-as-is", "--because", "only a scratch")
NOTED = '[notes]\nstroke = ["NONCONFORMANCE: scratch (Test Technician)"]\n'
BENCH = """name = "B1"
[instruments.tip]
driver = "offline"
model = "X"
serial = "12"
measures = ["flatness", "capacitance", "stroke", "stiffness"]
calibration = { certificate = "C-1", calibrated = 2024-01-01, due = 2025-01-01 }
"""


@pytest.fixture(autouse=True)
def _bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encrypted_key, "ITERATIONS", 10)
    monkeypatch.setenv("ACCEPT_PASSPHRASE", PHRASE)
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    monkeypatch.setenv("ACCEPT_CA_PASSPHRASE", "authority phrase")
    keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple", authority_passphrase="authority phrase")


@contextmanager
def patched(at: datetime | None = None, known: Reservations | None = None) -> Iterator[pytest.MonkeyPatch]:
    """A program that asks the store for nothing. at: its clock; known: what it says instead."""
    with pytest.MonkeyPatch.context() as m:
        m.setattr(Reservations, "known", classmethod(lambda *_, **__: known or Reservations()))
        m.setattr(Store, "other_spelling", lambda *_: None)
        m.setattr(services, "check_may_judge", lambda *_: None)
        m.setattr(judge, "serial_fits", lambda *_: None)
        if at is not None:
            clock = type("Clock", (datetime,), {"now": classmethod(lambda *_: at)})
            m.setattr(appending, "datetime", clock)
            m.setattr(certify, "datetime", clock)
        yield m


def quality_assurance(place: Path, monkeypatch: pytest.MonkeyPatch, store: Path | None = None) -> Path:
    """A machine with the authority's certificate, its list and the key of quality assurance; store: of the bench."""
    shutil.copytree(home() / "keys", place / "keys", ignore=shutil.ignore_patterns("bench.pem", "tech*", "ca.key.pem"))
    monkeypatch.setenv("ACCEPT_HOME", str(place))
    if store is not None:
        monkeypatch.setenv("ACCEPT_STORE_URL", f"sqlite:///{store}")
    return place


def events(serial: str, what: str) -> list[Event]:
    with open_store() as store:
        return list(store.events(serial, what))


def open_nonconformances_of(serial: str) -> tuple[str, ...]:
    with open_store() as store:
        return open_nonconformances(store, serial, {})


def grace() -> Signer:
    credential = keys.unlock(home(), QA, "battery staple")
    assert credential.key is not None
    return Signer(credential.key, credential.certificate)


def noted(serial: str, step: str, text: str) -> None:
    with open_store() as store:
        store.write(StepNoted(step, text, nonconformance=True), serial, who=KeyHolder("Test Technician"))


def doubted(done: Result, words: str) -> None:
    assert done.exit_code == 4, done.output
    assert words in done.stdout


@pytest.mark.parametrize(("before", "serial"), [("A-01", "A-O1"), ("A-1", "a-1")])
def test_a_serial_that_is_taken_for_a_rejected_one(tmp_path: Path, before: str, serial: str) -> None:
    certified(tmp_path, "first", serial=before, stroke=181.7)
    with patched():
        pdf = certified(tmp_path, "second", serial=serial, stroke=366.2, sensor=4.95)
    doubted(verified(pdf), f"nobody told its serial apart: {serial} differs from {before}")


def test_a_bench_that_its_golden_unit_stopped(tmp_path: Path) -> None:
    certified(tmp_path, "G-1", serial="G-1")
    assert accept("golden", "name", "G-1", "--expect", "accepted").exit_code == 0
    first = certified(tmp_path, "A-1", serial="A-1", stroke=366.0, sensor=4.9)
    certified(tmp_path, "G-1", serial="G-1", stroke=350.0)
    assert accept("golden", "check").exit_code == 3
    with patched():
        pdf = certified(tmp_path, "A-2", serial="A-2", stroke=367.0, sensor=4.8)
    doubted(verified(pdf), "its bench was stopped when it judged it: A-2: not judged, because the bench missed")
    assert plainly(verified(first))  # judged before


def test_a_golden_unit_that_was_judged_in_the_stop_and_retired_since(tmp_path: Path) -> None:
    certified(tmp_path, "G-1", serial="G-1")
    assert accept("golden", "name", "G-1", "--expect", "accepted").exit_code == 0
    certified(tmp_path, "G-1", serial="G-1", stroke=350.0)
    assert accept("golden", "check").exit_code == 3
    pdf = certified(tmp_path, "G-1", serial="G-1")
    with open_store() as store:
        golden.retire(store, "G-1", "worn", grace)
    assert plainly(verified(pdf))


def test_a_serial_that_the_spec_does_not_allow(tmp_path: Path) -> None:
    spec = own_spec(tmp_path / "mine.toml")
    spec.write_text(re.sub(r"^(name = .*)$", r'\1\nserial_pattern = "[0-9]{4}"', spec.read_text(), count=1, flags=re.M))
    with patched():
        pdf = certified(tmp_path, "A-1", spec=str(spec), serial="A-1")
    done = verified(pdf)
    assert (done.exit_code, "does not fit the pattern [0-9]{4}" in done.stdout) == (3, True)


def test_what_was_rejected_is_not_signed_before_it(tmp_path: Path) -> None:
    """The clock of signature and store is set back before the rejection; the order of the events is not."""
    certified(tmp_path, "A-1")
    certified(tmp_path, "A-1", stroke=181.7)
    back = datetime.fromisoformat(events("B-1", "unit_judged")[-1].time) - timedelta(seconds=30)
    with patched(back):
        certified(tmp_path, "A-1")
    with patched(back + timedelta(seconds=4)):
        pdf = certified(tmp_path, "A-1")
    doubted(verified(pdf), "before an attempt that was not accepted was judged")
    assert "stroke: measured in attempt 1, before attempt 2, which was rejected" in verified(pdf).stdout


def test_a_list_does_not_hide_the_rejection_before(tmp_path: Path) -> None:
    certified(tmp_path, "A-1")
    certified(tmp_path, "A-1", stroke=181.7)
    with patched():
        pdf = certified(tmp_path, "A-1")
    assert accept("store", "publish", tmp_path / "list.json").exit_code == 0
    shutil.move(home() / DATABASE, tmp_path / "gone")
    shutil.move(home() / "keys" / "bench.pem", tmp_path / "bench.pem")
    (home() / "bench.key").unlink()
    done = verified(pdf, "--log", tmp_path / "list.json")
    assert "accepted after attempt 2 was rejected" in done.stdout


def test_a_concession_is_not_widened_by_telling_the_store_again(tmp_path: Path) -> None:
    """The certificate that was countersigned and its countersignature are stored once more, behind a judgement with a
    nonconformance that nobody decided about."""
    unit(tmp_path / "A-1").joinpath("unit.toml").write_text(
        unit(tmp_path / "A-1").joinpath("unit.toml").read_text() + NOTED
    )
    pdf = tmp_path / "A-1.pdf"
    again = ("report", tmp_path / "A-1", "--spec", "apa-basic", "--out", pdf, "--reason", "again")
    accept(*again)
    assert accept("countersign", pdf, *CONCESSION).exit_code == 0
    technician, grace = events("B-1", "certificate_signed")
    noted("B-1", "stiffness", "frame cracked")
    accept(*again)
    with open_store() as store:
        for event in (technician, grace):
            store.append(event.what, "B-1", event.data, who=event.who, spec=event.spec)
    done = accept(*again)
    assert (done.exit_code, "held until quality assurance decides: stiffness: frame cracked" in done.output) == (
        4,
        True,
    )


def test_a_stated_concession_is_that_of_the_store(tmp_path: Path) -> None:
    """Names under a decision that was signed about a certificate are not signed."""
    folder = unit(tmp_path / "A-1")
    folder.joinpath("unit.toml").write_text(folder.joinpath("unit.toml").read_text() + NOTED)
    pdf = tmp_path / "A-1.pdf"
    again = ("report", folder, "--spec", "apa-basic", "--out", pdf, "--reason", "again")
    accept(*again)
    assert accept("countersign", pdf, *CONCESSION).exit_code == 0
    given = events("B-1", "certificate_signed")[-1].data
    stated = {"nonconformances": ["stroke: scratch (Test Technician)", "stiffness: frame cracked"]}
    stated |= {"disposition": given["disposition"], "certificate": given["before"]}
    with patched(known=Reservations(dispositions=(stated,))):
        accept(*again)
    doubted(verified(pdf), "the bench's store holds no such decision: concession by Grace")


def test_calibrations_of_another_day(tmp_path: Path) -> None:
    (tmp_path / "bench.toml").write_text(BENCH)
    pdf = tmp_path / "A-1.pdf"
    own = commissioning.bench_statement
    with patched() as m:
        m.setattr(
            services, "bench_statement", lambda file, checks, _, *more: own(file, checks, date(2024, 6, 1), *more)
        )
        accept(
            "report", unit(tmp_path / "A-1"), "--spec", "apa-basic", "--out", pdf, "--bench", tmp_path / "bench.toml"
        )
    doubted(verified(pdf), "its calibrations are those of 2024-06-01, but it was judged on")


def test_measured_after_it_was_signed(tmp_path: Path) -> None:
    folder, pdf, own = unit(tmp_path / "A-1"), tmp_path / "A-1.pdf", unit_folder.read
    folder.joinpath("unit.toml").write_text(
        folder.joinpath("unit.toml").read_text() + "[measured]\nstroke = 2091-05-05\n"
    )
    with patched() as m:
        lax: Any = lambda path, **_: own(path, latest=date.max)  # noqa: E731
        m.setattr(unit_folder, "read", lax)
        m.setattr(units, "read", lax)
        accept("report", folder, "--spec", "apa-basic", "--out", pdf)
    doubted(verified(pdf), "stroke is said to be measured on 2091-05-05, after it was signed")


def test_a_revoked_key_does_not_sign_with_its_clock_set_back(tmp_path: Path) -> None:
    certified(tmp_path, "A-1")
    listed = home() / "keys" / "ca.crl.pem"
    before = listed.read_bytes()
    assert accept("keys", "revoke", "Test Technician", "--reason", "left").exit_code == 0
    now = listed.read_bytes()
    listed.write_bytes(before)
    with patched(datetime.now(UTC) - timedelta(minutes=10)) as m:
        m.setattr(keys, "check_usable", lambda *_: None)
        pdf = certified(tmp_path, "A-2", serial="A-2", stroke=366.0, sensor=4.9)
    listed.write_bytes(now)
    assert accept("keys", "revoke", "Grace", "--reason", "left").exit_code == 0  # a second stored list
    told = verified(pdf)
    assert told.stdout.count("the key of Test Technician was revoked") == 1  # though two lists have it
    doubted(told, "the key of Test Technician was revoked in this bench's store")


def test_a_signature_of_tomorrow(tmp_path: Path) -> None:
    with patched() as m:
        tomorrow = datetime.now(UTC) + timedelta(hours=20)
        m.setattr(certify, "datetime", type("Clock", (datetime,), {"now": classmethod(lambda *_: tomorrow)}))
        pdf = certified(tmp_path, "A-1")
    doubted(verified(pdf), "and here it is")


def test_quality_assurance_reads_all_that_it_decides_about(tmp_path: Path) -> None:
    """The second one stands in the store alone, and the first is longer than the head of the page."""
    noted("B-1", "stroke", "small scratch on the paint of the frame, seen before delivery; " * 6)
    noted("B-1", "stiffness", "frame cracked through")
    pdf = certified(tmp_path, "A-1")
    from pypdf import PdfReader

    assert "frame cracked through" in " ".join(PdfReader(pdf).pages[0].extract_text().split())
    assert "frame cracked through" in verified(pdf).stderr
    assert "decided about: stiffness: frame cracked through" in accept("countersign", pdf, *CONCESSION).stderr


@pytest.mark.parametrize(
    "known",
    [
        Reservations(folder={"alike": "A-I"}, superseded={"stroke": "stroke: released by Grace"}),
        Reservations(rereadings={"stroke_um": {"words": "released by Grace", "was": "pass"}}),
    ],
    ids=["superseded", "rereading"],
)
def test_words_that_no_store_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, known: Reservations) -> None:
    with patched(known=known):
        pdf = certified(tmp_path, "A-1")
    assert not plainly(verified(pdf)), verified(pdf).stdout
    quality_assurance(tmp_path / "qa", monkeypatch)
    doubted(verified(pdf), "neither the store of its bench nor a list was asked for the words of results.json")


def test_an_event_that_an_index_of_the_database_hides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The chain is whole, but a question about the unit does not find its rejection."""
    pdf = certified(tmp_path, "A-1").rename(tmp_path / "first.pdf")
    certified(tmp_path, "A-1", stroke=181.7)
    rejected = events("B-1", "unit_judged")[-1].seq
    database = home() / DATABASE
    with sqlite3.connect(database, isolation_level=None) as plain:
        plain.execute("PRAGMA writable_schema=ON")
        named = "SELECT name, sql FROM sqlite_master WHERE type = 'index' AND name LIKE 'events_%'"
        for name, sql in plain.execute(named).fetchall():
            plain.execute(f"DROP INDEX {name}")
            plain.execute(f"{sql} WHERE seq <> {rejected}")
            plain.execute("UPDATE sqlite_master SET sql = ? WHERE name = ?", (sql, name))
    plain.close()
    quality_assurance(tmp_path / "qa", monkeypatch, database)
    doubted(verified(pdf), "the database does not agree with its own indexes")


def test_a_store_that_was_cut_behind_what_quality_assurance_saw(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pdf = certified(tmp_path, "A-1").rename(tmp_path / "first.pdf")
    assert accept("store", "backup", tmp_path / "before.sqlite").exit_code == 0
    certified(tmp_path, "A-1", stroke=181.7)
    bench, database = home(), home() / DATABASE
    place = quality_assurance(tmp_path / "qa", monkeypatch, database)
    doubted(verified(pdf), "this bench's store knows a later attempt")
    monkeypatch.delenv("ACCEPT_STORE_URL")
    monkeypatch.setenv("ACCEPT_HOME", str(bench))
    assert accept("store", "restore", tmp_path / "before.sqlite").exit_code == 0
    monkeypatch.setenv("ACCEPT_HOME", str(place))
    monkeypatch.setenv("ACCEPT_STORE_URL", f"sqlite:///{database}")
    doubted(verified(pdf), "the bench's seal holds the hash of event")


def test_a_void_is_of_one_judgement_of_one_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quality assurance declared an attempt at another bench void, with the same number of its event."""
    bench, other = home(), tmp_path / "other"
    shutil.copytree(bench, other)
    for place in (other, bench):
        monkeypatch.setenv("ACCEPT_HOME", str(place))
        certified(tmp_path / place.name, "A-1")
        certified(tmp_path / place.name, "A-1", stroke=181.7)
    monkeypatch.setenv("ACCEPT_HOME", str(other))
    assert accept("store", "void", "B-1", 2, "--reason", "a wrong lead").exit_code == 0
    carried = events("B-1", "attempt_voided")[-1]
    monkeypatch.setenv("ACCEPT_HOME", str(bench))
    with open_store() as store:
        store.append(carried.what, "B-1", carried.data, who=carried.who)
    done = accept("report", unit(tmp_path / "A-1"), "--spec", "apa-basic", "--out", tmp_path / "again.pdf")
    assert "measured in attempt 1, before attempt 2, which was rejected" in done.output


def test_a_concession_is_of_one_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quality assurance conceded at another bench what is called by the same words there."""
    bench, other = home(), tmp_path / "other"
    shutil.copytree(bench, other)
    for place in (other, bench):
        monkeypatch.setenv("ACCEPT_HOME", str(place))
        for stroke in (365.5, 181.7, 365.5):
            certified(tmp_path / place.name, "A-1", stroke=stroke)
    monkeypatch.setenv("ACCEPT_HOME", str(other))
    assert accept("store", "dispose", "B-1", *CONCESSION).exit_code == 0
    assert not open_nonconformances_of("B-1")
    carried = events("B-1", "nonconformance_decided")[-1]
    monkeypatch.setenv("ACCEPT_HOME", str(bench))
    with open_store() as store:
        store.append(carried.what, "B-1", carried.data, who=carried.who)
    assert open_nonconformances_of("B-1")


def test_a_comparison_with_a_reference_that_the_store_has_not(tmp_path: Path) -> None:
    spec, pdf = own_spec(tmp_path / "mine.toml"), tmp_path / "A-1.pdf"
    spec.write_text(spec.read_text().replace("[checks.stroke]\n", "[checks.stroke]\nreference_days = 1\n", 1))
    (tmp_path / "bench.toml").write_text(BENCH.replace("2025-01-01", "2099-01-01"))
    compared = {"tip": [(datetime.now(UTC).date().isoformat(), 0.1)]}
    with patched() as m:
        m.setattr(services, "days_checked", lambda *_: compared)
        accept("report", unit(tmp_path / "A-1"), "--spec", spec, "--out", pdf, "--bench", tmp_path / "bench.toml")
    doubted(verified(pdf), "the bench's store has no comparison of tip with its reference")


def test_a_decision_without_a_certificate_is_about_what_was_shown(tmp_path: Path) -> None:
    noted("B-1", "stroke", "scratch")
    certified(tmp_path, "A-1")
    shown = open_nonconformances_of("B-1")
    noted("B-1", "stiffness", "frame cracked")
    with open_store() as store, pytest.raises(DecisionError, match="frame cracked"):
        decide(store, "B-1", Disposition("use-as-is", "only a scratch"), grace, shown)
    assert "stiffness: frame cracked" in accept("store", "dispose", "B-1", *CONCESSION).stderr


def test_attachments_take_no_more_memory_than_a_certificate_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Read like all that nothing is known of: a signer can promise anything in a few bytes."""
    monkeypatch.setattr(structure, "bounded", bounded)  # in a process of its own, as the product does
    contents = read_contents(certified(tmp_path, "A-1").read_bytes())
    whole = contents.attachments()
    swollen = {**whole, RESULTS: whole[RESULTS].rstrip()[:-1] + b" " * 250_000_000 + b"}"}
    with pytest.MonkeyPatch.context() as m:
        m.setattr(CertificateContent, "attachments", lambda *_: dict(sorted(swollen.items())))
        page = render(contents)
    signed = sign(page, keys.unlock(home(), TECHNICIAN, PHRASE), datetime.now(UTC))
    found = verify(signed, [keys.ca(home())], rejudge)
    assert (found.outcome, "takes more than" in found.reason) == (Validity.NOT_VALID, True), found.reason
