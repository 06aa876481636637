"""Computations in a process of their own: right answers, clear ends, nothing left behind."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from accept.workflow.worker import process
from accept.workflow.worker.not_done import NotDone
from accept.workflow.worker.process import Broken, Work, WorkerProcess
from tests.accept.batch.killing import TIMEOUT_S, gone, until
from tests.accept.workflow import worker_orders as work

WITHOUT_PHYSICS = """
import sys, types
sys.modules["accept.workflow.worker.judging"] = types.ModuleType("judging")
from accept.workflow.worker.main import main
main()
"""


@pytest.fixture(scope="module")
def worker() -> Iterator[WorkerProcess]:
    """One for all: what one test leaves of it, a process or none, is what the next work finds at a bench. It is begun
    a dozen times, and no work here needs the physics, which take a second each time; the last test and the screens'
    begin it whole."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(process, "COMMAND", (sys.executable, "-c", WITHOUT_PHYSICS))
        started = WorkerProcess()
        yield started
        started.close()


def test_the_answer_comes_back_with_what_was_said(worker: WorkerProcess):
    said: list[str] = []
    assert worker.run(Work(work.twice, 21.0), said.append) == 42.0
    assert said == ["looking", "doubling"]


def test_what_is_printed_there_spoils_nothing(worker: WorkerProcess):
    assert worker.run(Work(work.prints, 1.5)) == 1.5


def test_a_refusal_is_told_in_its_words(worker: WorkerProcess):
    with pytest.raises(NotDone, match="no band is measured"):
        worker.run(Work(work.refuse, expected=(work.Refused,)))


def test_a_fault_of_the_program_comes_with_its_traceback(worker: WorkerProcess):
    with pytest.raises(Broken, match=r"break_down(.|\n)*ZeroDivisionError: bug"):
        worker.run(Work(work.break_down, expected=(work.Refused,)))


def test_a_process_that_the_system_ends_gives_no_answer(worker: WorkerProcess):
    with pytest.raises(NotDone, match="memory"):
        worker.run(Work(work.die))


def test_it_is_stopped_at_once(worker: WorkerProcess, tmp_path: Path):
    endless, ready = Work(work.wait_for_ever, tmp_path / "pid"), threading.Event()
    threading.Thread(target=lambda: (ready.wait(TIMEOUT_S), worker.cancel(endless)), daemon=True).start()
    with pytest.raises(NotDone, match="stopped"):
        worker.run(endless, lambda words: ready.set())
    assert gone(int((tmp_path / "pid").read_text()))


def test_one_process_does_one_work_after_the_other(worker: WorkerProcess):
    first = worker.run(Work(work.number))
    with pytest.raises(NotDone):
        worker.run(Work(work.refuse, expected=(work.Refused,)))
    assert worker.run(Work(work.number)) == first


@pytest.mark.parametrize("end", [work.die, work.break_down])
def test_after_a_work_that_ended_its_process_there_is_another(worker: WorkerProcess, end):
    first = worker.run(Work(work.number))
    with pytest.raises((NotDone, Broken)):
        worker.run(Work(end))
    assert worker.run(Work(work.number)) != first


def test_what_waits_for_its_turn_gets_it_when_the_first_is_stopped(worker: WorkerProcess, tmp_path: Path):
    endless, ready, answers = Work(work.wait_for_ever, tmp_path / "pid"), threading.Event(), []

    def first() -> None:
        with pytest.raises(NotDone, match="stopped"):
            worker.run(endless, lambda words: ready.set())

    def second() -> None:
        answers.append(worker.run(Work(work.twice, 4.0)))

    threads = [threading.Thread(target=first), threading.Thread(target=second)]
    threads[0].start()
    assert ready.wait(TIMEOUT_S)
    threads[1].start()
    assert answers == []
    worker.cancel(endless)
    for thread in threads:
        thread.join(TIMEOUT_S)
    assert answers == [8.0]


def test_a_process_that_died_while_it_had_nothing_to_do_is_replaced(worker: WorkerProcess):
    first = worker.run(Work(work.number))
    os.kill(first, signal.SIGKILL)
    assert until(lambda: gone(first))
    assert worker.run(Work(work.number)) != first


def test_it_ends_when_it_is_closed_whatever_it_is_at(tmp_path: Path):
    worker = WorkerProcess()
    endless, ready = Work(work.wait_for_ever, tmp_path / "pid"), threading.Event()
    threading.Thread(target=lambda: (ready.wait(TIMEOUT_S), worker.close()), daemon=True).start()
    with pytest.raises(NotDone, match="stopped"):
        worker.run(endless, lambda words: ready.set())
    assert gone(int((tmp_path / "pid").read_text()))


def test_what_was_stopped_before_it_began_does_not_begin(worker: WorkerProcess, tmp_path: Path):
    endless = Work(work.wait_for_ever, tmp_path / "pid")
    worker.cancel(endless)
    with pytest.raises(NotDone):
        worker.run(endless)
    assert not (tmp_path / "pid").exists()


def test_a_program_that_is_killed_leaves_no_computation_behind(tmp_path: Path):
    pid_file = tmp_path / "pid"
    code = (
        "from pathlib import Path; from accept.workflow.worker.process import WorkerProcess, Work; "
        "from tests.accept.workflow import worker_orders as w;"
        f"WorkerProcess().run(Work(w.wait_for_ever, Path({str(pid_file)!r})))"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[3])
    assert until(lambda: pid_file.exists() and pid_file.read_text() != "")
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert until(lambda: gone(int(pid_file.read_text())))
