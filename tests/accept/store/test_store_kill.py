"""SIGKILL of a real process at every point of its work: what was acknowledged is there, nothing is half there, the next
process goes on.

The processes are forked, so that hundreds are cheap. Points are: before every SQL statement that SQLite runs (its own
trace, COMMIT included), after each statement of ours, and around every fsync and rename. By default every fifth one,
in full (ACCEPT_SOAK=1) all; then each system call that writes is a point as well, if strace is there.
A kill leaves the page cache alone, so this does not show what synchronous=FULL does against a power cut.
"""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from accept.store import NewEvent, open_store
from tests.accept.batch.killing import Points, fork
from tests.soak import SOAK

WRITER = Path(__file__).with_name("store_writer.py")
GROUP = 3  # events of one append_many


def work(folder: Path, points: Points) -> None:
    """One short run of the bench; a line in `acks` for each acknowledged event."""
    points.install()
    acks = os.open(folder / "acks", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    with open_store(url_of(folder)) as store:
        for i in range(2):
            event_ = store.append("unit_judged", f"U{i}", {"i": i, "text": "x" * 6000}, who="Ada")
            os.write(acks, f"{event_.seq} {event_.hash}\n".encode())
        for event_ in store.append_many([NewEvent("group", "", {"i": i}) for i in range(GROUP)], who="Ada"):
            os.write(acks, f"{event_.seq} {event_.hash}\n".encode())
    os.write(acks, f"points {points.passed}\n".encode())


def url_of(folder: Path) -> str:
    return f"sqlite:///{folder}/store.sqlite"


def run(folder: Path, kill_at: int | None) -> int | None:
    process = fork.Process(target=work, args=(folder, Points(kill_at)))
    process.start()
    process.join(30)
    return process.exitcode


def assert_sound(folder: Path, acks: list[str]) -> None:
    """Nothing acknowledged is lost, no group is half there, the chain is unbroken, and appends go on."""
    with open_store(url_of(folder)) as store:
        stored = [f"{e.seq} {e.hash}" for e in store.events()]
        missing = [line for line in acks if line not in stored]
        assert not missing
        assert store.check() is None
        assert len(list(store.events(what="group"))) % GROUP == 0
        assert store.append("after", "", {}, who="Ada").seq == len(stored) + 1
        assert store.check() is None


def acknowledged(folder: Path) -> list[str]:
    path = folder / "acks"
    lines = path.read_text().splitlines() if path.exists() else []
    return [line for line in lines if not line.startswith("points")]


def points_of(folder: Path) -> int:
    assert run(folder, None) == 0
    return int(re.findall(r"points (\d+)", (folder / "acks").read_text())[0])


@pytest.mark.parametrize("existing", [False, True], ids=["new store", "existing store"])
@pytest.mark.slow
def test_killed_at_every_point(tmp_path: Path, existing: bool) -> None:
    template = tmp_path / "template"
    template.mkdir()
    if existing:
        assert run(template, None) == 0
        (template / "acks").rename(template / "before")
    total = points_of(Path(shutil.copytree(template, tmp_path / "whole")))
    assert total > 50  # the counting itself works
    first, step = (1, 1) if SOAK else (1 + existing, 5)
    for point in range(first, total + 1, step):
        folder = Path(shutil.copytree(template, tmp_path / str(point)))
        assert run(folder, point) == -signal.SIGKILL, f"point {point} of {total}"
        before = (folder / "before").read_text().splitlines()[:-1] if existing else []
        assert_sound(folder, before + acknowledged(folder))
        shutil.rmtree(folder)


@pytest.mark.slow
def test_killed_again_and_again_at_random_points(tmp_path: Path) -> None:
    """One store that lives through it all, so that damage would add up."""
    dice = random.Random(5)
    for _ in range(300 if SOAK else 25):
        assert run(tmp_path, dice.randint(1, 60)) in (-signal.SIGKILL, 0)
        assert_sound(tmp_path, acknowledged(tmp_path))


@pytest.mark.slow
def test_killed_at_random_moments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs of their own, killed by another, two at a time on one store."""
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path))
    monkeypatch.delenv("ACCEPT_STORE_URL", raising=False)
    dice, said = random.Random(6), []
    for _ in range(60 if SOAK else 3):
        command = [sys.executable, str(WRITER), "w", "100000"]
        writers = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
        first = [w.stdout.readline() for w in writers if w.stdout]
        time.sleep(dice.uniform(0.0, 0.05))
        for writer in writers:
            writer.kill()
        rest = [w.communicate()[0] for w in writers]
        # A line without its end was cut short by the kill: it was not heard.
        said += [line for text in map("".join, zip(first, rest, strict=True)) for line in text.split("\n")[:-1]]
        assert_sound(tmp_path, said)
    assert len(said) > 6


CALLS = ("pwrite64", "fdatasync", "fsync", "ftruncate", "unlink", "rename", "openat")


@pytest.mark.soak
@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not installed")
@pytest.mark.parametrize("call", CALLS)
def test_killed_at_every_system_call_that_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str) -> None:
    monkeypatch.delenv("ACCEPT_STORE_URL", raising=False)
    for n in range(1, 400):
        folder = tmp_path / str(n)
        folder.mkdir()
        finished, said = traced(folder, call, n)
        assert_sound(folder, said)
        shutil.rmtree(folder)
        if finished:
            break
    assert finished
    assert n > 1  # it was killed at least once


def traced(folder: Path, call: str, n: int) -> tuple[bool, list[str]]:
    """A writer killed at its n-th such call on a file of the store; whether it finished first, and what it said."""
    paths = [str(folder), *(f"{folder}/store{name}" for name in (".sqlite", ".sqlite-wal", ".sqlite-shm", ".head"))]
    files = [x for path in paths for x in ("-P", path)]
    if call == "rename":  # strace looks for a path only in its first argument
        files = []
    trace = ["strace", "-f", "-qq", "-o", "/dev/null", *files, "-e", f"trace={call}"]
    command = [*trace, "-e", f"inject={call}:signal=KILL:when={n}", sys.executable, str(WRITER), "w", "4"]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"ACCEPT_HOME": str(folder)})
    assert done.returncode in (0, -signal.SIGKILL), done.stderr
    return done.returncode == 0, done.stdout.split("\n")[:-1]
