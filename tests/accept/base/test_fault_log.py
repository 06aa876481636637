"""Every fault leaves its traceback in the log: of a check, a thread, a crash; from several processes at once."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from accept.base import fault_log
from accept.base.fault_log import log_fault, log_file
from accept.base.loading import log_crashes
from accept.judging import judge_unit
from accept.units.unit_folder import read
from checks.acceptance import CHECKS
from specs.spec import load
from tests.accept.units.units import make_unit


@pytest.fixture(autouse=True)
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ACCEPT_HOME", str(tmp_path / "home"))
    return tmp_path / "home" / "log" / "accept.log"


def fault(text: str) -> ZeroDivisionError:
    try:
        raise ZeroDivisionError(text)
    except ZeroDivisionError as e:
        return e


def test_a_fault_of_a_check_is_no_result_and_leaves_its_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, log: Path
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setitem(vars(CHECKS["capacitance"]), "measure", broken)
    make_unit(tmp_path / "U-1", "U-1")
    result = judge_unit(read(tmp_path / "U-1"), load("apa-basic"))
    (reason,) = {f.reason for f in result.findings if f.check == "capacitance"}
    assert "internal error: ZeroDivisionError: a bug" in str(reason)
    assert "ACCEPT_HOME/log/accept.log" in str(reason)
    written = log.read_text()
    assert "U-1: judging capacitance" in written
    assert 'raise ZeroDivisionError("a bug")' in written


def test_the_file_rotates_and_old_ones_go(monkeypatch: pytest.MonkeyPatch, log: Path) -> None:
    monkeypatch.setattr(fault_log, "MAX_BYTES", 2000)
    for k in range(60):
        log_fault("x" * 200, fault(f"fault {k}"))
    kept = sorted(log.parent.glob("accept.log*"))
    assert len(kept) == 1 + fault_log.KEPT
    assert all(p.stat().st_size < 3000 for p in kept)
    assert "fault 59" in log.read_text()


def test_processes_write_side_by_side(log: Path) -> None:
    """Twice forty faults while the file rotates: not one is lost or torn."""
    write = (
        "import sys; from accept.base import fault_log as f; f.MAX_BYTES, f.KEPT = 3000, 100\n"
        "for k in range(40): f.log_fault(f'fault {sys.argv[1]} {k}.', ValueError('x' * 100))"
    )
    both = [subprocess.Popen([sys.executable, "-c", write, name]) for name in "ab"]
    assert [p.wait(60) for p in both] == [0, 0]
    written = "".join(p.read_text() for p in log.parent.glob("accept.log*"))
    assert all(written.count(f"fault {name} {k}.") == 1 for name in "ab" for k in range(40))


def test_a_crash_and_a_thread_that_dies_are_logged(log: Path) -> None:
    crash = "from accept.base.loading import log_crashes; log_crashes(); import threading\n"
    crash += "t = threading.Thread(target=lambda: 1 / 0, name='reader'); t.start(); t.join(); raise KeyError('gone')"
    done = subprocess.run([sys.executable, "-c", crash], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "KeyError: 'gone'" in done.stderr  # shown as ever
    written = log.read_text()
    assert "thread reader crashed" in written
    assert "ZeroDivisionError" in written
    assert "the program crashed" in written
    assert "KeyError: 'gone'" in written


@pytest.mark.skipif(getattr(os, "geteuid", lambda: 0)() == 0, reason="root writes everywhere")
def test_a_log_that_cannot_be_written_says_so_on_stderr(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log.parent.mkdir(parents=True)
    log.parent.chmod(0o500)
    log_fault("judging", fault("a bug"))
    assert "a bug" in capsys.readouterr().err


def test_a_log_in_the_way_says_so_on_stderr(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log.parent.parent.mkdir(parents=True)
    log.parent.write_text("a file where the folder should be")
    log_fault("judging", fault("a bug"))
    said = capsys.readouterr().err
    assert "the log cannot be written" in said
    assert "ZeroDivisionError: a bug" in said


def test_hooks_leave_interrupts_alone(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "excepthook", lambda *_: None)
    monkeypatch.setattr(threading, "excepthook", lambda *_: None)
    log_crashes()
    sys.excepthook(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert not log_file().exists()
