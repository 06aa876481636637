"""The other process of `accept.workflow.worker.process`: orders from stdin, progress and answer to stdout."""

import os
import pickle
import queue
import sys
import threading
import traceback
from typing import Any, BinaryIO

from accept.base.fault_log import log_fault
from accept.workflow.worker import judging  # noqa: F401 - early: to import the physics takes a second
from accept.workflow.worker.process import BROKEN, DONE, REFUSED, SAID

Order = tuple[Any, tuple[Any, ...], tuple[type[Exception], ...]]


def main() -> None:
    """Answer orders until stdin closes."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what anything prints goes nowhere: stdout carries answers only
    orders: queue.Queue[Order] = queue.Queue()
    threading.Thread(target=_listen, args=(orders,), daemon=True).start()
    while True:
        _answer(answers, *orders.get())


def _answer(answers: BinaryIO, work: Any, given: tuple[Any, ...], expected: tuple[type[Exception], ...]) -> None:
    try:
        _send(answers, DONE, work(lambda words: _send(answers, SAID, words), *given))
    except expected as e:
        _send(answers, REFUSED, " ".join(str(e).split()))
    except BaseException as e:
        log_fault("the worker process", e)
        _send(answers, BROKEN, traceback.format_exc())
        raise


def _send(answers: BinaryIO, kind: str, what: Any) -> None:
    answers.write(pickle.dumps((kind, what)))
    answers.flush()


def _listen(orders: "queue.Queue[Order]") -> None:
    """Read orders until stdin closes: then the program that asks is gone and waits for no answer."""
    try:
        while True:
            orders.put(pickle.load(sys.stdin.buffer))
    finally:
        os._exit(0)


if __name__ == "__main__":
    main()
