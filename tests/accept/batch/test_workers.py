"""Worker processes: they end with the program that asked, and a record that would fill the memory is refused."""

import os
import signal
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from accept.base.child_processes import process_pool
from accept.base.worker_process import memory_GB
from accept.batch.job import UnitJob
from accept.batch.judge_batch import BatchRequest, run
from accept.batch.ports import Judgement
from accept.judging import load_spec
from accept.store import open_store
from checks.declare import Series
from checks.errors import RecordError
from hw.records import read
from tests.accept.batch.killing import gone, until
from tests.accept.units.units import make_unit

PARENT = """
import os, time
from accept.base.child_processes import process_pool
if __name__ == "__main__":
    with process_pool(2) as pool:
        pids = set()
        while len(pids) < 2:
            pids |= set(pool.map(pid, range(8)))
        print(*sorted(pids), flush=True)
        time.sleep(600)
"""
HELPER = """
import os, time
def pid(_):
    time.sleep(0.05)
    return os.getpid()
"""


def test_workers_end_when_their_program_is_killed(tmp_path: Path) -> None:
    """Killed, it cannot tell them; they would hold memory and files for as long as their units take."""
    (tmp_path / "helper.py").write_text(HELPER)
    script = tmp_path / "parent.py"
    script.write_text("from helper import pid\n" + PARENT)
    paths = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", ""), str(Path(__file__).parents[3])])
    started = subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": paths}
    )
    assert started.stdout is not None
    pids = [int(word) for word in started.stdout.readline().split()]
    assert len(pids) == 2
    assert not any(gone(pid) for pid in pids)
    started.send_signal(signal.SIGKILL)
    started.communicate()
    assert until(lambda: all(gone(pid) for pid in pids))


def grab(gigabytes: float) -> int:
    return int(np.ones(int(gigabytes * 1e9 / 8)).size)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only here the limit is enforced for sure")
def test_a_worker_has_a_declared_limit_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACCEPT_WORKER_GB", "1")
    assert memory_GB() == 1.0
    with process_pool(1) as pool:
        assert pool.submit(grab, 0.1).result() > 0
        with pytest.raises(MemoryError):
            pool.submit(grab, 1.5).result()
        assert pool.submit(grab, 0.1).result() > 0  # the worker lives on


def test_a_unit_that_takes_more_is_refused_and_the_others_are_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The limit may be met anywhere: in reading, in the fit of the responses, in drawing."""
    judge = UnitJob.judge

    def greedy(job: UnitJob, say: Callable[[str], None]) -> Judgement:
        if job.unit.serial == "A-2":
            raise MemoryError
        return judge(job, say)

    monkeypatch.setattr(UnitJob, "judge", greedy)
    for serial in ("A-1", "A-2", "A-3"):
        make_unit(tmp_path / "units" / serial, serial)
    order = BatchRequest([tmp_path / "units"], tmp_path / "out", {"apa": load_spec("apa-basic")}, "Ada", workers=1)
    with open_store() as store:
        report = run(order, store, lambda _: None)
    assert report.judged == 2
    assert [refused["path"] for refused in report.refused] == [str(tmp_path / "units" / "A-2")]
    assert "takes more than the 4 GB" in report.refused[0]["reason"]


def test_a_bomb_is_refused_by_its_figure(tmp_path: Path) -> None:
    """A compressed MATLAB file of half a megabyte that declares 80 million samples: refused before it is unpacked."""
    samples = 80_000_000

    def element(kind: int, content: bytes) -> bytes:
        return np.array([kind, len(content)], "<u4").tobytes() + content + bytes(-len(content) % 8)

    def variable(name: bytes) -> bytes:
        flags, shape = np.array([6, 0], "<u4").tobytes(), np.array([samples, 1], "<i4").tobytes()
        head = element(6, flags) + element(5, shape) + element(1, name)
        data = np.array([9, 8 * samples], "<u4").tobytes()
        packer = zlib.compressobj(9)
        whole = len(head) + len(data) + 8 * samples
        packed = packer.compress(np.array([14, whole], "<u4").tobytes() + head + data)
        block = bytes(8_000_000)
        for _ in range(8 * samples // len(block)):
            packed += packer.compress(block)
        packed += packer.flush()
        return np.array([15, len(packed)], "<u4").tobytes() + packed

    path = tmp_path / "bomb.mat"
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + variable(b"t"))
    assert path.stat().st_size < 1_000_000
    with pytest.raises(RecordError, match="at most 40000000 are read"):
        read(path, Series("x", "x", {"t": "s"}))
