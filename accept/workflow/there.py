"""The other process of `accept.workflow.apart`: one order from stdin, what it says and its answer to stdout."""

import os
import pickle
import sys
import threading
import traceback
from typing import Any, BinaryIO

from accept.workflow.apart import BROKEN, DONE, REFUSED, SAID


def main() -> None:
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what anything prints goes nowhere: stdout carries answers only
    work, given, expected = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        _send(answers, DONE, work(lambda words: _send(answers, SAID, words), *given))
    except expected as e:
        _send(answers, REFUSED, " ".join(str(e).split()))
    except BaseException:
        _send(answers, BROKEN, traceback.format_exc())
        raise


def _send(answers: BinaryIO, kind: str, what: Any) -> None:
    answers.write(pickle.dumps((kind, what)))
    answers.flush()


def _end_with_parent() -> None:
    """stdin closes when the program that asked is gone, however it went: then nobody waits for the answer."""
    while os.read(0, 4096):
        pass
    os._exit(1)


if __name__ == "__main__":
    main()
