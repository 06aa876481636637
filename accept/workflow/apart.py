"""A long computation in a process of its own: the screen keeps answering, and it can be stopped at any moment."""

import os
import threading
import traceback
from collections.abc import Callable
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

T = TypeVar("T")
Say = Callable[[str], None]
_SAID, _DONE, _REFUSED, _BROKEN = "said", "done", "refused", "broken"


class NotDone(RuntimeError):
    """There is no answer, and the text says why: stopped, killed by the system, or what the computation refused."""


class Broken(RuntimeError):
    """A fault of the program in the other process; the text is its traceback."""


class Apart(Generic[T]):
    """Runs `work(say, *given)` elsewhere. What goes in and comes back must be picklable.

    expected : errors of `work` that a bench can have; `run` then raises NotDone with their words.
    """

    def __init__(self, work: Callable[..., T], *given: Any, expected: tuple[type[Exception], ...] = ()) -> None:
        self._process: BaseProcess | None = None
        self._mutex, self._stopped = threading.Lock(), False
        self._what = (work, given, expected)

    def run(self, say: Say = lambda words: None) -> T:
        """Wait for the answer; say is called, from the thread that waits, with what the computation says of itself.
        Raises NotDone, Broken."""
        here = self._started()
        try:
            return self._answer(here, say)
        finally:
            here.close()
            self._join()

    def cancel(self) -> None:
        """Stop it; `run` then raises NotDone."""
        with self._mutex:
            self._stopped = True
            if self._process is not None:
                self._process.kill()

    def _started(self) -> Connection:
        context = get_context("spawn")
        here, there = context.Pipe(duplex=False)
        with self._mutex:
            if self._stopped:
                raise NotDone("stopped")
            self._process = context.Process(target=_there, args=(there, *self._what), daemon=True)
            self._process.start()
        there.close()
        return here

    def _join(self) -> None:
        with self._mutex:
            if self._process is not None:
                self._process.join()

    def _answer(self, here: Connection, say: Say) -> T:
        while True:
            try:
                kind, what = here.recv()
            except EOFError as e:
                words = "stopped" if self._stopped else "the system ended the computation; is there enough memory?"
                raise NotDone(words) from e
            if kind == _DONE:
                answer: T = what
                return answer
            if kind != _SAID:
                raise (NotDone if kind == _REFUSED else Broken)(what)
            say(what)


def _there(
    answers: Connection, work: Callable[..., Any], given: tuple[Any, ...], expected: tuple[type[Exception], ...]
) -> None:
    """In the other process. Nothing is written to the terminal: it belongs to the screens."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        answers.send((_DONE, work(lambda words: answers.send((_SAID, words)), *given)))
    except expected as e:
        answers.send((_REFUSED, " ".join(str(e).split())))
    except BaseException:
        answers.send((_BROKEN, traceback.format_exc()))
        raise


def _end_with_parent() -> None:
    """A program that was killed leaves no computation behind."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
