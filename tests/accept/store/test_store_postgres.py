"""The same store on PostgreSQL, by URL: a real server that several benches share. `ACCEPT_TEST_POSTGRES_URL` names an
empty database, else a server of its own is started; killing it takes one of its own in any case."""

import os
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy.exc import DBAPIError

from accept.batch import judge_batch
from accept.batch.judge_batch import BatchRequest
from accept.judging import load_spec
from accept.store import NewEvent, Store, StoreError, StoreHead, check_lines, open_store
from accept.store.event import digest
from tests.accept.batch.killing import TIMEOUT_S
from tests.accept.store.postgres_server import Server, Wire, any_server, execute, own_server, system_programs
from tests.accept.units.units import GOOD, make_unit
from tests.soak import SOAK

WRITER = Path(__file__).with_name("store_writer.py")


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with any_server() as url:
        yield url


@pytest.fixture
def url(server: str) -> Iterator[str]:
    yield server
    execute(server, "DROP TABLE IF EXISTS events, head, samples, parts")


def test_append_read_and_check(url: str) -> None:
    with open_store(url, check=False) as store:
        event = store.append("unit_judged", "APA-03", {"µ": "größer", "nul": "a\0b"}, who="Ada", spec="apa@1")
        many = store.append_many([NewEvent("a", "U1"), NewEvent("b", "U2")], who="Ada")
        assert list(store.events()) == [event, *many]
        assert list(store.events(subject="U1", what="a")) == [many[0]]
        assert store.latest("U2", "b") == many[1]
        assert list(store.last_of_each("a")) == [many[0]]
        assert store.check() is None
        assert store.check(StoreHead(1, event.hash)) is None
    with open_store(url, check=False) as again:
        assert check_lines(again)[0]
        assert again.append("c", "", {}, who="Ada").seq == 4


def test_the_hash_is_that_of_the_fields_as_read(url: str) -> None:
    with open_store(url, check=False) as store:
        store.append("a", "ü", {"x": 0.1}, who="Ada")
        (e,) = store.events()
    assert e.hash == digest(e.seq, e.time, e.who, e.what, e.subject, e.spec, e.code, e.payload, e.prev)


@pytest.mark.parametrize("statement", ["UPDATE events SET who = 'Eve'", "DELETE FROM events", "TRUNCATE events"])
def test_the_database_itself_refuses_to_change_events(url: str, statement: str) -> None:
    with open_store(url, check=False) as store:
        store.append("a", "", {}, who="Ada")
    with pytest.raises(DBAPIError, match="never changed or removed"):
        execute(url, statement)


@pytest.mark.parametrize(
    ("statement", "seq"),
    [
        ("UPDATE events SET payload = '{}' WHERE seq = 2", 2),
        ("DELETE FROM events WHERE seq = 3", 3),
        ("DELETE FROM events WHERE seq = 4", 4),
        ("UPDATE events SET seq = -seq WHERE seq = 2", -2),
        ("ALTER TABLE events ADD COLUMN note TEXT", 0),
    ],
)
def test_tampering_is_named(url: str, statement: str, seq: int) -> None:
    with open_store(url, check=False) as store:
        store.append_many([NewEvent("a", str(i), {"i": i}) for i in range(4)], who="Ada")
        execute(url, "DROP TRIGGER events_append_only ON events", statement)
        problem = store.check()
        assert problem is not None
        assert problem.seq == seq


SHOWN = "current_query() NOT LIKE '%subject = %' OR seq <> 2"  # every question but the one for the events of a unit


@pytest.mark.parametrize(
    "statements",
    [
        [
            "ALTER TABLE events RENAME TO kept",
            "CREATE VIEW events AS SELECT seq, time, who, what, subject, spec, code, payload, prev, hash, xmin "
            f"FROM kept WHERE {SHOWN}",
        ],
        [
            "ALTER TABLE events ENABLE ROW LEVEL SECURITY",
            "ALTER TABLE events FORCE ROW LEVEL SECURITY",
            f"CREATE POLICY shown ON events USING ({SHOWN})",
        ],
        [
            "CREATE FUNCTION other(text, varchar) RETURNS boolean LANGUAGE sql AS "
            "$$ SELECT $1 OPERATOR(pg_catalog.=) $2::text AND $2::text <> 'U1' $$",
            "CREATE OPERATOR = (LEFTARG = text, RIGHTARG = varchar, FUNCTION = other)",
            "CREATE FUNCTION same(name, varchar) RETURNS boolean LANGUAGE sql AS 'SELECT $1::text = $2::text'",
            "CREATE OPERATOR = (LEFTARG = name, RIGHTARG = varchar, FUNCTION = same)",
        ],
        ["CREATE RULE kept AS ON INSERT TO parts DO INSTEAD NOTHING"],
        ["CREATE TABLE other () INHERITS (samples)"],
        ["ALTER ROLE CURRENT_USER SET search_path = public, pg_catalog"],
    ],
    ids=["view", "policy", "operator", "rule", "child", "path"],
)
def test_a_database_that_answers_one_question_otherwise_is_not_used(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, statements: list[str]
) -> None:
    """Also behind a seal: the rows that it looks at are as they were."""
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path))
    with open_store(url) as store:
        store.append_many([NewEvent("a", f"U{i}", {"i": i}) for i in range(3)], who="Ada")
    open_store(url).close()
    execute(url, *statements)
    try:
        with pytest.raises(StoreError, match="not those of this store"):
            open_store(url)
    finally:
        execute(url, "ALTER ROLE CURRENT_USER RESET ALL", "DROP SCHEMA public CASCADE", "CREATE SCHEMA public")


def test_nothing_is_appended_to_a_damaged_end(url: str) -> None:
    with open_store(url, check=False) as store:
        store.append_many([NewEvent("a")] * 3, who="Ada")
        execute(url, "DROP TRIGGER events_append_only ON events", "DELETE FROM events WHERE seq = 3")
        with pytest.raises(StoreError, match="store check"):
            store.append("a", "", {}, who="Ada")


def test_a_bench_knows_the_events_that_it_wrote_itself(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that were cut off before it looked at the store again, in the same program and in the next one; another
    bench has not seen them."""
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "one"))
    cut = (
        "DROP TRIGGER events_append_only ON events",
        "DELETE FROM events WHERE seq > 1",
        "UPDATE head SET seq = 1, hash = (SELECT hash FROM events WHERE seq = 1)",
    )
    with open_store(url) as store:
        store.append("a", "", {}, who="Ada")
        store.append("unit_judged", "A-1", {}, who="Ada")
        execute(url, *cut)
        with pytest.raises(StoreError, match="altered or removed"):
            store.append("b", "", {}, who="Ada")
    with pytest.raises(StoreError, match=r"event 2 is missing: store-.*head holds the hash"):
        open_store(url)
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "two"))
    with open_store(url) as store:
        store.append("unit_judged", "A-1", {"other": 1}, who="Ada")
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "one"))
    with pytest.raises(StoreError, match=r"event 2 was altered|is not the one"):
        open_store(url)


def writers(url: str, home: Path, count: int, events: int) -> list[subprocess.Popen[str]]:
    """Programs that append, each a bench with a folder of its own."""
    env = os.environ | {"ACCEPT_STORE_URL": url}
    return [
        subprocess.Popen(
            [sys.executable, str(WRITER), f"w{i}", str(events)],
            stdout=subprocess.PIPE,
            text=True,
            env=env | {"ACCEPT_HOME": str(home / f"bench{i}")},
        )
        for i in range(count)
    ]


def test_benches_keep_one_chain(url: str, tmp_path: Path) -> None:
    """They start on an empty database at once."""
    benches = writers(url, tmp_path, 3, 20)
    said = [line for bench in benches for line in bench.communicate(timeout=60)[0].splitlines()]
    assert [bench.returncode for bench in benches] == [0] * 3
    with open_store(url, check=False) as store:
        assert store.check() is None
        assert sorted(said) == sorted(f"{e.seq} {e.hash}" for e in store.events())
        assert len(said) == 60


def test_a_chain_that_two_benches_sealed_is_not_believed_by_either_when_it_was_edited(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The edit carries its own hash and keeps the events' number: only who wrote the row tells, at the next opening."""
    benches = [tmp_path / name for name in ("one", "two")]
    for bench in benches:
        monkeypatch.setenv("ACCEPT_HOME", str(bench))
        with open_store(url) as store:
            store.append_many([NewEvent("a", str(i), {"i": i}) for i in range(3)], who=bench.name)
    with open_store(url) as store:
        second = list(store.events())[1]
    fields = [getattr(second, n) for n in ("seq", "time", "who", "what", "subject", "spec", "code", "payload", "prev")]
    forged = digest(*[*fields[:2], "Eve", *fields[3:]])
    execute(
        url,
        "DROP TRIGGER events_append_only ON events",
        f"UPDATE events SET who = 'Eve', hash = '{forged}' WHERE seq = 2",
    )
    for bench in benches:
        monkeypatch.setenv("ACCEPT_HOME", str(bench))
        with pytest.raises(StoreError, match="event 2 was altered"):
            open_store(url)


def test_an_end_that_was_cut_off_is_found_by_the_seal_and_without_it_said_to_be_open(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By an administrator of the database, who puts the row of the head back too."""
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "bench"))
    with open_store(url) as store:
        third = store.append_many([NewEvent("a", str(i), {"i": i}) for i in range(5)], who="Ada")[2]
    with open_store(url):
        pass  # it seals the five
    assert capsys.readouterr().err == ""
    execute(
        url,
        "DROP TRIGGER events_append_only ON events",
        "DELETE FROM events WHERE seq > 3",
        f"UPDATE head SET seq = 3, hash = '{third.hash}'",
    )
    with pytest.raises(StoreError, match="is missing"):
        open_store(url)
    (seal,) = (tmp_path / "bench").glob("store-*.seal")
    seal.unlink()
    with pytest.raises(StoreError, match=r"is missing: store-.*\.head holds"):  # what it wrote itself
        open_store(url)
    seal.with_suffix(".head").unlink()
    with open_store(url):
        assert "no seal" in capsys.readouterr().err
    seal.unlink()  # which that check had made anew
    with open_store(url, check=False) as store:
        unbroken, lines = check_lines(store)
        assert unbroken
        assert any("no seal" in line for line in lines)
        assert check_lines(store, StoreHead(5, "ab" * 32))[0] is False  # an exported head shows it
    with open_store(url) as store:
        assert not any("no seal" in line for line in check_lines(store)[1])


def named(serial: str, part: str) -> NewEvent:
    return NewEvent("unit_judged", serial, {"result": {"verdict": "accepted", "parts": {"apa": part}}})


def test_a_database_from_before_the_index_of_parts_is_filled(url: str) -> None:
    with open_store(url) as store:
        store.append_many([named("S-1", "X-1"), named("S-2", "x-1"), named("S-3", "a\0b")], who="Ada")
    execute(url, "DROP TABLE parts", "UPDATE head SET store_schema = 1")
    with open_store(url) as store:
        assert [store.naming(part) for part in ("X-1", "a\0b", "X")] == [["S-1", "S-2"], ["S-3"], []]
        assert store.check() is None
        execute(url, "DELETE FROM parts WHERE seq = 2")
        problem = store.check()
    assert problem is not None
    assert (problem.seq, "index of parts" in problem.words) == (2, True)


def test_a_judgement_that_another_program_did_not_index_is_found_at_the_next_opening(url: str) -> None:
    """The chain up to the seal is not walked again; what was appended since is held against the indexes too."""
    with open_store(url) as store:
        store.append_many([named("S-1", "X-1")], who="Ada")
    with open_store(url) as store:
        store.append_many([named("S-2", "X-1")], who="Ada")
    with open_store(url) as store:
        assert store.naming("X-1") == ["S-1", "S-2"]
        store.append_many([named("S-3", "X-1")], who="Ada")
    execute(url, "DELETE FROM parts WHERE seq = 3")
    with pytest.raises(StoreError, match="the index of parts is not that of event 3"):
        open_store(url)


def through(server: str, wire: Wire) -> str:
    return server.rpartition("@")[0] + f"@127.0.0.1:{wire.port}/" + server.rpartition("/")[2]


def port_of(server: str) -> int:
    return int(server.rpartition("@")[2].split("/")[0].partition(":")[2] or 5432)


@pytest.mark.parametrize("heard", [False, True], ids=["cut before the server hears", "cut before the bench hears"])
def test_a_connection_that_drops_at_any_message_of_an_append(url: str, heard: bool) -> None:
    """Also where the commit was done and its acknowledgement lost: nothing is lost and nothing is there twice."""
    expected: list[str] = []
    for n in range(1, 50):
        wire = Wire(port_of(url), heard=heard)
        with open_store(through(url, wire), check=False) as store:
            wire.cut_at = wire.messages + n
            pair = store.append_many([NewEvent("a", f"{n} one"), NewEvent("a", f"{n} two")], who="Ada")
            cut = wire.messages >= wire.cut_at
            expected += [f"{n} one", f"{n} two"]
            assert [e.subject for e in store.events()] == expected
            assert [e.hash for e in store.events()][-2:] == [e.hash for e in pair]
            assert store.check() is None
        wire.close()
        if not cut:
            break
    assert not cut
    assert n > 5  # a transaction's begin, lock, reads, writes and commit


READS: dict[str, Callable[[Store], object]] = {
    "events": lambda store: [e.seq for e in store.events()],
    "latest": lambda store: store.latest("S-1", "unit_judged"),
    "last_of_each": lambda store: [e.seq for e in store.last_of_each("unit_judged")],
    "judgements_with": lambda store: [e.seq for e in store.judgements_with({"frf/low": {"table": "abc"}})],
    "naming": lambda store: store.naming("X-1"),
    "other_spelling": lambda store: store.other_spelling("s-1"),
    "look_alikes": lambda store: store.look_alikes("S-l"),
    "head": lambda store: store.head(),
    "check": lambda store: store.check(),
}


@pytest.mark.parametrize("read", READS)
def test_a_connection_that_drops_at_any_message_of_a_read(url: str, read: str) -> None:
    """Every question to the store goes on when the server is there again, not the appends alone."""
    sampled = {"verdict": "accepted", "samples": {"frf/low": {"table": "abc"}}}
    with open_store(url) as store:
        store.append_many([named("S-1", "X-1"), NewEvent("unit_judged", "S-2", {"result": sampled})], who="Ada")
        expected = READS[read](store)
    for n in range(1, 50):
        wire = Wire(port_of(url), heard=False)
        with open_store(through(url, wire), check=False) as store:
            wire.cut_at = wire.messages + n
            assert READS[read](store) == expected
            cut = wire.messages >= wire.cut_at
        wire.close()
        if not cut:
            break
    assert not cut
    assert n > 2  # begin, the question, the end


@pytest.mark.parametrize("kills", [20 if SOAK else 1])
def test_a_server_that_is_killed_under_two_benches(tmp_path: Path, kills: int) -> None:
    """They wait until it is there again; whatever they said was stored is stored, once."""
    with own_server() as server:
        benches = writers(server.url, tmp_path, 2, 20 * kills)
        for number in range(1, kills + 1):
            heard_of(server.url, 12 * number, {"w0", "w1"})
            server.kill()
            restarted(server)
        said = [bench.communicate(timeout=TIMEOUT_S)[0].splitlines() for bench in benches]
        assert [bench.returncode for bench in benches] == [0, 0]
        with open_store(server.url, check=False) as store:
            assert store.check() is None
            stored = list(store.events())
        assert sorted(line for lines in said for line in lines) == sorted(f"{e.seq} {e.hash}" for e in stored)
        subjects = [e.subject for e in stored]
        assert sorted(subjects) == sorted(f"w{i}-{n}" for i in range(2) for n in range(20 * kills))


@pytest.mark.parametrize("kills", [20 if SOAK else 1])
def test_a_server_that_is_killed_in_mid_batch(tmp_path: Path, kills: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A batch waits until it is there again: each unit is stored once, and no batch is ended."""
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "bench"))
    serials = [f"U{number:03}" for number in range(3 * kills + 3)]
    for number, serial in enumerate(serials):
        make_unit(tmp_path / "units" / serial, serial, GOOD.replace("5.10", "1.72") if number % 3 == 0 else GOOD)
    request = BatchRequest([tmp_path / "units"], tmp_path / "out", {"apa": load_spec("apa-basic")}, "Ada", workers=1)
    killed: list[threading.Thread] = []

    with own_server() as server:

        def after_a_unit(words: str) -> None:
            """Kill the server after every third unit, by a thread: a batch has no pause for it. The wait in it varies,
            so that the kill falls on another place of the next unit each time."""
            number = int(words[1:].partition("/")[0]) if words.startswith("[") else 0
            if number and number % 3 == 0 and len(killed) < kills:
                killed.append(threading.Thread(target=kill_and_restart, args=(server, 0.003 * len(killed))))
                killed[-1].start()

        with open_store(server.url, check=False) as store:
            report = judge_batch.run(request, store, after_a_unit)
        for thread in killed:
            thread.join()
        with open_store(server.url, check=False) as store:
            assert store.check() is None
            stored = [(e.what, e.subject) for e in store.events()]
    assert len(killed) == kills
    assert report.refused == []
    assert report.verdicts == {"rejected": kills + 1, "accepted": 2 * kills + 2}
    judged = [subject for what, subject in stored if what == "unit_judged"]
    assert judged == serials
    assert Counter(what for what, _ in stored) == {
        "batch_started": 1,
        "batch_finished": 1,
        "unit_judged": len(serials),
    }


def kill_and_restart(server: Server, after_s: float) -> None:
    time.sleep(after_s)
    server.kill()
    restarted(server)


def test_the_newest_server_of_the_system_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the number of its version: 15 is newer than 9."""
    monkeypatch.setenv("PATH", str(tmp_path))
    assert system_programs(tmp_path) is None
    for version in ("9", "15", "common"):
        (tmp_path / version / "bin").mkdir(parents=True)
        (tmp_path / version / "bin" / "initdb").touch()
    assert system_programs(tmp_path) == tmp_path / "15" / "bin"


def heard_of(url: str, events: int, everybody: set[str]) -> None:
    """Wait until so many events are there, and everybody has said something: who only begins is told that there is no
    server, and ends."""
    deadline = time.monotonic() + TIMEOUT_S
    with open_store(url, check=False) as store:
        while store.head().seq < events or {e.who for e in store.events()} < everybody:
            assert time.monotonic() < deadline
            time.sleep(0.01)


def restarted(server: Server) -> None:
    """The killed server's last processes hold its memory for a moment; it starts when they are gone."""
    deadline = time.monotonic() + TIMEOUT_S
    while True:
        try:
            server.start()
        except AssertionError:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        else:
            return
