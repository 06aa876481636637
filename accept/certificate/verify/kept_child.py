"""One process that reads many files of which nothing is known, each within limits of its own: to fork one for each,
with the memory that is copied then and what goes back through a pipe, costs more than reading it."""

import gc
import math
import mmap
import multiprocessing
import os
import pickle
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from accept.base import worker_process
from accept.base.child_processes import BUSY, KEPT, start

_SHARED = 1 << 29  # bytes through which it is asked and answers; only what is written takes memory
_ANY_GB = 1e3  # between two calls
_GROWN_GB = 0.1  # by which it may have grown after an answer, or it is ended
_CHILDREN: list["_Child"] = []  # at most one


@contextmanager
def kept_child() -> Iterator[None]:
    """Let what is `bounded` inside be done by one process, on Linux. Each call has its own limits; after one that
    fails, or leaves the process larger, the next has a new process."""
    keep_child()
    try:
        yield
    finally:
        del KEPT[-1:]
        if _CHILDREN and not KEPT:
            _CHILDREN[0].end()


def keep_child() -> None:
    """Do as `kept_child`, until this process ends."""
    if sys.platform == "linux":
        KEPT.append(_ask)


def _ask(*call: Any) -> Any:
    if not _CHILDREN:
        _CHILDREN.append(_Child())
    return _CHILDREN[-1].ask(call)


class _Child:
    """A fork of this process that is asked, and answers, through memory that both share: a pipe costs five times as
    much. It is ended at whatever interrupts an answer, so that none is taken for that of another call."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("fork")
        self.shared = mmap.mmap(-1, _SHARED)
        self.pipe, there = context.Pipe()
        self.process = context.Process(target=_serve, args=(there, self.pipe, self.shared), daemon=True)
        start(self.process)
        there.close()

    def ask(self, call: tuple[Any, ...]) -> Any:
        """Return the result and the error of a call. Raises EOFError if it took too much."""
        stays = False
        try:
            self.shared.seek(0)
            pickle.dump(call, self.shared, pickle.HIGHEST_PROTOCOL)
            self.pipe.send(None)
            if not self.pipe.poll(call[2] * BUSY):
                raise EOFError
            stays = self.pipe.recv()
            return _read(self.shared)
        except ConnectionError as e:
            raise EOFError from e
        finally:
            if not stays:
                self.end()

    def end(self) -> None:
        _CHILDREN.remove(self)
        self.process.kill()
        self.process.join()
        self.pipe.close()
        self.shared.close()


def _read(shared: mmap.mmap) -> Any:
    with memoryview(shared) as view:
        return pickle.loads(view)


def _serve(pipe: Connection, other: Connection, shared: mmap.mmap) -> None:
    """Answer calls as long as the process may be kept. other: the asking end, of which a fork has a copy."""
    gc.freeze()
    other.close()
    KEPT.clear()
    _CHILDREN.clear()
    worker_process.begin(_ANY_GB)
    limit, size, stays = _limiter(), worker_process.mapped(), True
    while stays:
        try:
            pipe.recv()
            work, given, seconds, gigabytes = _read(shared)
            limit(seconds, gigabytes)
            try:
                answer: Any = work(*given), None
            except MemoryError:
                raise
            except Exception as e:  # noqa: BLE001 - raised again by who asked
                answer = None, e
            shared.seek(0)
            pickle.dump(answer, shared, pickle.HIGHEST_PROTOCOL)
            stays = answer[1] is None and worker_process.mapped() < size + _GROWN_GB * 1e9
            del given, answer
            limit(math.inf, _ANY_GB)
            pipe.send(stays)
        except BaseException:  # noqa: BLE001 - too much memory, or the program that asks has ended
            os._exit(1)


def _limiter() -> Callable[[float, float], None]:
    """Return what gives this process so many more seconds of computing and so much more memory [GB] from then on, as
    often as it is called, on Linux. Never more than its limits are now."""
    import resource

    now = {kind: resource.getrlimit(kind) for kind in (resource.RLIMIT_CPU, resource.RLIMIT_AS)}
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))

    def limit(seconds: float, gigabytes: float) -> None:
        most = time.process_time() + seconds, worker_process.mapped() + gigabytes * 1e9
        for (kind, (soft, hard)), new in zip(now.items(), most, strict=True):
            least = min(new, math.inf if soft == resource.RLIM_INFINITY else soft)
            with suppress(ValueError, OSError):
                resource.setrlimit(kind, (math.ceil(least) if math.isfinite(least) else soft, hard))

    return limit
