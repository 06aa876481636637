"""Absence is a fault: a list of revoked keys that is removed, put back or from the future, a bench whose store and key
are gone, and a published list that cannot be of its day. Nothing is signed, and nothing is plainly valid."""

import json
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from accept.base.home import home
from accept.certificate import read_contents
from accept.certificate.trust import authority, key_changes, keys, published_list, revocation
from accept.certificate.trust.published_list import BenchList
from accept.certificate.trust.revocation import FILE, Revoked
from accept.store import open_store
from accept.store.payloads import KeysRevoked
from accept.store.seal import own_key
from tests.accept.certificate.verify.test_statements import (
    PHRASE,
    accept,
    certified,
    forged,
    plainly,
    replaced,
    unit,
    verified,
)

OFFICE = "authority phrase"
SECOND = {"sensor": 4.97, "stroke": 366.1}


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bench with keys of Ada and Grace, whose authority can be opened. Returns the list."""
    for name, phrase in (("ACCEPT_CA_PASSPHRASE", OFFICE), ("ACCEPT_QA_PASSPHRASE", "battery staple")):
        monkeypatch.setenv(name, phrase)
    monkeypatch.setenv("ACCEPT_OPERATOR", "Ada")
    return keys.init(home(), PHRASE, "Ada", "Grace", "battery staple", authority_passphrase=OFFICE) / FILE


def revoke(who: str, reason: str = "left", days: float = 0) -> None:
    """As `accept keys revoke`, from a little later on: what was signed in this very second stays signed before."""
    since = datetime.now(UTC).replace(microsecond=0) + timedelta(seconds=5, days=days)
    key_changes.revoke(home(), keys.folder(home()), who, reason, OFFICE, since)


def listed(path: Path) -> revocation.RevocationList:
    found = revocation.read_list(path, keys.ca(home()))
    assert found is not None
    return found


def number_of(name: str) -> int:
    """The number of a person's certificate at this bench."""
    return keys.certificate_of(keys.folder(home()) / f"{name}.pem").serial_number


def handed_out(place: Path, *names: str) -> Path:
    """The certificate of the authority, and what lies beside it, at a reader's."""
    place.mkdir(exist_ok=True)
    for name in ("ca.pem", *names):
        shutil.copy(keys.folder(home()) / name, place / name)
    return place / "ca.pem"


def nothing_is_signed(tmp_path: Path, pdf: Path, words: str) -> None:
    """Neither report nor batch nor countersign signs, and `verify` is in doubt; each says why."""
    out = tmp_path / "new.pdf"
    done = accept("report", unit(tmp_path / "new", "N-1", **SECOND), "--spec", "apa-basic", "--out", out)
    assert (done.exit_code, words in done.stderr, out.exists()) == (6, True, False), done.output
    batch = accept("batch", tmp_path / "new", "--spec", "apa-basic", "--out", tmp_path / "batch")
    assert (batch.exit_code, words in batch.stderr) == (6, True), batch.output
    assert not list(tmp_path.glob("batch/**/*.pdf"))
    before = pdf.read_bytes()
    countersigned = accept("countersign", pdf)
    assert (countersigned.exit_code, words in countersigned.stderr) == (4, True), countersigned.output
    assert pdf.read_bytes() == before
    done = verified(pdf)
    assert (done.exit_code, words in done.stdout) == (4, True), done.output


# --- the list of revoked keys -----------------------------------------------------------------------------------------


def test_a_bench_has_a_list_from_the_beginning_and_each_revocation_is_an_event(bench: Path) -> None:
    assert (listed(bench).number, listed(bench).entries) == (0, ())
    for words in (("Grace",), ("Ada", "--reason", "lost")):
        assert accept("keys", "revoke", *words).exit_code == 0
    assert (listed(bench).number, len(listed(bench).entries)) == (2, 2)
    with open_store() as store:
        stored = [KeysRevoked.of(event) for event in store.events("", KeysRevoked.KIND)]
    assert [event.number for event in stored] == [1, 2]
    assert stored[-1].crl == bench.read_text()
    assert [event.reason for event in stored] == ["Grace (qa): left", "Ada (technician): lost"]
    assert "Ada (technician): lost" in accept("store", "log").stdout


@pytest.mark.parametrize("left", ["an empty file", "a database without tables"])
def test_a_store_that_a_killed_program_did_not_finish_is_no_store_yet(bench: Path, tmp_path: Path, left: str) -> None:
    """Killed between the making of the file and of its tables: what comes next makes the store, and signs."""
    file = home() / "store.sqlite"
    for old in home().glob("store.*"):
        old.unlink()
    file.touch()
    if left == "a database without tables":
        with closing(sqlite3.connect(file)) as raw:
            raw.execute("PRAGMA journal_mode=WAL")
    assert plainly(verified(certified(tmp_path, "B-1")))


def test_without_the_list_nothing_is_signed(bench: Path, tmp_path: Path) -> None:
    pdf = certified(tmp_path, "B-1")
    assert plainly(verified(pdf))
    bench.unlink()
    nothing_is_signed(tmp_path, pdf, "no list of revoked keys")


def test_a_revoked_technician_does_not_sign_without_the_list(bench: Path, tmp_path: Path) -> None:
    pdf = certified(tmp_path, "B-1")
    revoke("Ada", "lost")
    bench.unlink()
    nothing_is_signed(tmp_path, pdf, "no list of revoked keys")
    assert "lost or compromised" in verified(pdf).stdout  # by the list in the store


@pytest.mark.parametrize("first", ["Grace", "Ada"])
def test_an_older_list_put_back_signs_nothing(bench: Path, tmp_path: Path, first: str) -> None:
    """The second revocation adds a key, or changes the reason for the same one: left becomes lost."""
    pdf = certified(tmp_path, "B-1")
    revoke(first, "left")
    older = bench.read_bytes()
    revoke("Ada", "lost")
    assert listed(bench).number == 2
    bench.write_bytes(older)
    done = verified(pdf)
    assert (done.exit_code, "is older than the one in the store" in done.stdout) == (4, True), done.output
    report = accept("report", unit(tmp_path / "n"), "--spec", "apa-basic", "--out", tmp_path / "n.pdf")
    assert (report.exit_code, (tmp_path / "n.pdf").exists()) == (6, False), report.output


def test_a_list_that_was_brought_to_the_bench_is_not_put_back_either(bench: Path, tmp_path: Path) -> None:
    """The authority revoked elsewhere; the list came as a file."""
    empty = bench.read_bytes()
    key = keys.unlocked(bench.with_name("ca.key.pem"), OFFICE)
    entry = Revoked(number_of("qa"), datetime.now(UTC), compromised=False)
    bench.write_bytes(revocation.made(keys.ca(home()), key, [entry]))
    pdf = certified(tmp_path, "B-1")
    assert plainly(verified(pdf))
    bench.write_bytes(empty)
    nothing_is_signed(tmp_path, pdf, "is older than the one in the store")


def test_the_authority_writes_the_list_again_with_all_that_the_store_has(bench: Path, tmp_path: Path) -> None:
    pdf = certified(tmp_path, "B-1")
    bench.unlink()
    assert accept("keys", "renew", "Ada").exit_code == 0
    assert (listed(bench).number, listed(bench).entries) == (0, ())
    assert plainly(verified(pdf))
    revoke("Grace")
    bench.unlink()
    assert verified(pdf).exit_code == 4
    assert accept("keys", "renew", "Ada").exit_code == 0
    assert listed(bench).number == 1
    assert [entry.serial_number for entry in listed(bench).entries] == [number_of("qa")]
    assert plainly(verified(pdf))


def test_the_list_of_an_authority_off_the_bench_is_brought_by_its_next_act(bench: Path, tmp_path: Path) -> None:
    pdf, office = certified(tmp_path, "B-1"), tmp_path / "office"
    office.mkdir()
    for name in ("ca.pem", "ca.key.pem", FILE):
        shutil.copy(bench.with_name(name), office / name)
    bench.with_name("ca.key.pem").unlink()
    bench.unlink()
    assert accept("keys", "renew", "Ada", "--authority", office).exit_code == 0
    assert bench.read_bytes() == (office / FILE).read_bytes()
    assert plainly(verified(pdf))


def test_a_list_from_the_future_is_none(bench: Path, tmp_path: Path) -> None:
    pdf = certified(tmp_path, "B-1")
    key = keys.unlocked(bench.with_name("ca.key.pem"), OFFICE)
    for hours, held in ((23, True), (25, False)):  # clocks may differ by a day, as for signatures
        later = datetime.now(UTC) + timedelta(hours=hours)
        bench.write_bytes(revocation.made(keys.ca(home()), key, when=later))
        assert plainly(verified(pdf)) is held
    nothing_is_signed(tmp_path, pdf, "in the future")


def test_away_from_the_bench_the_list_belongs_beside_the_certificate_of_the_authority(
    bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pdf = certified(tmp_path, "B-1")
    alone, both = handed_out(tmp_path / "alone"), handed_out(tmp_path / "both", FILE)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "elsewhere"))
    done = verified(pdf, "--trust", alone)
    assert (done.exit_code, f"{alone.with_name(FILE)} is not there" in done.stdout) == (4, True), done.output
    assert plainly(verified(pdf, "--trust", both))
    assert verified(pdf, "--trust", both, "--trust", alone).exit_code == 4


def test_an_attached_list_that_is_newer_is_used(bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For the signers and for the bench; and the one beside the authority's certificate is a doubt by itself."""
    contents = read_contents(certified(tmp_path, "B-1").read_bytes())
    ca, key = handed_out(tmp_path / "office", FILE), keys.unlocked(bench.with_name("ca.key.pem"), OFFICE)
    since = datetime.now(UTC) + timedelta(hours=1)
    names = {"qa": "", "technician": "lost or compromised", "bench": "the key of its bench"}
    made = {}
    for name in names:
        text = revocation.made(keys.ca(home()), key, [Revoked(number_of(name), since, compromised=True)])
        made[name] = forged(tmp_path / f"{name}.pdf", replaced(contents, crl=text.decode()))
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "elsewhere"))
    for name, words in names.items():
        done = verified(made[name], "--trust", ca)
        assert (done.exit_code, "older than the attached one" in done.stdout) == (4, True), done.output
        assert words in done.stdout


def test_a_published_list_knows_of_a_newer_list(bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pdf, log = certified(tmp_path, "B-1"), tmp_path / "list.json"
    old = handed_out(tmp_path / "old", FILE)
    revoke("Grace")
    assert accept("store", "publish", log).exit_code == 0
    new = handed_out(tmp_path / "new", FILE)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "elsewhere"))
    assert plainly(verified(pdf, "--trust", new, "--log", log, "--require", "current"))
    done = verified(pdf, "--trust", old, "--log", log)
    assert (done.exit_code, "than the one of bench" in done.stdout) == (4, True), done.output


def test_a_bench_of_before_signs_on_and_is_told_what_it_lacks(
    bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its authority wrote no list before it revoked a key. The next act of the authority writes one."""
    monkeypatch.setattr(authority, "promises_list", lambda ca: False)
    bench.unlink()
    out = tmp_path / "B-1.pdf"
    done = accept("report", unit(tmp_path / "B-1"), "--spec", "apa-basic", "--out", out)
    assert (done.exit_code, "no list of revoked keys" in done.stderr, out.exists()) == (0, True, True), done.output
    assert "crl" not in read_contents(out.read_bytes()).provenance
    assert verified(out).exit_code == 4
    assert "no list of revoked keys" in accept("keys", "list").stderr
    assert accept("keys", "renew", "Ada").exit_code == 0
    assert plainly(verified(out))
    assert plainly(verified(certified(tmp_path, "B-2", serial="B-2", **SECOND)))
    bench.unlink()  # from the first certificate that stated it, its absence is a fault
    assert accept("report", unit(tmp_path / "B-3", "B-3"), "--spec", "apa-basic", "--out", out).exit_code == 6


def test_an_authority_of_before_does_not_promise_a_list(bench: Path) -> None:
    assert authority.promises_list(keys.ca(home()))
    before = keys.certificate_of(Path(__file__).parent / "verify" / "before" / "ca.pem")
    assert not authority.promises_list(before)


# --- the bench's own store and key ------------------------------------------------------------------------------------


def move_away(*names: str) -> None:
    for name in names:
        (home() / name).rename(home() / f"{name}.away")


STORE = ("store.sqlite", "store.head", "store.seal")


@pytest.mark.parametrize("moved", [STORE, (*STORE, "bench.key")], ids=["store", "store and key"])
def test_a_bench_whose_store_is_gone_says_so(bench: Path, tmp_path: Path, moved: tuple[str, ...]) -> None:
    first = certified(tmp_path, "B-1").rename(tmp_path / "first.pdf")
    certified(tmp_path, "B-1", stroke=265.5)
    move_away(*moved)
    there = sorted(path.name for path in home().iterdir())
    before = first.read_bytes()
    done = verified(first, "--require", "accepted")
    assert (done.exit_code, "its store is gone" in done.stdout) == (4, True), done.output
    assert accept("countersign", first).exit_code == 4
    assert first.read_bytes() == before
    assert sorted(path.name for path in home().iterdir()) == there


def _missing(path: Path) -> None:
    path.unlink()


def _another(path: Path) -> None:
    path.unlink()
    own_key(path)


@pytest.mark.parametrize("change", [_missing, _another])
def test_a_home_that_is_not_the_bench_of_its_certificate_says_so(
    bench: Path, tmp_path: Path, change: Callable[[Path], None]
) -> None:
    pdf = certified(tmp_path, "B-1")
    change(home() / "bench.key")
    words = "bench.pem names"
    for done in (verified(pdf), accept("countersign", pdf)):
        assert (done.exit_code, words in done.stdout + done.stderr) == (4, True), done.output
    assert words in accept("keys", "list").stderr
    approve = accept("spec", "approve", "apa-basic")
    assert words in approve.stderr, approve.output
    report = accept("report", unit(tmp_path / "n", "N-1", **SECOND), "--spec", "apa-basic", "--out", tmp_path / "n.pdf")
    assert words in report.stderr, report.output
    assert not plainly(verified(tmp_path / "n.pdf"))


def test_countersign_makes_no_store(bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At a desk that has the QA key and no bench."""
    pdf, desk = certified(tmp_path, "B-1"), tmp_path / "desk"
    shutil.copytree(keys.folder(home()), desk / "keys")
    (desk / "keys" / "bench.pem").unlink()
    monkeypatch.setenv("ACCEPT_HOME", str(desk))
    before = pdf.read_bytes()
    done = accept("countersign", pdf)
    assert (done.exit_code, "there is no store" in done.stderr) == (6, True), done.output
    assert pdf.read_bytes() == before
    assert [path.name for path in desk.iterdir()] == ["keys"]


# --- the published list -----------------------------------------------------------------------------------------------


def signed_at(file: Path, when: datetime) -> None:
    """Date a published list, as the bench's own key can."""
    one = replace(published_list.read(file)[0], time=when.isoformat(timespec="seconds"))
    one = BenchList(one.bench, one.entries, one.head, one.time, own_key(home() / "bench.key").sign(one.text()).hex())
    file.write_text(json.dumps({"format": 1, "lists": [published_list._to_json(one)]}))


def test_a_published_list_of_the_future_is_refused_and_its_age_is_said(bench: Path, tmp_path: Path) -> None:
    pdf, log = certified(tmp_path, "B-1"), tmp_path / "list.json"
    assert accept("store", "publish", log).exit_code == 0
    done = verified(pdf, "--log", log, "--require", "current")
    assert (plainly(done), done.stderr.count("(today)")) == (True, 3), done.output  # of the revoked keys too
    now = datetime.now(UTC)
    signed_at(log, now + timedelta(hours=23))
    assert plainly(verified(pdf, "--log", log))
    for when in (now + timedelta(hours=25), datetime(2099, 1, 1, tzinfo=UTC)):
        signed_at(log, when)
        done = verified(pdf, "--log", log, "--require", "accepted,current")
        assert (done.exit_code, "in the future" in done.stderr, done.stdout) == (6, True, ""), done.output


def test_the_age_of_a_list_is_said(bench: Path, tmp_path: Path) -> None:
    pdf, log = certified(tmp_path, "B-1"), tmp_path / "list.json"
    assert accept("store", "publish", log).exit_code == 0
    contents = read_contents(pdf.read_bytes())
    now = datetime.now(UTC)
    earlier = forged(tmp_path / "e.pdf", contents, now - timedelta(minutes=30))
    assert accept("store", "publish", log).exit_code == 0
    signed_at(log, now - timedelta(days=3))
    assert "(3 days ago)" in verified(earlier, "--log", log).stderr


@pytest.mark.parametrize(("reason", "days", "doubt"), [("left", -1, True), ("left", 1, False), ("lost", 1, True)])
def test_a_list_of_a_bench_that_was_revoked_is_in_doubt(
    bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: str, days: float, doubt: bool
) -> None:
    """A bench that was shut down is in order if its list was published before; one whose key was lost is not. The first
    line says it of another bench's list too, which may lack a later attempt of the unit."""
    pdf, log, second = certified(tmp_path, "B-1"), tmp_path / "list.json", tmp_path / "second"
    shutil.copytree(keys.folder(home()), second / "keys")
    with monkeypatch.context() as patch:
        patch.setenv("ACCEPT_HOME", str(second))
        assert accept("keys", "request", "--role", "bench", "--name", "bench 2").exit_code == 0
        assert accept("keys", "issue", second / "keys" / "bench.request.pem").exit_code == 0
        other = certified(tmp_path, "B-2", serial="B-2", **SECOND)
        revoke("bench 2", reason, days)
        assert accept("store", "publish", log).exit_code == 0
        shutil.copy(second / "keys" / FILE, bench)
    assert accept("store", "publish", log).exit_code == 0
    words = "bench 2, which signed its list, was revoked"
    done = verified(pdf, "--log", log)
    assert (plainly(done), words in done.stdout) == (True, doubt), done.output
    away = handed_out(tmp_path / "away", FILE)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "elsewhere"))
    done = verified(other, "--trust", away, "--log", log)
    assert (not plainly(done), words in done.stdout) == (doubt, doubt), done.output
