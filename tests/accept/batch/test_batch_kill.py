"""SIGKILL of a batch wherever it writes: nothing acknowledged is lost, nothing is half-written, the next run goes on to
the result that an undisturbed run has.

The points are those of the event store (each SQL statement, fsync, rename) and, around every fsync and rename, those of
the result files and certificates. By default every 60th point, in full (ACCEPT_SOAK=1) all, then two hundred more at
random moments.
"""

import json
import os
import random
import shutil
import signal
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from accept.batch import judge_batch
from accept.batch.judge_batch import BatchRequest
from accept.certificate.trust import keys
from accept.certificate.trust.keys import TECHNICIAN
from accept.certificate.verify.rejudge import verify_file
from accept.judging import load_spec
from accept.store import fold, open_store
from tests.accept.batch.killing import Points, fork
from tests.accept.units.units import GOOD, make_unit
from tests.soak import SOAK

SERIALS = ("A", "B", "C")


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with keys and three units, B of them rejected."""
    folder = tmp_path_factory.mktemp("bench")
    for serial in SERIALS:
        make_unit(folder / "units" / serial, serial, GOOD.replace("5.10", "1.72") if serial == "B" else GOOD)
    keys.init(folder, "correct horse", "Ada", when=datetime(2026, 1, 1, tzinfo=UTC))
    return folder


def work(bench: Path, folder: Path, points: Points) -> None:
    """A whole batch as `accept batch` runs it; what it says is acknowledged and goes to `acks`, line by line."""
    os.environ["ACCEPT_HOME"] = str(bench)  # the store is sealed by the bench whose authority certified it
    points.install()
    acks = os.open(folder / "acks", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    credential = keys.unlock(bench, TECHNICIAN, "correct horse")
    order = BatchRequest([bench / "units"], folder / "out", {"apa": load_spec("apa-basic")}, "Ada", credential, 1)
    with open_store(f"sqlite:///{folder / 'store.sqlite'}") as store:
        judge_batch.run(order, store, lambda words: os.write(acks, f"{words}\n".encode()) and None)
    os.write(acks, f"points {points.passed}\n".encode())


def start(bench: Path, folder: Path, kill_at: int | None):
    folder.mkdir(exist_ok=True)
    process = fork.Process(target=work, args=(bench, folder, Points(kill_at)))
    process.start()
    return process


def run(bench: Path, folder: Path, kill_at: int | None = None) -> int | None:
    process = start(bench, folder, kill_at)
    process.join(120)
    return process.exitcode


def assert_sound(bench: Path, folder: Path) -> None:
    """After a kill: chain whole, every acknowledged verdict stored, every file either whole or not there."""
    said = (folder / "acks").read_text().splitlines() if (folder / "acks").exists() else []
    with open_store(f"sqlite:///{folder / 'store.sqlite'}") as store:
        assert store.check() is None
        events = list(store.events())
    for line in said:
        if ": accepted" in line or ": rejected" in line:
            serial, verdict = line.split("] ")[-1].split(" (")[0].split(": ")
            state = fold(event for event in events if event.subject == serial)
            assert state is not None
            assert (state.verdict, state.certificate is not None) == (verdict, True)
    ca = [keys.ca(bench)]
    for pdf in (folder / "out").rglob("*.pdf"):
        assert verify_file(pdf, ca).valid, pdf
    for name in ("results.json",):
        if (folder / "out" / name).exists():
            json.loads((folder / "out" / name).read_text())


def assert_goes_on(bench: Path, folder: Path, expected: bytes) -> None:
    assert run(bench, folder) == 0
    assert (folder / "out" / "results.json").read_bytes() == expected
    ca = [keys.ca(bench)]
    assert all(verify_file(folder / "out" / "certificates" / f"{s}.pdf", ca).valid for s in SERIALS)
    with open_store(f"sqlite:///{folder / 'store.sqlite'}") as store:  # what was judged and not signed was not doubled
        assert [e.subject for e in store.events(what="unit_judged")] == list(SERIALS)


@pytest.fixture(scope="module")
def undisturbed(bench: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, int, float]:
    """results.json of a run that nobody kills, how many points it passes and how long it takes [s]."""
    folder = tmp_path_factory.mktemp("undisturbed")
    began = time.monotonic()
    assert run(bench, folder) == 0
    took = time.monotonic() - began
    points = int((folder / "acks").read_text().splitlines()[-1].split()[1])
    return (folder / "out" / "results.json").read_bytes(), points, took


@pytest.mark.slow
def test_killed_at_every_write(bench: Path, undisturbed: tuple[bytes, int, float], tmp_path: Path) -> None:
    expected, total, _ = undisturbed
    assert total > 100  # the counting itself works
    for point in range(1, total + 1) if SOAK else range(7, total + 1, 60):
        folder = tmp_path / str(point)
        assert run(bench, folder, point) == -signal.SIGKILL, f"point {point} of {total}"
        assert_sound(bench, folder)
        assert_goes_on(bench, folder, expected)
        shutil.rmtree(folder)


@pytest.mark.slow
def test_killed_at_random_moments(bench: Path, undisturbed: tuple[bytes, int, float], tmp_path: Path) -> None:
    expected, _, took = undisturbed
    dice = random.Random(3)
    for attempt in range(200 if SOAK else 2):
        folder = tmp_path / str(attempt)
        process = start(bench, folder, None)
        time.sleep(dice.uniform(0, took))
        process.kill()
        process.join()
        assert_sound(bench, folder)
        assert_goes_on(bench, folder, expected)
        shutil.rmtree(folder)


def test_nothing_is_left_over(bench: Path, undisturbed: tuple[bytes, int, float], tmp_path: Path) -> None:
    """A run that goes on after a kill judges only what was not done yet."""
    expected, total, _ = undisturbed
    folder = tmp_path / "run"
    assert run(bench, folder, total - 3) == -signal.SIGKILL  # all is judged, the results are being written
    before = (folder / "acks").read_text()
    assert_goes_on(bench, folder, expected)
    after = (folder / "acks").read_text()[len(before) :]
    assert all(f"{serial}: unchanged" in after for serial in SERIALS)
