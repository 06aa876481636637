"""The same store on PostgreSQL, by URL: `ACCEPT_TEST_POSTGRES_URL` names an empty database, else a server of its own
is started from the programs on the path; skipped where there are none."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text
from sqlalchemy.exc import DBAPIError

from accept.store import NewEvent, StoreError, StoreHead, check_lines, open_store
from accept.store.event import digest

WRITER = Path(__file__).with_name("store_writer.py")


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    pytest.importorskip("psycopg", reason="psycopg is not installed (accept[postgres])")
    if url := os.environ.get("ACCEPT_TEST_POSTGRES_URL"):
        yield url
        return
    if not shutil.which("initdb") or not shutil.which("pg_ctl"):
        pytest.skip("no PostgreSQL here: no initdb on the path, no ACCEPT_TEST_POSTGRES_URL")
    folder = tempfile.mkdtemp(prefix="pg", dir="/tmp")  # short: a socket's path has at most 107 characters
    user = "nobody" if os.geteuid() == 0 else None  # PostgreSQL refuses to run as root
    if user:
        shutil.chown(folder, user)

    def run(*command: str) -> None:
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, user=user, cwd=folder)

    try:
        run("initdb", "-D", f"{folder}/data", "-U", "bench", "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C")
        run("pg_ctl", "-D", f"{folder}/data", "-w", "-o", f"-k {folder} -c listen_addresses=''", "start")
        yield f"postgresql://bench@/postgres?host={folder}"
        run("pg_ctl", "-D", f"{folder}/data", "-m", "immediate", "stop")
    finally:
        shutil.rmtree(folder)


@pytest.fixture
def url(server: str) -> Iterator[str]:
    yield server
    with create_engine(server.replace("postgresql:", "postgresql+psycopg:")).begin() as connection:
        connection.execute(text("DROP TABLE IF EXISTS events, head"))


def execute(url: str, *statements: str) -> None:
    with create_engine(url.replace("postgresql:", "postgresql+psycopg:")).begin() as connection:
        for statement in statements:
            connection.execute(text(statement))


def test_append_read_and_check(url: str) -> None:
    with open_store(url, check=False) as store:
        event = store.append("unit_judged", "APA-03", {"µ": "größer", "nul": "a\0b"}, who="Ada", spec="apa@1")
        many = store.append_many([NewEvent("a", "U1"), NewEvent("b", "U2")], who="Ada")
        assert list(store.events()) == [event, *many]
        assert list(store.events(subject="U1", what="a")) == [many[0]]
        assert store.latest("U2", "b") == many[1]
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


def test_nothing_is_appended_to_a_damaged_end(url: str) -> None:
    with open_store(url, check=False) as store:
        store.append_many([NewEvent("a")] * 3, who="Ada")
        execute(url, "DROP TRIGGER events_append_only ON events", "DELETE FROM events WHERE seq = 3")
        with pytest.raises(StoreError, match="store check"):
            store.append("a", "", {}, who="Ada")


def test_processes_keep_one_chain(url: str) -> None:
    """They start on an empty database at once."""
    env = os.environ | {"ACCEPT_STORE_URL": url}
    command = [sys.executable, str(WRITER)]
    writers = [
        subprocess.Popen([*command, f"w{i}", "20"], stdout=subprocess.PIPE, text=True, env=env) for i in range(3)
    ]
    said = [line for writer in writers for line in writer.communicate(timeout=60)[0].splitlines()]
    assert [writer.returncode for writer in writers] == [0] * 3
    with open_store(url, check=False) as store:
        assert store.check() is None
        assert sorted(said) == sorted(f"{e.seq} {e.hash}" for e in store.events())
        assert len(said) == 60
