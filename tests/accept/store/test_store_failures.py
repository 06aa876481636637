"""What goes wrong around a store: one clear StoreError, nothing half-stored, and it works again after."""

import os
import re
import shutil
import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from sqlalchemy import event
from sqlalchemy.pool import Pool

from accept.store import NewEvent, Store, StoreError, open_store

BIG = {"text": "x" * 20_000}


def url_of(folder: Path) -> str:
    return f"sqlite:///{folder}/store.sqlite"


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """Folder of a store that holds two events."""
    with open_store(url_of(tmp_path)) as store:
        store.append_many([NewEvent("a", "U1"), NewEvent("b", "U2")], who="Ada")
    return tmp_path


@contextmanager
def mounted(folder: Path, *mount: list[str]) -> Iterator[None]:
    """The folder mounted by these commands, in a test that is skipped where mounting is not permitted."""
    if os.geteuid() != 0 or shutil.which("mount") is None:
        pytest.skip("only root can mount")
    done = False
    try:
        for command in mount:
            if subprocess.run(["mount", *command, str(folder)], capture_output=True).returncode:
                pytest.skip("mounting is not permitted here")
            done = True
        yield
    finally:
        if done:
            subprocess.run(["umount", "--lazy", str(folder)], check=True)


def append_one(folder: Path) -> None:
    with open_store(url_of(folder)) as store:
        store.append("a", "", {}, who="Ada")


def fill(store: Store) -> int:
    """Append until it is refused; how many were acknowledged. The refusal must name the full disk."""
    refusals = refused_appends(store)
    done, refusal = next((i, text) for i, text in enumerate(refusals) if text)
    assert re.search("store.*(disk is full|No space left)", refusal)
    return done


def refused_appends(store: Store) -> Iterator[str]:
    """Appends, one at a time: "" when acknowledged, else the words of the refusal."""
    for _ in range(1000):
        try:
            store.append("a", "", BIG, who="Ada")
            yield ""
        except StoreError as e:
            yield str(e)


def test_a_full_database_is_said_and_what_was_acknowledged_stays(made: Path) -> None:
    def limit(connection: sqlite3.Connection, _record: object) -> None:
        connection.execute("PRAGMA max_page_count = 40")

    event.listen(Pool, "connect", limit)
    try:
        with open_store(url_of(made)) as store:
            done = fill(store)
            assert store.check() is None
    finally:
        event.remove(Pool, "connect", limit)
    with open_store(url_of(made)) as store:
        assert len(list(store.events())) == 2 + done
        assert store.append("a", "", BIG, who="Ada").seq == 3 + done
        assert store.check() is None


def test_a_full_disk_is_said_and_what_was_acknowledged_stays(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    with mounted(disk, ["-t", "tmpfs", "-o", "size=1m", "tmpfs"]):
        (disk / "ballast").write_bytes(b"\0" * 100_000)
        with open_store(url_of(disk)) as store:
            done = fill(store)
            assert done > 0
            assert store.check() is None
        (disk / "ballast").unlink()
        with open_store(url_of(disk)) as store:
            stored = len(list(store.events()))
            # The one that was refused may be stored when only its head file found no room; the message says so.
            assert stored in (done, done + 1)
            assert store.append("a", "", {}, who="Ada").seq == stored + 1
            assert store.check() is None


def test_no_room_for_a_new_store(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    with mounted(disk, ["-t", "tmpfs", "-o", "size=64k", "tmpfs"]):
        (disk / "ballast").write_bytes(b"\0" * 61_440)
        with pytest.raises(StoreError, match=r"store\.sqlite: the disk"):
            open_store(url_of(disk))


@pytest.mark.parametrize("existing", [True, False])
def test_a_read_only_folder(tmp_path: Path, existing: bool) -> None:
    home = tmp_path / "home"
    home.mkdir()
    if existing:
        append_one(home)
    with mounted(home, ["--bind", str(home)], ["-o", "remount,ro,bind"]), pytest.raises(StoreError) as refusal:
        append_one(home)
    assert "ACCEPT_HOME" in str(refusal.value)
    assert str(home) in str(refusal.value)


def test_a_read_only_database(made: Path) -> None:
    with open_store(f"sqlite:///file:{made}/store.sqlite?mode=ro&uri=true") as store:
        assert [e.seq for e in store.events()] == [1, 2]
        assert store.check() is None
        with pytest.raises(StoreError, match="read-only; make it writable, or set ACCEPT_HOME"):
            store.append("a", "", {}, who="Ada")


def test_a_folder_in_place_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "store.sqlite").mkdir()
    with pytest.raises(StoreError, match=r"store\.sqlite: cannot be opened or made"):
        open_store(url_of(tmp_path))


def test_a_home_that_cannot_be_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "file" / "home"))
    monkeypatch.delenv("ACCEPT_STORE_URL", raising=False)
    with pytest.raises(StoreError, match="set ACCEPT_HOME to another"):
        open_store()


def test_locked_by_another_program(made: Path) -> None:
    other = sqlite3.connect(made / "store.sqlite", isolation_level=None)
    with open_store(url_of(made), timeout_s=0.1) as store:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreError, match="another program holds it locked"):
            store.append("a", "", {}, who="Ada")
        assert len(list(store.events())) == 2  # reading goes on
        other.execute("ROLLBACK")
        assert store.append("a", "", {}, who="Ada").seq == 3


def test_a_new_store_locked_by_another_program(tmp_path: Path) -> None:
    other = sqlite3.connect(tmp_path / "store.sqlite", isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StoreError, match="another program holds it locked"):
        open_store(url_of(tmp_path), timeout_s=0.1)


@pytest.mark.parametrize("content", [b"not a database at all" * 100, b"\0" * 5000])
def test_a_file_that_is_no_database(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "store.sqlite").write_bytes(content)
    with pytest.raises(StoreError, match="is not an SQLite database"):
        open_store(url_of(tmp_path))
    assert (tmp_path / "store.sqlite").read_bytes() == content


def test_a_database_with_overwritten_pages(tmp_path: Path) -> None:
    with open_store(url_of(tmp_path)) as store:
        store.append_many([NewEvent("a", "U", BIG)] * 20, who="Ada")
    file = tmp_path / "store.sqlite"
    content = bytearray(file.read_bytes())
    content[4096 : len(content)] = b"\xa5" * (len(content) - 4096)
    file.write_bytes(content)
    with pytest.raises(StoreError, match="is damaged"):
        touch_everything(tmp_path)


def touch_everything(folder: Path) -> None:
    with open_store(url_of(folder)) as store:
        store.check()
        list(store.events())


def test_a_truncated_database(tmp_path: Path) -> None:
    with open_store(url_of(tmp_path)) as store:
        store.append_many([NewEvent("a", "U", BIG)] * 20, who="Ada")
    os.truncate(tmp_path / "store.sqlite", 3 * 4096)
    with pytest.raises(StoreError, match="is damaged"):
        touch_everything(tmp_path)


def test_a_store_of_a_newer_version(made: Path) -> None:
    raw = sqlite3.connect(made / "store.sqlite")
    with raw:
        raw.execute("UPDATE head SET store_schema = 3")
    with pytest.raises(StoreError, match="has schema 3, this accept knows 2; use the newer accept"):
        open_store(url_of(made))


def test_a_database_of_something_else(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "store.sqlite") as raw:
        raw.execute("CREATE TABLE head (x)")
    with pytest.raises(StoreError, match="store_schema"):
        open_store(url_of(tmp_path))


@pytest.mark.parametrize("url", ["nonsense", "nonsense://x", "postgresql+nodriver://ada:secret@host/db"])
def test_an_unusable_url_is_said_without_its_password(url: str) -> None:
    with pytest.raises(StoreError) as refusal:
        open_store(url)
    assert "secret" not in str(refusal.value)


def test_a_server_that_does_not_answer_is_said_without_its_password() -> None:
    pytest.importorskip("psycopg", reason="psycopg is not installed")
    with pytest.raises(StoreError, match=r"127\.0\.0\.1") as refusal:
        open_store("postgresql://ada:secret@127.0.0.1:1/accept")
    assert "secret" not in str(refusal.value)


def test_an_anchor_without_room_says_that_the_event_is_stored(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, content: bytes, mode: int) -> None:
        raise OSError(28, "No space left on device")

    with open_store(url_of(made)) as store:
        monkeypatch.setattr("accept.store.seal.write_atomic", full)
        with pytest.raises(StoreError, match=r"No space left on device\); event 3 itself is stored"):
            store.append("a", "", {}, who="Ada")
        assert len(list(store.events())) == 3
        assert store.check() is None
