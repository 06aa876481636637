"""Computations in a process of their own: right answers, clear ends, nothing left behind."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from accept.workflow.apart import Apart, Broken, NotDone
from tests import apart_work as work

TIMEOUT_S = 60.0  # for a process to start or to end on a crowded machine


def test_the_answer_comes_back_with_what_was_said():
    said: list[str] = []
    assert Apart(work.twice, 21.0).run(said.append) == 42.0
    assert said == ["looking", "doubling"]


def test_what_is_printed_there_spoils_nothing():
    assert Apart(work.prints, 1.5).run() == 1.5


def test_a_refusal_is_told_in_its_words():
    with pytest.raises(NotDone, match="no band is measured"):
        Apart(work.refuse, expected=(work.Refused,)).run()


def test_a_fault_of_the_program_comes_with_its_traceback():
    with pytest.raises(Broken, match=r"break_down(.|\n)*ZeroDivisionError: bug"):
        Apart(work.break_down, expected=(work.Refused,)).run()


def test_a_process_that_the_system_ends_gives_no_answer():
    with pytest.raises(NotDone, match="memory"):
        Apart(work.die).run()


def test_it_is_stopped_at_once(tmp_path: Path):
    apart, ready = Apart(work.wait_for_ever, tmp_path / "pid"), threading.Event()
    threading.Thread(target=lambda: (ready.wait(TIMEOUT_S), apart.cancel()), daemon=True).start()
    with pytest.raises(NotDone, match="stopped"):
        apart.run(lambda words: ready.set())
    assert gone(int((tmp_path / "pid").read_text()))


def test_what_was_stopped_before_it_began_does_not_begin(tmp_path: Path):
    apart = Apart(work.wait_for_ever, tmp_path / "pid")
    apart.cancel()
    with pytest.raises(NotDone):
        apart.run()
    assert not (tmp_path / "pid").exists()


def test_a_program_that_is_killed_leaves_no_computation_behind(tmp_path: Path):
    pid_file = tmp_path / "pid"
    code = (
        "from pathlib import Path; from accept.workflow.apart import Apart; from tests import apart_work as w;"
        f"Apart(w.wait_for_ever, Path({str(pid_file)!r})).run()"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parent.parent)
    assert until(lambda: pid_file.exists() and pid_file.read_text() != "")
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert until(lambda: gone(int(pid_file.read_text())))


def until(condition) -> bool:
    deadline = time.monotonic() + TIMEOUT_S
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


def gone(pid: int) -> bool:
    """No such process, or one that only waits to be buried."""
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (ProcessLookupError, FileNotFoundError):
        return True
