"""A batch on a Dask cluster: whatever happens to workers and scheduler, the results are those of one machine, each unit
is stored once, and no worker ever sees a key. Scheduler and workers are programs of their own."""

import shutil
import signal
import threading
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from accept.base.cluster import dask_workers
from accept.cli.main import app
from accept.store import open_store
from tests.accept.base.cluster.dask_programs import ROOT, Programs
from tests.accept.batch.killing import until
from tests.accept.units.units import GOOD, make_unit

pytestmark = pytest.mark.slow
SERIALS = [f"T-{n:02d}" for n in range(8)]
# Each runs in a worker, before it works, around the judging of one unit; a file says that it happened once.
DIES_ONCE = """
import os, signal
from accept.batch.job import UnitJob
judge = UnitJob.__dict__.get("original", UnitJob.judge)  # Dask may run this twice
UnitJob.original = judge
def once(job, say):
    if not os.path.exists({mark!r}):  # the first that it is given, whichever that is
        open({mark!r}, "w").close()
        os.kill(os.getpid(), signal.SIGKILL)
    return judge(job, say)
UnitJob.judge = once
"""
SLOW = """
import os, time
from accept.batch.job import UnitJob
judge = UnitJob.__dict__.get("original", UnitJob.judge)  # Dask may run this twice
UnitJob.original = judge
def slow(job, say):
    first = not os.path.exists({mark!r})
    open({mark!r}, "w").close()
    time.sleep({seconds} if first else 0)  # so that the other worker gets one, or that this one dies with it
    return judge(job, say)
UnitJob.judge = slow
"""


@pytest.fixture
def units(tmp_path: Path) -> Path:
    """Eight units, one of them rejected."""
    for serial in SERIALS:
        make_unit(tmp_path / "units" / serial, serial, GOOD.replace("5.10", "1.72") if serial == "T-05" else GOOD)
    return tmp_path / "units"


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    folder = tmp_path / "dask"
    folder.mkdir()
    made = Programs(folder)
    made.scheduler()
    yield made
    made.end()


def batch(units: Path, out: Path, *more: object) -> Result:
    words = ["batch", units, "--spec", "apa-basic", "--out", out, "--no-certificates", *more]
    return CliRunner().invoke(app, [str(w) for w in words])


def alone(units: Path, place: Path, monkeypatch: pytest.MonkeyPatch) -> bytes:
    """results.json of one machine, with a bench of its own."""
    with monkeypatch.context() as other:
        other.setenv("ACCEPT_HOME", str(place / "alone-home"))
        assert batch(units, place / "alone", "--workers", 1).exit_code == 3
    return (place / "alone" / "results.json").read_bytes()


def assert_same_and_once(units: Path, place: Path, done: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    assert done.exit_code == 3, done.output + repr(done.exception)
    assert (place / "out" / "results.json").read_bytes() == alone(units, place, monkeypatch)
    with open_store() as store:
        stored = Counter(e.subject for e in store.events(what="unit_judged"))
        assert store.check() is None
    assert stored == Counter(SERIALS)


def test_a_worker_killed_in_mid_unit_and_one_with_other_code(
    units: Path, programs: Programs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One dies at a unit, one is slow, one has a line more in its code and is refused: given no unit at all."""
    monkeypatch.setattr(dask_workers, "NEW_S", 1.0)
    killed, worked, other = (tmp_path / name for name in ("killed", "worked", "other-worked"))
    code = tmp_path / "code"
    for package in ("accept", "hw", "checks", "specs"):
        shutil.copytree(ROOT / package, code / package, ignore=shutil.ignore_patterns("__pycache__"))
    with (code / "checks" / "verdict.py").open("a") as file:
        file.write("# another version\n")
    programs.worker("dies", DIES_ONCE.format(mark=str(killed)))
    programs.worker("slow", SLOW.format(mark=str(worked), seconds=2))
    programs.worker("other", SLOW.format(mark=str(other), seconds=0), code=code)
    programs.here(3)
    done = batch(units, tmp_path / "out", "--cluster", programs.address)
    assert_same_and_once(units, tmp_path, done, monkeypatch)
    assert killed.exists()
    assert worked.exists()
    assert not other.exists()
    assert "runs another version of the code: refused" in done.stderr


def test_the_scheduler_is_restarted(
    units: Path, programs: Programs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed in mid-unit, with its worker: what had not come back is handed to the next ones."""
    worked = tmp_path / "worked"
    first = [programs.running[0], programs.worker("one", SLOW.format(mark=str(worked), seconds=30))]
    programs.here(1)

    def restart() -> None:
        until(worked.exists)
        for program in first:
            program.send_signal(signal.SIGKILL)
            program.wait()
        programs.scheduler()
        programs.worker("two")

    behind = threading.Thread(target=restart)
    behind.start()
    done = batch(units, tmp_path / "out", "--cluster", programs.address)
    behind.join()
    assert_same_and_once(units, tmp_path, done, monkeypatch)
    assert "the scheduler was lost" in done.stderr
