"""A long computation in a process of its own: the screen keeps answering, and it can be stopped at any moment.

Not by `multiprocessing`: its helper process needs a real stderr, and while screens are shown there is none.
"""

import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

T = TypeVar("T")
Say = Callable[[str], None]
SAID, DONE, REFUSED, BROKEN = "said", "done", "refused", "broken"
COMMAND = (sys.executable, "-m", "accept.workflow.there")


class NotDone(RuntimeError):
    """There is no answer, and the text says why: stopped, killed by the system, or what the computation refused."""


class Broken(RuntimeError):
    """A fault of the program in the other process; the text is its traceback."""


class Apart(Generic[T]):
    """Runs `work(say, *given)` elsewhere. What goes in and comes back must be picklable, `work` a function of a module.

    expected : errors of `work` that a bench can have; `run` then raises NotDone with their words.
    """

    def __init__(self, work: Callable[..., T], *given: Any, expected: tuple[type[Exception], ...] = ()) -> None:
        self._order = pickle.dumps((work, given, expected))
        self._process: subprocess.Popen[bytes] | None = None
        self._mutex, self._stopped = threading.Lock(), False

    def run(self, say: Say = lambda words: None) -> T:
        """Wait for the answer; say is called, from the thread that waits, with what the computation says of itself.
        Raises NotDone, Broken, OSError."""
        process = self._started()
        try:
            return self._answer(process, say)
        finally:
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    pipe.close()
            process.wait()

    def cancel(self) -> None:
        """Stop it; `run` then raises NotDone."""
        with self._mutex:
            self._stopped = True
            if self._process is not None:
                self._process.kill()

    def _started(self) -> "subprocess.Popen[bytes]":
        with self._mutex:
            if self._stopped:
                raise NotDone("stopped")
            self._process = subprocess.Popen(
                COMMAND,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl+C in the terminal is for the screens
            )
            return self._process

    def _answer(self, process: "subprocess.Popen[bytes]", say: Say) -> T:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(self._order)
            process.stdin.flush()  # it stays open: when it closes, the other process ends
            while True:
                kind, what = pickle.load(process.stdout)
                if kind == DONE:
                    answer: T = what
                    return answer
                if kind != SAID:
                    raise (NotDone if kind == REFUSED else Broken)(what)
                say(what)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError) as e:
            raise NotDone("stopped" if self._stopped else "the system ended it; is there enough memory?") from e
