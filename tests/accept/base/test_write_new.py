"""The bench's own key is made by whichever program comes first; the others use that one, and none sees half of it."""

import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from accept.base import atomic_files
from accept.store.seal import Sealer

PROGRAMS = 8


@pytest.fixture(autouse=True)
def often() -> Iterator[None]:
    """Switch between threads as often as can be: between the opening and the writing of a file too."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


def keys_made_at_once(folder: Path) -> set[str]:
    """Return the public keys, or the errors, of programs that all begin in one new folder."""
    start, found = threading.Barrier(PROGRAMS), []

    def begin() -> None:
        start.wait()
        try:
            found.append(Sealer(folder / "seal", folder / "bench.key").bench)
        except (OSError, ValueError) as e:
            found.append(repr(e))

    threads = [threading.Thread(target=begin) for _ in range(PROGRAMS)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert len(found) == PROGRAMS
    return set(found)


def test_programs_that_begin_at_once_have_one_key(tmp_path: Path) -> None:
    found = [keys_made_at_once(tmp_path / str(i)) for i in range(40)]
    assert all(len(keys) == 1 and len(next(iter(keys))) == 64 for keys in found), found
    assert [p.name for p in (tmp_path / "0").iterdir()] == ["bench.key"]


def test_a_file_that_is_there_stays_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "bench.key"
    atomic_files.write_new(path, b"first")
    with pytest.raises(FileExistsError):
        atomic_files.write_new(path, b"second")
    assert path.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [path]


def test_where_there_are_no_hard_links_the_file_is_written_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_link(*_: object, **__: object) -> None:
        raise PermissionError(1, "Operation not permitted")  # what FAT answers

    monkeypatch.setattr(atomic_files.os, "link", no_link)
    path = tmp_path / "bench.key"
    atomic_files.write_new(path, b"first")
    assert path.read_bytes() == b"first"
    assert path.stat().st_mode & 0o077 == 0 or sys.platform == "win32"
    with pytest.raises(FileExistsError):
        atomic_files.write_new(path, b"second")
    assert list(tmp_path.iterdir()) == [path]
