"""Computations in a process of their own: the screen keeps answering, and each can be stopped at any moment.

`multiprocessing` is not used: its helper process needs a real stderr, which does not exist while screens are shown.
"""

import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from accept.base.child_processes import environment
from accept.workflow.worker.not_done import STOPPED, NotDone

T = TypeVar("T")
Say = Callable[[str], None]
SAID, DONE, REFUSED, BROKEN, LOST = "said", "done", "refused", "broken", "lost"
COMMAND = (sys.executable, "-P", "-m", "accept.workflow.worker.main")
Process = subprocess.Popen[bytes]


class Broken(RuntimeError):
    """A fault of the program in the other process; the text is its traceback."""


class Work(Generic[T]):
    """`work(say, *given)`, to be run elsewhere. What goes in and comes back must be picklable, `work` a function of a
    module.

    expected : errors of `work` that a bench can have; `WorkerProcess.run` then raises NotDone with their words.
    """

    def __init__(self, work: Callable[..., T], *given: Any, expected: tuple[type[Exception], ...] = ()) -> None:
        self.order = pickle.dumps((work, given, expected))
        self.stopped = False


class WorkerProcess:
    """One process for one work after the other, kept in between: to start it takes longer than most of them."""

    def __init__(self) -> None:
        self._process: Process | None = None
        self._present: Work[Any] | None = None
        self._turn, self._mutex = threading.Lock(), threading.Lock()

    def warm(self) -> None:
        """Let the process start and import what it needs, without waiting for it. Raises OSError."""
        with self._mutex:
            self._started()

    def run(self, work: Work[T], say: Say = lambda _: None) -> T:
        """Wait for the turn and for the answer; say is called, from the thread that waits, with the computation's
        progress. Raises NotDone, Broken, OSError."""
        with self._turn:
            process, kind = self._begun(work), LOST
            try:
                kind, what = _answer(process, work, say)
            finally:
                with self._mutex:
                    self._present = None
                    if work.stopped or kind not in (DONE, REFUSED):
                        self._end()
        if kind == DONE:
            answer: T = what
            return answer
        raise (Broken if kind == BROKEN else NotDone)(what)

    def cancel(self, work: Work[Any]) -> None:
        """Stop this work, under way or not yet; `run` then raises NotDone."""
        with self._mutex:
            work.stopped = True
            if self._present is work and self._process is not None:
                self._process.kill()

    def close(self) -> None:
        """End the process, with the work under way."""
        with self._mutex:
            if self._present is None:
                self._end()
            elif self._process is not None:  # the thread that waits for it buries it
                self._present.stopped = True
                self._process.kill()

    def _begun(self, work: Work[Any]) -> Process:
        with self._mutex:
            if work.stopped:
                raise NotDone(STOPPED)
            self._present = work
            return self._started()

    def _started(self) -> Process:
        if self._process is not None and self._process.poll() is not None:
            self._end()
        if self._process is None:
            self._process = Process(
                COMMAND,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment(),
                start_new_session=True,  # Ctrl+C in the terminal is for the screens
            )
        return self._process

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.communicate()


def _answer(process: Process, work: Work[Any], say: Say) -> tuple[str, Any]:
    if process.stdin is None or process.stdout is None:
        raise RuntimeError("the worker process was started without pipes")
    try:
        process.stdin.write(work.order)
        process.stdin.flush()
        while (answer := pickle.load(process.stdout))[0] == SAID:
            say(answer[1])
    except (EOFError, BrokenPipeError, pickle.UnpicklingError):
        return LOST, STOPPED if work.stopped else "the system ended it; is there enough memory?"
    kind, what = answer
    return kind, what
