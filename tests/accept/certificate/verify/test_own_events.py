"""A technician with a patched program who adds events to the bench's store, sets its clock back, or uses another bench:
what a clean program says of what he signed."""

import shutil
import sqlite3
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from accept.base.home import home
from accept.base.names import KeyHolder
from accept.batch import services
from accept.certificate.trust import authority, commissioning, keys
from accept.store import open_store
from accept.store.opening import DATABASE
from accept.store.payloads import AttemptVoided, EntryUndone, UnitJudged
from accept.store.store import Store
from tests.accept.certificate.verify.test_patched_program import (
    BENCH,
    CONCESSION,
    NOTED,
    _bench,
    doubted,
    events,
    noted,
    open_nonconformances_of,
    patched,
    quality_assurance,
)
from tests.accept.certificate.verify.test_statements import PHRASE, accept, certified, plainly, unit, verified

__all__ = ["_bench"]
TECHNICIAN = KeyHolder("Test Technician")


def test_an_attempt_that_nobody_declared_void(tmp_path: Path) -> None:
    """An event says that it is void, under the name of quality assurance and without her signature."""
    certified(tmp_path, "A-1", stroke=181.7)
    rejected = events("B-1", UnitJudged.KIND)[-1]
    with open_store() as store:
        store.write(AttemptVoided(1, rejected.seq, "a wrong lead", event=rejected.hash), "B-1", who=KeyHolder("Grace"))
    with patched() as m:
        m.setattr(services, "counted", lambda _, found: found)
        doubted(verified(certified(tmp_path, "A-2", stroke=366.2)), "another end of the attempts before")
    done = verified(certified(tmp_path, "A-3", stroke=367.3))
    assert plainly(done)
    assert "before: 1 accepted, 1 rejected" in done.stderr


def test_who_declared_an_attempt_void_is_who_signed_that(tmp_path: Path) -> None:
    certified(tmp_path, "A-1", stroke=181.7)
    assert accept("store", "void", "B-1", 1, "--reason", "a wrong lead").exit_code == 0
    carried = events("B-1", AttemptVoided.KIND)[-1]
    with open_store() as store:
        store.append(carried.what, "B-1", carried.data, who="Ada Lovelace")
    done = verified(certified(tmp_path, "A-1", stroke=181.7))
    assert "declared void: a wrong lead (Grace, " in done.stderr
    assert "Ada" not in done.output


def test_a_judgement_that_is_undone_is_still_a_unit_of_the_store(tmp_path: Path) -> None:
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    with open_store() as store:
        store.write(EntryUndone(events("A-01", UnitJudged.KIND)[-1].seq), "A-01", who=TECHNICIAN)
    with patched():
        pdf = certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95)
    doubted(verified(pdf), "nobody told its serial apart: A-O1 differs from A-01")


@pytest.mark.parametrize("note", [NOTED, ""], ids=["held", "rejected"])
def test_a_countersignature_is_about_what_was_countersigned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, note: str
) -> None:
    """It is told to the store of another bench, which has another nonconformance of the unit beside its certificate."""
    bench, other = home(), tmp_path / "other"
    shutil.copytree(bench, other)
    folder, pdf = unit(tmp_path / "A-1", stroke=365.5 if note else 181.7), tmp_path / "A-1.pdf"
    again = ("report", folder, "--spec", "apa-basic", "--out", pdf, "--reason", "again")
    folder.joinpath("unit.toml").write_text(folder.joinpath("unit.toml").read_text() + note)
    accept(*again)
    assert accept("countersign", pdf, *CONCESSION).exit_code == 0
    told = events("B-1", "certificate_signed")
    monkeypatch.setenv("ACCEPT_HOME", str(other))
    noted("B-1", "stiffness", "frame cracked")
    unit(tmp_path / "A-1")
    accept(*again)
    with open_store() as store:
        for event in told:
            store.append(event.what, "B-1", event.data, who=event.who, spec=event.spec)
    assert "stiffness: frame cracked (Test Technician)" in open_nonconformances_of("B-1")
    assert "held until quality assurance decides: stiffness: frame cracked" in accept(*again).output


def keys_of_days_ago(days: int) -> None:
    shutil.rmtree(home() / "keys")
    with pytest.MonkeyPatch.context() as m:
        clock = type("Clock", (datetime,), {"now": classmethod(lambda *_: datetime.now(UTC) - timedelta(days=days))})
        for module in (authority, keys):
            m.setattr(module, "datetime", clock, raising=False)
        keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple", authority_passphrase="authority phrase")


def test_a_clock_that_was_set_back_to_before_a_calibration_ran_out(tmp_path: Path) -> None:
    today = datetime.now(UTC)
    keys_of_days_ago(60)
    (tmp_path / "bench.toml").write_text(BENCH.replace("2025-01-01", f"{today - timedelta(days=20):%Y-%m-%d}"))
    certified(tmp_path, "C-1", serial="C-1", stroke=366.5, sensor=4.9)
    back, pdf, own = today - timedelta(days=30), tmp_path / "A-1.pdf", commissioning.bench_statement
    with patched(back) as m:
        m.setattr(services, "bench_statement", lambda file, checks, _, *more: own(file, checks, back.date(), *more))
        bench = ("--bench", tmp_path / "bench.toml")
        accept("report", unit(tmp_path / "A-1"), "--spec", "apa-basic", "--out", pdf, *bench)
    doubted(verified(pdf), f"the clock was set back: event 4 (unit_judged B-1) is dated {back:%Y-%m-%d}")


def test_a_clock_that_was_set_back_to_before_a_technician_left(tmp_path: Path) -> None:
    """It was revoked some time before for the day on which he leaves."""
    today = datetime.now(UTC)
    keys_of_days_ago(60)
    left = f"{today - timedelta(days=20):%Y-%m-%d}"
    with patched(today - timedelta(days=40)):
        assert accept("keys", "revoke", "Test Technician", "--reason", "left", "--since", left).exit_code == 0
    with open_store() as store:
        store.append("batch_finished", "", {"verdicts": {}, "refused": 0}, who="Grace")
    with patched(today - timedelta(days=30)) as m:
        m.setattr(keys, "check_usable", lambda *_: None)
        pdf = certified(tmp_path, "A-1")
    doubted(verified(pdf), "the key of Test Technician was revoked in this bench's store")


def test_a_clock_that_was_ahead_once_is_no_doubt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither now nor when that time has come."""
    (tmp_path / "bench.toml").write_text(BENCH.replace("2025-01-01", "2099-01-01"))
    with patched(datetime.now(UTC) + timedelta(days=40)), open_store() as store:
        store.append("batch_finished", "", {"verdicts": {}, "refused": 0}, who="Test Technician")
    pdf, bench = tmp_path / "A-1.pdf", ("--bench", tmp_path / "bench.toml")
    accept("report", unit(tmp_path / "A-1"), "--spec", "apa-basic", "--out", pdf, *bench)
    assert plainly(verified(pdf))
    monkeypatch.setattr(Store, "latest_time", lambda store, seq: next(iter(store.events())).time if seq > 1 else "")
    assert plainly(verified(pdf))


def test_a_view_is_no_table_of_a_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It may show other events to a question than to who walks the chain."""
    pdf, database = certified(tmp_path, "A-1"), home() / DATABASE
    with sqlite3.connect(database, isolation_level=None) as plain:
        plain.execute("ALTER TABLE events RENAME TO real_events")
        plain.execute("CREATE VIEW events AS SELECT * FROM real_events")
    plain.close()
    quality_assurance(tmp_path / "qa", monkeypatch, database)
    doubted(verified(pdf), "the tables are not those of this store: events.code")


def test_a_bench_that_rejected_a_unit_says_so_of_a_certificate_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, other = home(), tmp_path / "other"
    shutil.copytree(bench / "keys", other / "keys", ignore=shutil.ignore_patterns("bench.*"))
    first = certified(tmp_path, "A-1", stroke=181.7)
    monkeypatch.setenv("ACCEPT_HOME", str(other))
    assert accept("keys", "request", "--role", "bench", "--name", "bench 2").exit_code == 0
    assert accept("keys", "issue", other / "keys" / "bench.request.pem").exit_code == 0
    pdf = certified(tmp_path, "A-2")
    assert plainly(verified(pdf))
    assert "does not know" not in verified(first).stdout
    monkeypatch.setenv("ACCEPT_HOME", str(bench))
    assert "'rejected', that it does not know" in verified(pdf).stdout


def test_a_unit_that_quality_assurance_scrapped_and_that_is_measured_again(tmp_path: Path) -> None:
    pdf = certified(tmp_path, "A-1", stroke=181.7)
    assert accept("countersign", pdf, "--disposition", "scrap", "--because", "broken").exit_code == 0
    assert "decided before" not in verified(pdf).stdout
    again = certified(tmp_path, "A-2", stroke=366.2)
    assert "B-1 accepted; quality assurance decided before it was judged: scrap;" in verified(again).stdout
    assert accept("countersign", again).exit_code == 0
