"""The event store as its callers see it: what is appended comes back, verified, in order, from many writers."""

import hashlib
import json
import multiprocessing
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from accept.base.version import code_sha256
from accept.store import NewEvent, Store, StoreError, StoreHead, check_lines, open_store
from accept.store import store as store_module
from accept.store.store import _PAGE, NOT_SEEN
from accept.store.tables import BY_LOOK, LOOK
from tests.soak import SOAK

WRITER = Path(__file__).with_name("store_writer.py")


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path))
    monkeypatch.delenv("ACCEPT_STORE_URL", raising=False)
    return tmp_path


@pytest.fixture
def store(home: Path) -> Iterator[Store]:
    with open_store() as opened:
        yield opened


def test_what_is_appended_comes_back(store: Store) -> None:
    payload = {"b": [1, 2.5, None, True], "a": {"µ": "größer"}, "nul": "a\0b", "half": "\ud800"}
    event = store.append("unit_judged", "APA-03", payload, who="Ada", spec="apa@00ff")
    (read,) = store.events()
    assert read == event
    assert read.data == payload
    assert (read.seq, read.who, read.what, read.subject, read.spec) == (1, "Ada", "unit_judged", "APA-03", "apa@00ff")
    assert read.code == code_sha256()
    assert abs(datetime.fromisoformat(read.time) - datetime.now(UTC)) < timedelta(minutes=1)
    assert len(read.time) == len("2026-01-01T00:00:00.000000+00:00")


def test_anyone_can_recompute_the_chain_from_the_file(home: Path, store: Store) -> None:
    """An independent reader: raw SQL, json and hashlib as the docstring of `digest` states them."""
    for i in range(5):
        store.append("unit_judged", f"ü{i}", {"i": i}, who="Ada")
    prev = "0" * 64
    for row in sqlite3.connect(home / "store.sqlite").execute("SELECT * FROM events ORDER BY seq"):
        assert row[8] == prev
        prev = hashlib.sha256(json.dumps(row[:-1], separators=(",", ":")).encode()).hexdigest()
        assert row[9] == prev
    assert str(store.head()) == f"5 {prev}"
    assert (home / "store.head").read_text() == f"5 {prev}\n"


def test_payload_text_does_not_depend_on_the_order_of_keys() -> None:
    assert (
        NewEvent("x", payload={"a": 1, "b": 2}).text()
        == NewEvent("x", payload={"b": 2, "a": 1}).text()
        == '{"a":1,"b":2}'
    )


@pytest.mark.parametrize("value", [float("nan"), float("inf"), b"bytes", {1, 2}, object()])
def test_a_payload_that_is_not_json_is_refused(store: Store, value: object) -> None:
    with pytest.raises(StoreError, match="unit_judged U: the payload is not JSON"):
        store.append("unit_judged", "U", {"x": value}, who="Ada")
    assert list(store.events()) == []


@pytest.mark.parametrize(("subject", "who"), [("a\0b", "Ada"), ("\udcff", "Ada"), ("U", "")])
def test_fields_that_no_database_keeps_are_refused(store: Store, subject: str, who: str) -> None:
    with pytest.raises(StoreError):
        store.append("unit_judged", subject, {}, who=who)
    assert store.check() is None


def test_many_are_stored_whole_or_not_at_all(store: Store) -> None:
    good = [NewEvent("a", "U1"), NewEvent("b", "U2", {"x": 1}, "apa@1")]
    assert [e.seq for e in store.append_many(good, who="Ada")] == [1, 2]
    with pytest.raises(StoreError):
        store.append_many([NewEvent("c"), NewEvent("d", payload={"x": float("nan")})], who="Ada")
    assert store.append_many([], who="Ada") == []
    assert [(e.what, e.spec) for e in store.events()] == [("a", ""), ("b", "apa@1")]
    assert store.check() is None


def test_events_are_found_by_subject_kind_and_number(store: Store) -> None:
    store.append_many([NewEvent(what, unit) for unit in ("U1", "U2") for what in ("a", "b", "a")], who="Ada")
    assert [e.seq for e in store.events(subject="U2")] == [4, 5, 6]
    assert [e.seq for e in store.events(what="a")] == [1, 3, 4, 6]
    assert [e.seq for e in store.events(subject="U1", what="a", after=1)] == [3]
    latest = store.latest("U1", "a")
    assert latest is not None
    assert latest.seq == 3
    assert store.latest("U3", "a") is None


def test_reading_goes_on_over_pages_and_while_others_append(store: Store) -> None:
    store.append_many([NewEvent("a")] * (_PAGE + 3), who="Ada")
    reader = store.events()
    first = next(reader)
    store.append("late", "", {}, who="Ada")
    assert [first.seq, *(e.seq for e in reader)] == list(range(1, _PAGE + 5))


def test_the_last_event_about_each_subject_is_found_page_by_page(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of several about one the last, of each kind apart, by subject; what comes while they are read is not among
    them, also where it is about a subject that is still to come."""
    monkeypatch.setattr(store_module, "_PAGE", 3)
    subjects = [f"U{i}" for i in range(7)]
    for n in range(2):
        store.append_many([NewEvent("a", s, {"n": n}) for s in reversed(subjects)], who="Ada")
    store.append("b", "U3", {"n": 9}, who="Ada")
    found = []
    for event in store.last_of_each("a"):
        found.append((event.subject, event.data["n"]))
        store.append_many([NewEvent("a", "U6", {"n": 2}), NewEvent("a", "U9", {"n": 2})], who="Ada")
    assert found == [(s, 1) for s in subjects]
    assert [(e.subject, e.data["n"]) for e in store.last_of_each("a")][-2:] == [("U6", 2), ("U9", 2)]
    assert not list(store.last_of_each("c"))


def test_a_store_is_reopened_where_it_ended(home: Path) -> None:
    for expected in (1, 2, 3):
        with open_store() as store:
            assert store.append("a", "", {}, who="Ada").seq == expected
    assert not (home / "store.sqlite-wal").exists()


def test_url_chooses_the_database(home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_STORE_URL", f"sqlite:///{tmp_path}/other.db")
    with open_store() as store:
        store.append("a", "", {}, who="Ada")
    assert (tmp_path / "other.head").exists()
    assert not (home / "store.sqlite").exists()


def test_pragmas_that_durability_rests_on(store: Store) -> None:
    with store._engine.connect() as connection:
        found = {p: connection.exec_driver_sql(f"PRAGMA {p}").scalar() for p in ("journal_mode", "synchronous")}
    assert found == {"journal_mode": "wal", "synchronous": 2}


@pytest.mark.parametrize("statement", ["UPDATE events SET who = 'Eve'", "DELETE FROM events WHERE seq = 2"])
def test_the_database_itself_refuses_to_change_events(home: Path, store: Store, statement: str) -> None:
    store.append_many([NewEvent("a")] * 2, who="Ada")
    with pytest.raises(sqlite3.IntegrityError, match="never changed or removed"):
        sqlite3.connect(home / "store.sqlite").execute(statement)


def test_report_says_unbroken_or_names_the_event(home: Path, store: Store) -> None:
    kept = [store.append("unit_judged", f"APA-{i:02d}", {"i": i}, who="Ada") for i in range(1, 5)]
    exported = StoreHead(2, kept[1].hash)
    assert check_lines(store) == (True, [f"store: 4 events, head {kept[-1].hash}: unbroken", NOT_SEEN])
    assert NOT_SEEN not in check_lines(store, exported)[1]
    assert check_lines(store, exported)[0]
    assert not check_lines(store, StoreHead(2, kept[2].hash))[0]
    raw = sqlite3.connect(home / "store.sqlite", isolation_level=None)
    raw.execute("DROP TRIGGER events_no_update")
    raw.execute("UPDATE events SET payload = '{\"i\":7}' WHERE seq = 3")
    unbroken, lines = check_lines(store)
    assert not unbroken
    assert lines[1].startswith("event 3 (unit_judged APA-03) was altered")
    with pytest.raises(StoreError, match=r"event 3 \(unit_judged APA-03\) was altered"):
        list(store.events())


def test_threads_share_a_store(store: Store) -> None:
    with ThreadPoolExecutor(4) as pool:
        done = list(pool.map(lambda i: store.append("a", str(i), {}, who="Ada").seq, range(40)))
    assert sorted(done) == list(range(1, 41))
    assert store.check() is None


@pytest.mark.slow
def test_processes_keep_one_chain(home: Path) -> None:
    """Four programs start on an empty folder at once; every acknowledged event is there with the hash it was given."""
    count = 100 if SOAK else 25
    command = [sys.executable, str(WRITER)]
    writers = [subprocess.Popen([*command, f"w{i}", str(count)], stdout=subprocess.PIPE, text=True) for i in range(4)]
    said = [writer.communicate(timeout=60)[0].splitlines() for writer in writers]
    assert [writer.returncode for writer in writers] == [0] * 4
    with open_store() as store:
        assert store.check() is None
        stored = list(store.events())
    assert sorted(line for lines in said for line in lines) == sorted(f"{e.seq} {e.hash}" for e in stored)
    for i in range(4):
        assert [e.data["i"] for e in stored if e.who == f"w{i}"] == list(range(count))


def start_at_once(url: str, barrier: Any) -> None:
    barrier.wait(30)
    with open_store(url) as store:
        store.append("a", "", {}, who="Ada")


def test_a_new_store_is_made_once_by_many_at_once(tmp_path: Path) -> None:
    """SQLite does not wait where two switch a new file to WAL; without our wait one start in 180 fails."""
    fork = multiprocessing.get_context("fork")
    for i in range(60 if SOAK else 3):
        barrier, url = fork.Barrier(6), f"sqlite:///{tmp_path}/{i}.sqlite"
        starters = [fork.Process(target=start_at_once, args=(url, barrier)) for _ in range(6)]
        for process in starters:
            process.start()
        for process in starters:
            process.join(60)
        assert [process.exitcode for process in starters] == [0] * 6
        with open_store(url) as store:
            assert store.check() is None
            assert store.head().seq == 6


def test_import_is_light() -> None:
    heavy = ("numpy", "scipy", "pandas", "reportlab", "rich", "typer")
    script = f"import sys, accept.store; print([m for m in {heavy} if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True).stdout == "[]\n"


def test_a_store_from_before_the_index_of_spellings_gets_it(home: Path, tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'store.sqlite'}"
    with open_store(url) as store:
        store.append("attempt_started", "APA-1", {}, who="bench")
    with closing(sqlite3.connect(tmp_path / "store.sqlite")) as file:
        file.execute(f"DROP INDEX {BY_LOOK}")
    with open_store(url) as store:
        assert (store.other_spelling("apa-1"), store.other_spelling("APA-1")) == ("APA-1", None)
    with closing(sqlite3.connect(tmp_path / "store.sqlite")) as file:
        plan = file.execute(f"EXPLAIN QUERY PLAN SELECT subject FROM events WHERE {LOOK} = 'apa1'")
        assert BY_LOOK in plan.fetchone()[3]  # no walk over all units


def at(monkeypatch: pytest.MonkeyPatch, moment: datetime) -> None:
    class Clock(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> datetime:
            return moment

    monkeypatch.setattr(store_module, "datetime", Clock)


@pytest.mark.parametrize(("minutes", "said"), [(50, True), (6, True), (4, False), (-60, False)])
def test_a_clock_that_was_set_back_is_said(
    store: Store, minutes: int, said: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """When the event is stored, and by every check since; the store goes on."""
    noon = datetime(2026, 11, 23, 12, tzinfo=UTC)
    at(monkeypatch, noon)
    store.append("a", "U1", {}, who="Ada")
    at(monkeypatch, noon - timedelta(minutes=minutes))
    store.append("b", "U1", {}, who="Ada")
    assert ("clock" in capsys.readouterr().err) is said
    assert [name for name, _ in store.clock_set_back()] == (["event 2 (b U1)"] if said else [])
    sound, lines = check_lines(store)
    assert sound
    assert any("clock" in line for line in lines) is said


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions")
def test_nobody_else_writes_what_the_store_is_held_against(home: Path) -> None:
    """Whatever the umask of whoever starts the program."""
    script = (
        "import os; os.umask(0)\nfrom accept.store import open_store\n"
        "with open_store() as store: store.append('a', 'U1', {}, who='Ada')"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
    modes = {name: (home / f"store.{name}").stat().st_mode & 0o777 for name in ("head", "seal")}
    assert modes == {"head": 0o644, "seal": 0o600}


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions")
@pytest.mark.parametrize(("mode", "said"), [(0o777, True), (0o1777, False), (0o770, False)])
def test_a_home_that_everybody_writes_is_said(home: Path, mode: int, said: bool) -> None:
    home.chmod(mode)
    script = "from accept.store import open_store; open_store().close(); open_store().close()"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stderr.count("chmod o-w") == said
