"""A technician with a patched program who adds events to the bench's store, sets its clock back, or uses another bench:
what a clean program says of what he signed. And somebody without a key, who edits, deletes and puts back files."""

import hashlib
import re
import shutil
import sqlite3
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives.asymmetric import ec

from accept.base.documents.results import UnitHeader
from accept.base.home import home
from accept.base.names import KeyHolder
from accept.batch import services
from accept.certificate import rejudge
from accept.certificate.signature.signing import sign
from accept.certificate.trust import authority, commissioning, keys, revocation
from accept.certificate.trust.commissioned import claim_of, is_proven
from accept.certificate.trust.keys import QA
from accept.certificate.trust.keys import TECHNICIAN as TECHNICIANS
from accept.certificate.verify import against_store
from accept.commands.trust import approve_spec
from accept.fleet.golden import check
from accept.judging.reservations import parts_below
from accept.store import START, open_store
from accept.store import store as reading
from accept.store.opening import DATABASE
from accept.store.payloads import (
    KINDS,
    AttemptStarted,
    AttemptVoided,
    CertificateSigned,
    EntryUndone,
    InstrumentChecked,
    KeysRevoked,
    SerialConfirmed,
    UnitJudged,
)
from accept.store.store import Store
from checks.verdict import UnitVerdict
from specs.files import json_of
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
from tests.accept.certificate.verify.test_statements import PHRASE, accept, certified, own_spec, plainly, unit, verified
from tests.accept.certificate.verify.verify_help import verify

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
    """Of an authority of that day."""
    shutil.rmtree(home() / "keys")
    with pytest.MonkeyPatch.context() as m:
        clock = type("Clock", (datetime,), {"now": classmethod(lambda *_: datetime.now(UTC) - timedelta(days=days))})
        for module in (authority, keys):
            m.setattr(module, "datetime", clock, raising=False)
        keys.init(home(), PHRASE, "Test Technician", "Grace", "battery staple", authority_passphrase="authority phrase")


def set_back(tmp_path: Path) -> Path:
    """A certificate by a clock that was set back by 30 days, to before a calibration ran out."""
    today = datetime.now(UTC)
    keys_of_days_ago(60)
    (tmp_path / "bench.toml").write_text(BENCH.replace("2025-01-01", f"{today - timedelta(days=20):%Y-%m-%d}"))
    certified(tmp_path, "C-1", serial="C-1", stroke=366.5, sensor=4.9)
    back, pdf, own = today - timedelta(days=30), tmp_path / "A-1.pdf", commissioning.bench_statement
    with patched(back) as m:
        m.setattr(services, "bench_statement", lambda file, checks, _, *more: own(file, checks, back.date(), *more))
        bench = ("--bench", tmp_path / "bench.toml")
        accept("report", unit(tmp_path / "A-1"), "--spec", "apa-basic", "--out", pdf, *bench)
    return pdf


def test_a_clock_that_was_set_back_to_before_a_calibration_ran_out(tmp_path: Path) -> None:
    pdf, back = set_back(tmp_path), datetime.now(UTC) - timedelta(days=30)
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
    monkeypatch.setattr(Store, "latest_times", lambda store, seq: [next(iter(store.events())).time][: seq - 1])
    assert plainly(verified(pdf))


def test_a_clock_that_is_still_set_back_when_it_is_verified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the same bench, where quality assurance would countersign; and with the list that it publishes."""
    pdf, now = set_back(tmp_path), datetime.now(UTC) - timedelta(days=29)
    clock = type("Clock", (datetime,), {"now": classmethod(lambda *_: now)})
    with monkeypatch.context() as m:
        for module in (reading, against_store):
            m.setattr(module, "datetime", clock)
        done = verified(pdf)
    words = f"the clock is or was wrong: event 4 (unit_judged B-1) is dated {now - timedelta(days=1):%Y-%m-%d}"
    assert f"B-1 accepted; {words}" in done.stdout, done.output
    listed, away = tmp_path / "list.json", tmp_path / "away"
    assert accept("store", "publish", listed).exit_code == 0
    away.mkdir()
    for name in ("ca.pem", "ca.crl.pem"):
        shutil.copy(home() / "keys" / name, away)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "none"))
    doubted(
        verified(pdf, "--trust", away / "ca.pem", "--log", listed), "the clock was set back: its judgement is dated"
    )


def test_a_view_is_no_table_of_a_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It may show other events to a question than to who walks the chain."""
    pdf, database = certified(tmp_path, "A-1"), home() / DATABASE
    with sqlite3.connect(database, isolation_level=None) as plain:
        plain.execute("ALTER TABLE events RENAME TO real_events")
        plain.execute("CREATE VIEW events AS SELECT * FROM real_events")
    plain.close()
    quality_assurance(tmp_path / "qa", monkeypatch, database)
    doubted(verified(pdf), "the tables are not those of this store: events.code")


def test_a_virtual_table_is_no_table_of_a_store(tmp_path: Path) -> None:
    """Its content may be a view."""
    pdf = certified(tmp_path, "A-1")
    with sqlite3.connect(home() / DATABASE, isolation_level=None) as plain:
        columns = ", ".join(row[1] for row in plain.execute("PRAGMA table_info(events)"))
        plain.execute("ALTER TABLE events RENAME TO real_events")
        made = plain.execute("SELECT name FROM sqlite_master WHERE type = 'index' AND sql IS NOT NULL").fetchall()
        plain.execute("CREATE VIEW shown AS SELECT * FROM real_events")
        plain.execute(f"CREATE VIRTUAL TABLE events USING fts5({columns}, content='shown', content_rowid='seq')")
        for (name,) in made:
            plain.execute(f"DROP INDEX {name}")
            plain.execute(f"CREATE INDEX {name} ON real_events (what)")
    plain.close()
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


def with_bench_file(place: Path, name: str, text: str, spec: object = "apa-basic", **more: Any) -> Path:
    (place / "bench.toml").write_text(text)
    bench, pdf = ("--bench", place / "bench.toml"), place / f"{name}.pdf"
    accept("report", unit(place / name, **more), "--spec", spec, "--out", pdf, "--reason", "measured again", *bench)
    return pdf


def compared(E_n: float) -> InstrumentChecked:
    now = datetime.now(UTC).isoformat(timespec="seconds")
    keys_of_event = {"instrument": "tip", "serial": "12", "time": now, "what": "gauge block", "certificate": "G-1"}
    values = {"reference": 0.0, "U_reference": 0.6, "value": E_n, "U": 0.8, "readings": (E_n,)}
    outcome = {"E_n": E_n, "passed": abs(E_n) <= 1, "evidence": {}}
    return InstrumentChecked(**{**keys_of_event, "unit": "um", **values, **outcome})  # type: ignore[arg-type]


def spec_with_reference(path: Path) -> Path:
    own_spec(path).write_text(path.read_text().replace("[checks.stroke]\n", "[checks.stroke]\nreference_days = 1\n", 1))
    return path


def test_a_comparison_with_a_reference_that_was_not_passed_is_not_left_out(tmp_path: Path) -> None:
    """It was passed in the morning."""
    spec, text = spec_with_reference(tmp_path / "mine.toml"), BENCH.replace("2025-01-01", "2099-01-01")
    for E_n in (0.5, 3.0):
        with open_store() as store:
            store.write(compared(E_n), who=TECHNICIAN)
    all_of_them = services.days_checked
    with patched() as m:
        m.setattr(services, "days_checked", lambda *a: {name: days[:1] for name, days in all_of_them(*a).items()})
        pdf = with_bench_file(tmp_path, "A-1", text, spec)
    doubted(verified(pdf), "the bench's store has a later comparison, not passed, of tip with its reference")


def test_a_comparison_is_what_its_values_say(tmp_path: Path) -> None:
    """The event says another E_n than its values, which judging reads."""
    with open_store() as store:
        store.write(replace(compared(0.5), E_n=0.1), who=TECHNICIAN)
    spec = spec_with_reference(tmp_path / "mine.toml")
    assert plainly(verified(with_bench_file(tmp_path, "A-1", BENCH.replace("2025-01-01", "2099-01-01"), spec)))


def test_what_is_said_of_a_commissioning_is_signed_by_who_is_named(tmp_path: Path) -> None:
    text, said = BENCH.replace("2025-01-01", "2099-01-01"), "commissioned on 2026-11-01 by Grace Hopper"
    with patched() as m:
        m.setattr(commissioning, "commissioned", lambda *_: {"tip": {"commissioned": said}})
        pdf = with_bench_file(tmp_path, "A-1", text)
    doubted(verified(pdf), "what is said of the commissioning of tip is not signed by a technician")


def test_a_commissioning_of_another_instrument_proves_nothing(tmp_path: Path) -> None:
    """The technician's own signature, but of an instrument with another serial number."""
    record = {"subject": "x", "model": "X", "serial": "13", "on": "2026-11-01", "passed": True}
    file = json_of(commissioning.signed(record, keys.unlock(home(), TECHNICIANS, PHRASE)))
    given = {**claim_of(record), "certificate": file["certificate"], "signature": file["signature"]}
    row = {"commissioned": "commissioned on 2026-11-01 by Test Technician", "commissioning": given, "model": "X"}
    roots = [keys.ca(home())]
    assert is_proven({**row, "serial": "13"}, roots)
    assert not is_proven({**row, "serial": "12"}, roots)
    assert not is_proven({**row, "serial": "13", "commissioned": row["commissioned"] + "0"}, roots)
    assert not is_proven({**row, "serial": "13", "commissioning": given | {"on": "2026-11-02"}}, roots)
    assert not is_proven({**row, "serial": "13"}, [])


def test_the_day_of_a_commissioning_is_a_day(tmp_path: Path) -> None:
    """Words in its place could name another person before the one who signed."""
    day = "2026-11-01 by Grace Hopper, checked"
    record = {"subject": "x", "model": "X", "serial": "12", "on": day, "passed": True}
    file = json_of(commissioning.signed(record, keys.unlock(home(), TECHNICIANS, PHRASE)))
    given = {**claim_of(record), "certificate": file["certificate"], "signature": file["signature"]}
    row = {"commissioned": f"commissioned on {day} by Test Technician", "commissioning": given}
    assert not is_proven({**row, "model": "X", "serial": "12"}, [keys.ca(home())])


def test_a_key_that_had_run_out_does_not_sign_with_its_clock_set_back(tmp_path: Path) -> None:
    keys_of_days_ago(365 * 5 + 30)
    with open_store() as store:
        store.append("batch_finished", "", {"verdicts": {}, "refused": 0}, who="Grace")
    with patched(datetime.now(UTC) - timedelta(days=60)) as m:
        m.setattr(keys, "check_usable", lambda *_: None)
        pdf = certified(tmp_path, "A-1")
    doubted(verified(pdf), "when the key of Test Technician had run out")


def test_quality_assurance_who_left_does_not_countersign_with_the_clock_set_back(tmp_path: Path) -> None:
    keys_of_days_ago(60)
    assert accept("keys", "revoke", "Grace", "--reason", "left").exit_code == 0
    back = datetime.now(UTC) - timedelta(days=2)
    with patched(back) as m:
        m.setattr(keys, "check_usable", lambda *_: None)
        pdf = certified(tmp_path, "A-1")
        assert plainly(verified(pdf))
        grace = keys.unlock(home(), QA, "battery staple")
    pdf.write_bytes(sign(pdf.read_bytes(), grace, back + timedelta(minutes=1)))
    doubted(verified(pdf), "the key of Grace was revoked in this bench's store, event 1, before it signed")


@pytest.mark.parametrize("made_by", ["nobody", "the technician"])
def test_a_list_of_revoked_keys_that_the_authority_did_not_sign_revokes_nothing(tmp_path: Path, made_by: str) -> None:
    ca, listed = keys.ca(home()), "no list"
    if made_by == "the technician":
        number = keys.unlock(home(), TECHNICIANS, PHRASE).certificate.serial_number
        entry = revocation.Revoked(number, datetime.now(UTC) - timedelta(days=1), compromised=False)
        listed = revocation.made(ca, ec.generate_private_key(ec.SECP256R1()), [entry], 5).decode()
    with open_store() as store:
        store.write(KeysRevoked(authority.fingerprint(ca), 5, listed), who=TECHNICIAN)
    assert plainly(verified(certified(tmp_path, "A-1")))


def test_the_number_of_a_list_of_revoked_keys_is_that_of_the_list(tmp_path: Path) -> None:
    """Else a technician makes the newest list of every recipient an older one, for ever: lists only grow."""
    assert accept("keys", "revoke", "Grace", "--reason", "left").exit_code == 0
    stored = KeysRevoked.of(events("", KeysRevoked.KIND)[-1])
    with open_store() as store:
        store.write(KeysRevoked(stored.authority, 10**9, stored.crl), who=TECHNICIAN)
    pdf = certified(tmp_path, "A-1")
    assert accept("store", "publish", tmp_path / "list.json").exit_code == 0
    assert plainly(verified(pdf, "--log", tmp_path / "list.json"))


def test_what_is_told_to_the_store_of_another_bench_does_not_make_it_current(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The unit was rejected at its own bench since."""
    other = tmp_path / "other"
    shutil.copytree(home() / "keys", other / "keys", ignore=shutil.ignore_patterns("bench.*"))
    pdf = certified(tmp_path, "A-1").rename(tmp_path / "first.pdf")
    judged, signed = (events("B-1", kind)[-1] for kind in (UnitJudged.KIND, CertificateSigned.KIND))
    stated = events("", "bench_stated")[-1]
    then = datetime.fromisoformat(judged.time)
    certified(tmp_path, "A-1", stroke=181.7)
    monkeypatch.setenv("ACCEPT_HOME", str(other))
    assert accept("keys", "request", "--role", "bench", "--name", "bench 2").exit_code == 0
    assert accept("keys", "issue", other / "keys" / "bench.request.pem").exit_code == 0
    with patched(then), open_store() as store:
        store.append(stated.what, "", stated.data, who=stated.who)
        number = store.append(judged.what, "B-1", judged.data, who=judged.who, spec=judged.spec).seq
        store.append(signed.what, "B-1", {**signed.data, "judged": number}, who=signed.who, spec=signed.spec)
    done = verified(pdf, "--require", "accepted,current")
    assert done.exit_code == 3, done.output
    assert "neither a store nor a list was asked for later attempts" in done.stdout
    assert "not looked up, the word of bench and technician: provenance.attempt" in done.stderr


def test_a_certificate_that_states_an_empty_store_is_compared_with_the_bench_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At quality assurance, whose machine is another bench."""
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    with open_store() as store, patched() as m:
        empty = store.sealer.signed_head(START) if store.sealer else None
        m.setattr(Store, "signed_head", lambda *_: empty)
        pdf = certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95)
    quality_assurance(tmp_path / "qa", monkeypatch, home() / DATABASE)
    doubted(verified(pdf), "nobody told its serial apart: A-O1 differs from A-01")


def test_a_later_event_does_not_hide_that_quality_assurance_scrapped_the_unit(tmp_path: Path) -> None:
    pdf = certified(tmp_path, "A-1", stroke=181.7)
    assert accept("countersign", pdf, "--disposition", "scrap", "--because", "broken").exit_code == 0
    signed = events("B-1", CertificateSigned.KIND)[-1]
    with open_store() as store:
        told = {**signed.data, "disposition": {"choice": "rework", "reason": "x"}, "sha256": "0" * 64}
        store.append(signed.what, "B-1", told, who="Grace")
    again = certified(tmp_path, "A-2", stroke=366.2)
    assert "B-1 accepted; quality assurance decided before it was judged: scrap" in verified(again).stdout


def test_an_attempt_that_the_workflow_began_as_simulated(tmp_path: Path) -> None:
    """The mark was deleted in `unit.toml`, with an editor."""
    with open_store() as store:
        store.write(AttemptStarted(1, "apa", {}, "first", simulated=True), "B-1", who=TECHNICIAN)
    pdf = certified(tmp_path / "B-1", "attempt-1")
    doubted(verified(pdf), "the bench's store has its attempt as one that no instrument measures")
    with open_store() as store:
        store.write(AttemptStarted(2, "apa", {}, "measured"), "B-1", who=TECHNICIAN)
    second = verified(certified(tmp_path / "B-1", "attempt-2", stroke=366.2))
    assert plainly(second)
    assert "B-1 accepted; the bench's store has an attempt as one that no instrument measures;" in second.stdout
    doubted(verified(certified(tmp_path / "B-1", "attempt-1")), "as one that no instrument measures")


def test_a_key_that_was_renewed_and_lost_is_revoked_with_both_certificates(tmp_path: Path) -> None:
    """The first one is valid still, and whoever finds the key can set the clock to any day."""
    pdf = certified(tmp_path, "A-1")
    time.sleep(1.0)  # a key that is revoked within the second of a signature was revoked before it
    assert accept("keys", "renew", "Test Technician").exit_code == 0
    assert accept("keys", "revoke", "Test Technician", "--reason", "lost").exit_code == 0
    doubted(verified(pdf), "the key of Test Technician was lost or compromised")


# --- no doubt ends unsaid ------------------------------------------------------------------------------------------

SCRAP = ("--disposition", "scrap", "--because", "broken")


def with_part(place: Path, name: str, part: str, stroke: float = 367.5) -> Path:
    folder, pdf = unit(place / name, serial=name, stroke=stroke, sensor=4.9), place / f"{name}.pdf"
    with folder.joinpath("unit.toml").open("a") as file:
        file.write(f'[parts]\napa = "{part}"\n')
    accept("report", folder, "--spec", "apa-basic", "--out", pdf, "--reason", "x")
    return pdf


def test_a_unit_that_quality_assurance_scrapped_without_a_certificate(tmp_path: Path) -> None:
    """What held it then holds it no more, as it is measured anew."""
    for stroke in (365.5, 181.7, 365.5):
        certified(tmp_path, "A-1", stroke=stroke)
    assert accept("store", "dispose", "B-1", *SCRAP).exit_code == 0
    again = certified(tmp_path, "A-2", stroke=366.2, sensor=4.95, last=-4.2)
    assert "B-1 accepted; quality assurance decided: scrap;" in verified(again).stdout


def test_a_part_that_quality_assurance_scrapped_and_that_is_measured_again(tmp_path: Path) -> None:
    rejected = certified(tmp_path, "first", serial="P-1", stroke=181.7)
    assert accept("countersign", rejected, *SCRAP).exit_code == 0
    certified(tmp_path, "second", serial="P-1", stroke=366.2)
    done = verified(with_part(tmp_path, "S-1", "P-1"))
    assert "'apa P-1': quality assurance decided before it was judged: scrap;" in done.stdout
    assert "'apa P-1': accepted after attempt 1 was rejected on 20" in done.stdout


def test_a_judgement_of_a_part_that_nobody_made(tmp_path: Path) -> None:
    certified(tmp_path, "P-1", serial="P-1", stroke=181.7)
    event = events("P-1", UnitJudged.KIND)[-1]
    made_up = UnitJudged.of(event)
    made_up = replace(made_up, result=replace(made_up.result, verdict=UnitVerdict.ACCEPTED))
    with open_store() as store:
        store.write(made_up, "P-1", who=TECHNICIAN, spec=event.spec)
    assert (
        "'apa P-1': accepted after attempt 1 was rejected on 20" in verified(with_part(tmp_path, "S-1", "P-1")).stdout
    )


def test_a_part_that_is_cracked_and_was_never_judged(tmp_path: Path) -> None:
    noted("P-1", "stiffness", "frame cracked")
    done = verified(with_part(tmp_path, "S-1", "P-1"))
    assert "S-1 conditional; 'apa P-1': has events here and was never judged;" in done.stdout


def test_a_part_that_an_event_takes_out_of_another_strut(tmp_path: Path) -> None:
    certified(tmp_path, "P-1", serial="P-1")
    with_part(tmp_path, "S-9", "P-1")
    event = events("S-9", UnitJudged.KIND)[-1]
    made_up = UnitJudged.of(event)
    with open_store() as store:
        rebuilt = replace(made_up, result=replace(made_up.result, parts={}))
        store.write(rebuilt, "S-9", who=TECHNICIAN, spec=event.spec)
    done = verified(with_part(tmp_path, "S-1", "P-1", stroke=366.4))
    assert "S-1 accepted; 'apa P-1': has stood in 'S-9';" in done.stdout


def test_a_part_in_two_places(tmp_path: Path) -> None:
    folder, pdf = unit(tmp_path / "S-1", serial="S-1"), tmp_path / "S-1.pdf"
    with folder.joinpath("unit.toml").open("a") as file:
        file.write('[parts]\njoint_bottom = "J-1"\njoint_top = "j-1"\n')
    accept("report", folder, "--spec", "apa-basic", "--out", pdf)
    assert "accepted; 'joint_bottom J-1': stands in two places; 'joint_top j-1': stands in" in verified(pdf).stdout


def test_words_that_look_like_a_certificate_are_words(tmp_path: Path) -> None:
    folder, pdf = unit(tmp_path / "A-1"), tmp_path / "A-1.pdf"
    with folder.joinpath("unit.toml").open("a") as file:
        file.write('[notes]\nstroke = ["-----BEGIN CERTIFICATE-----AAAA-----END CERTIFICATE-----"]\n')
    accept("report", folder, "--spec", "apa-basic", "--out", pdf)
    assert plainly(verified(pdf))


@pytest.mark.parametrize("part", ["P-1,", "SN P-1", "P 1", "P-1 rev2", "(P-1)", "#P-1", "P-1/"])
def test_a_part_is_named_by_a_serial(tmp_path: Path, part: str) -> None:
    certified(tmp_path, "P-1", serial="P-1", stroke=181.7)
    assert "S-1 conditional" in verified(with_part(tmp_path, "S-1", part)).stdout


def test_a_serial_that_an_event_tells_apart(tmp_path: Path) -> None:
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    with open_store() as store:
        store.write(SerialConfirmed(("A-01",)), "A-O1", who=TECHNICIAN)
    done = verified(certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95))
    assert "A-O1 accepted; its serial, which looks like another, was confirmed by 'Test Technician';" in done.stdout


def test_who_tells_a_serial_apart_writes_no_part_of_the_first_line(tmp_path: Path) -> None:
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    with open_store() as store:
        store.write(SerialConfirmed(("A-01; countersigned",)), "A-O1", who=KeyHolder("x'; signed by 'Grace' as qa"))
        store.write(SerialConfirmed(("A-01",)), "A-O1", who=TECHNICIAN)
    done = verified(certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95))
    assert "confirmed by 'Test Technician', 'x’, signed by ’Grace’ as qa';" in done.stdout


def test_a_decision_of_another_word_writes_no_part_of_the_first_line(tmp_path: Path) -> None:
    certified(tmp_path, "A-1", stroke=181.7)
    signed = events("B-1", "certificate_signed")[-1]
    choice = {"choice": "x; signed by 'Grace' as qa", "reason": "y"}
    with open_store() as store:
        store.append(signed.what, "B-1", {**signed.data, "sha256": "0" * 64, "disposition": choice}, who="Grace")
    done = verified(certified(tmp_path, "A-2", stroke=366.2))
    assert "decided before it was judged: 'x, signed by ’Grace’ as qa';" in done.stdout


def test_a_comparison_that_was_passed_after_one_that_was_not(tmp_path: Path) -> None:
    spec = spec_with_reference(tmp_path / "mine.toml")
    for E_n in (3.0, 0.5):
        with open_store() as store:
            store.write(compared(E_n), who=TECHNICIAN)
    done = verified(with_bench_file(tmp_path, "A-1", BENCH.replace("2025-01-01", "2099-01-01"), spec))
    assert "'tip' missed its reference before, last on 20" in done.stdout


def test_the_store_has_an_event_of_a_kind_that_is_not_known(tmp_path: Path) -> None:
    """Of a newer program, which shares the store."""
    pdf = certified(tmp_path, "A-1")
    with open_store() as store:
        store.append("bench_moved", "", {}, who="Grace")
    assert "B-1 accepted; the bench's store has 'event 4 (bench_moved)', of a kind" in verified(pdf).stdout
    with open_store() as store:
        store.append("unit_scrapped", "B-1", {"reason": "broken"}, who="Grace")
    doubted(verified(pdf), "'event 5 (unit_scrapped B-1)', 'event 4 (bench_moved)', of a kind")


def test_a_table_of_certificates_says_what_the_first_line_says(tmp_path: Path) -> None:
    folder = tmp_path / "certificates"
    own_spec(tmp_path / "mine.toml")
    certified(folder, "A-1", spec=str(tmp_path / "mine.toml"))
    done = verified(folder)
    assert (done.exit_code, "A-1.pdf: B-1 accepted; spec NOT APPROVED" in done.stdout) == (0, True)


def test_who_left_is_named_away_from_the_bench_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only a clock says that the technician signed before."""
    pdf = certified(tmp_path, "A-1")
    assert plainly(verified(pdf))
    time.sleep(1.0)  # a key that is revoked within the second of a signature was revoked before it
    assert accept("keys", "revoke", "Test Technician", "--reason", "left").exit_code == 0
    away = tmp_path / "away"
    away.mkdir()
    for name in ("ca.pem", "ca.crl.pem"):
        shutil.copy(home() / "keys" / name, away)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "none"))
    done = verified(pdf, "--trust", away / "ca.pem")
    assert "B-1 accepted; the key of 'Test Technician' was revoked on 20" in done.stdout


def test_a_key_that_ran_out_since_is_named(tmp_path: Path) -> None:
    pdf = certified(tmp_path, "A-1").read_bytes()
    trust = [keys.ca(home())]
    assert "ran out" not in verify(pdf, trust, rejudge).reason
    later = verify(pdf, trust, rejudge, datetime.now(UTC) + timedelta(days=365 * 5 + 2))
    assert later.valid
    assert "B-1 accepted; the key of 'Test Technician' ran out on 20" in later.reason


def test_a_serial_that_is_taken_for_one_of_this_bench_is_named_on_a_certificate_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    bench, other = home(), tmp_path / "other"
    shutil.copytree(bench / "keys", other / "keys", ignore=shutil.ignore_patterns("bench.*"))
    with monkeypatch.context() as m:
        m.setenv("ACCEPT_HOME", str(other))
        assert accept("keys", "request", "--role", "bench", "--name", "bench 2").exit_code == 0
        assert accept("keys", "issue", other / "keys" / "bench.request.pem").exit_code == 0
        pdf = certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95)
    assert "A-O1 accepted; nobody told its serial apart: A-O1 differs from A-01" in verified(pdf).stdout


def test_a_spec_of_which_a_newer_version_is_approved(tmp_path: Path) -> None:
    older, newer = own_spec(tmp_path / "mine.toml"), tmp_path / "newer.toml"
    newer.write_text(older.read_text().replace("upper = 5.5", "upper = 5.4"))
    assert newer.read_text() != older.read_text()
    assert accept("spec", "approve", older).exit_code == 0
    before = certified(tmp_path, "A-1", spec=str(older))
    time.sleep(1.0)  # an approval states whole seconds
    assert accept("spec", "approve", newer).exit_code == 0
    time.sleep(1.0)
    pdf = certified(tmp_path, "A-2", spec=str(older), serial="B-2", stroke=366.2, sensor=4.95)
    assert "B-2 accepted; a newer version of its spec was approved on 20" in verified(pdf).stdout
    assert "newer version" not in verified(before).stdout


def test_who_approved_the_spec_and_left_is_named(tmp_path: Path) -> None:
    spec = own_spec(tmp_path / "mine.toml")
    assert accept("spec", "approve", spec).exit_code == 0
    pdf = certified(tmp_path, "A-1", spec=str(spec))
    time.sleep(1.0)
    assert accept("keys", "revoke", "Grace", "--reason", "left").exit_code == 0
    assert "B-1 accepted; the key of 'Grace' was revoked on 20" in verified(pdf).stdout


def test_a_certificate_that_its_store_was_never_told_of_is_not_of_another_bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At quality assurance, whose machine is another bench: the technician signed it over a store of his own."""
    certified(tmp_path, "first", serial="A-01", stroke=181.7)
    bench, own = home() / DATABASE, tmp_path / "own"
    shutil.copytree(home(), own, ignore=shutil.ignore_patterns("store*"))
    with monkeypatch.context() as m:
        m.setenv("ACCEPT_HOME", str(own))
        certified(tmp_path, "filler", serial="C-1", stroke=367.7)
        pdf = certified(tmp_path, "second", serial="A-O1", stroke=366.2, sensor=4.95)
    quality_assurance(tmp_path / "qa", monkeypatch, bench)
    doubted(verified(pdf), "this bench's store does not hold event")


def test_the_documentation_says_of_every_kind_of_event_what_it_may_end() -> None:
    text = (Path(__file__).parents[4] / "docs/explanation/what-a-certificate-proves.md").read_text()
    table = text.partition("| kinds of event |")[2].partition("\n\n")[0]
    listed = [name for row in table.splitlines()[2:] for name in re.findall(r"`(\w+)`", row.split("|")[1])]
    assert sorted(listed) == sorted(KINDS)


def built(place: Path, serial: str, part: str, stroke: float = 366.2, sensor: float = 4.95) -> Path:
    """Certified with a part."""
    pdf, folder = place / f"{serial}.pdf", unit(place / serial, serial=serial, stroke=stroke, sensor=sensor)
    with folder.joinpath("unit.toml").open("a") as file:
        file.write(f'[parts]\napa = "{part}"\n')
    accept("report", folder, "--spec", "apa-basic", "--out", pdf, "--reason", "built in")
    return pdf


def loose(path: Path) -> Path:
    own_spec(path).write_text(path.read_text().replace("lower = 304.0", "lower = 1.0"))
    return path


def test_a_part_by_a_spec_that_nobody_approved(tmp_path: Path) -> None:
    spec = loose(tmp_path / "mine.toml")
    certified(tmp_path, "A-1", serial="A-1", stroke=150.5, spec=str(spec))
    done = verified(built(tmp_path, "S-1", "A-1"))
    assert plainly(done)
    assert "S-1 accepted; 'apa A-1': was accepted by 'mine', spec NOT APPROVED; " in done.stdout
    assert accept("spec", "approve", spec).exit_code == 0
    assert "NOT APPROVED" not in verified(tmp_path / "S-1.pdf").stdout


def test_a_part_of_a_part_that_was_rejected_since(tmp_path: Path) -> None:
    certified(tmp_path, "K-1", serial="K-1", sensor=4.97)
    built(tmp_path, "A-1", "K-1")
    pdf = built(tmp_path, "S-1", "A-1", stroke=364.1, sensor=4.91)
    assert plainly(verified(pdf))
    certified(tmp_path, "K-1", serial="K-1", stroke=150.2, sensor=4.93)
    doubted(verified(pdf), "casts doubt on its parts: A-1's apa K-1 was judged 'rejected' on ")
    done = verified(built(tmp_path, "S-2", "A-1", stroke=361.1, sensor=4.92))
    assert done.stdout.startswith("valid: S-2 conditional;")


def test_a_part_that_is_left_out_of_a_new_measurement(tmp_path: Path) -> None:
    """Of the unit, and of a part, also by a judgement that nobody made."""
    built(tmp_path, "A-1", "K-1")
    certified(tmp_path, "A-1", serial="A-1", stroke=361.1, sensor=4.93)
    left_out = "was judged with 'apa K-1' before and names nothing in the place now"
    assert f"A-1 accepted; it {left_out}; " in verified(tmp_path / "A-1.pdf").stdout
    assert f"S-1 accepted; 'apa A-1': {left_out}; " in verified(built(tmp_path, "S-1", "A-1", stroke=364.1)).stdout


def test_parts_that_name_each_other_are_asked_once(tmp_path: Path) -> None:
    """By way of each of two parts on every level there would be two to the power of twenty."""
    certified(tmp_path, "A-1", serial="A-1")
    known, last = events("A-1", UnitJudged.KIND)[-1], ["A-1"]
    for level in range(20):
        with open_store() as store:
            now, parts = [f"L{level}-L", f"L{level}-R"], {f"p{n}": part for n, part in enumerate(last)}
            for serial in now:
                store.append(
                    known.what, serial, known.data | {"result": known.data["result"] | {"parts": parts}}, who="A"
                )
        last = now
    started = time.process_time()
    with open_store() as store:
        found = [*parts_below(store, UnitHeader(serial="S-1", kind="apa", parts={"l": last[0], "r": last[1]}))]
    assert len(found) == 2 + 19 * 4 + 2
    assert time.process_time() - started < 5.0  # 0.1 s


def test_a_certificate_of_another_unit_is_kept(tmp_path: Path) -> None:
    pdf = certified(tmp_path, "A-1", serial="A-1")
    before = pdf.read_bytes()
    accept("report", unit(tmp_path / "A-2", "A-2", 4.92, 361.1), "--spec", "apa-basic", "--out", pdf)
    assert (tmp_path / "A-1_superseded-1.pdf").read_bytes() == before
    assert "A-2 accepted" in verified(pdf).stdout


def test_a_unit_is_no_part_of_itself(tmp_path: Path) -> None:
    assert "S-1 conditional;" in verified(built(tmp_path, "S-1", "s-1")).stdout
    built(tmp_path, "A-1", "A-2")
    assert "A-2 conditional;" in verified(built(tmp_path, "A-2", "A-1", stroke=361.1, sensor=4.92)).stdout


def test_a_newer_approval_that_was_deleted(tmp_path: Path) -> None:
    """The store has it, with its signature."""
    old, new = loose(tmp_path / "mine.toml"), tmp_path / "new" / "mine.toml"
    new.parent.mkdir()
    new.write_text(old.read_text().replace("lower = 1.0", "lower = 300.0"))
    assert accept("spec", "approve", old).exit_code == 0
    time.sleep(1.1)  # an approval has whole seconds
    assert accept("spec", "approve", new).exit_code == 0
    (home() / "approved-specs" / f"{hashlib.sha256(new.read_bytes()).hexdigest()}.json").unlink()
    done = verified(certified(tmp_path, "A-1", stroke=150.5, spec=str(old)))
    assert "a newer version of its spec was approved on " in done.stdout


@pytest.mark.parametrize("wrong", ["ahead at the older one", "set back at the newer one"])
def test_approvals_count_in_the_order_of_their_events(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wrong: str
) -> None:
    """Not by the bench's clock, which a technician can set while quality assurance approves: an older version with
    wider limits is no revision of the newer one, and the first line names that."""
    now = datetime.now(UTC)
    old, new = loose(tmp_path / "mine.toml"), tmp_path / "new" / "mine.toml"
    new.parent.mkdir()
    new.write_text(old.read_text().replace("lower = 1.0", "lower = 300.0"))
    keys_of_days_ago(60)
    approved_on(old, now + timedelta(days=30) if wrong.startswith("ahead") else now - timedelta(days=1))
    approved_on(new, now - timedelta(days=20 if wrong.startswith("set") else 0))
    certified(tmp_path, "A-1", stroke=150.5, spec=str(new))
    pdf = tmp_path / "again.pdf"
    accept("report", tmp_path / "A-1", "--spec", old, "--out", pdf, "--reason", "the older one")
    assert "B-1 held" in (done := verified(pdf)).stdout, done.output
    done = verified(certified(tmp_path, "A-2", serial="B-2", stroke=151.5, sensor=4.95, spec=str(old)))
    assert "B-2 accepted; a newer version of its spec was approved on " in done.stdout, done.output
    words = "before its spec was approved"
    assert (words in done.stdout, done.exit_code) == ((True, 4) if wrong.startswith("ahead") else (False, 0))


def approved_on(spec: Path, day: datetime) -> None:
    with pytest.MonkeyPatch.context() as m:
        m.setattr(approve_spec, "datetime", type("Clock", (datetime,), {"now": classmethod(lambda *_: day)}))
        assert accept("spec", "approve", spec).exit_code == 0


def test_a_laboratory_that_was_put_away(tmp_path: Path) -> None:
    laboratory = home() / "laboratory.toml"
    laboratory.write_text('name = "Laboratory"\naddress = "Street 1"\n')
    assert "NOT AUTHORISED" in verified(certified(tmp_path, "A-1", serial="A-1")).stdout
    laboratory.rename(tmp_path / "away")
    pdf = certified(tmp_path, "A-2", serial="A-2", stroke=361.1, sensor=4.92)
    (tmp_path / "away").rename(laboratory)
    assert "A-2 accepted; its bench named a laboratory before, last on " in verified(pdf).stdout


@pytest.mark.parametrize(
    ("due", "how"), [("2025-01-01", ""), ("2099-01-01", ""), ("2025-01-01", "unnamed"), ("2025-01-01", "shared")]
)
def test_a_bench_file_that_was_left_out(tmp_path: Path, due: str, how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its expired instrument makes a finding conditional; without the option nothing is stated of it. how: a program
    that leaves its bench out of the judgement too; a store in which another bench judged many units meanwhile."""
    (tmp_path / "bench.toml").write_text(BENCH.replace("2025-01-01", due))
    first = verified(certified(tmp_path, "C-1", serial="C-1", stroke=366.5, sensor=4.9))
    assert plainly(first), first.output
    assert "calibration is stated" not in first.stdout  # none was before
    bench = ("--bench", tmp_path / "bench.toml")
    accept("report", unit(tmp_path / "A-1", "A-1"), "--spec", "apa-basic", "--out", tmp_path / "A-1.pdf", *bench)
    assert "calibration is stated" not in verified(tmp_path / "A-1.pdf").stdout
    if how == "shared":
        with open_store() as store:
            judged = replace(UnitJudged.of(store.newest(UnitJudged.KIND, 1)[0]), bench="ab" * 32)
            for number in range(against_store._LOOKED_AT):
                store.write(judged, f"Z-{number}", who="Ada")
    elif how == "unnamed":
        monkeypatch.setattr(Store, "bench", "")
    done = verified(certified(tmp_path, "A-2", serial="A-2", stroke=361.1, sensor=4.92))
    assert "A-2 accepted; no calibration is stated, and its bench stated " in done.stdout
    if due < "2026":
        doubted(done, ", expired on 2025-01-01")
    else:
        assert plainly(done)


def test_a_number_of_a_certificate_is_no_format_of_a_program(tmp_path: Path) -> None:
    """It would take as much memory as it says."""
    for between in ("{year:>3999999999}", "{year.__class__}", "{attempt!r}", "{year:{attempt}}"):
        (home() / "laboratory.toml").write_text(f'certificate_number = "{{serial}}/{{attempt}}{between}"\n')
        done = accept("report", unit(tmp_path / "A-1"), "--spec", "apa-basic", "--out", tmp_path / "A-1.pdf")
        assert done.exit_code == 6, done.output
        assert "certificate_number" in done.output


def test_a_golden_unit_whose_old_folder_is_judged_again_was_not_measured(tmp_path: Path) -> None:
    certified(tmp_path, "G-1", serial="G-1")
    assert accept("golden", "name", "G-1", "--expect", "accepted").exit_code == 0
    since = datetime.now(UTC)
    certified(tmp_path, "G-1", serial="G-1")
    with open_store() as store:
        assert not check(store, since, "Ada")[0].measured
    certified(tmp_path, "G-1", serial="G-1", sensor=4.992, last=-3.9)
    with open_store() as store:
        assert check(store, since, "Ada")[0].measured
