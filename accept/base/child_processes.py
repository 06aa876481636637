"""Child processes: they import nothing from the folder that they are started in, and get no passphrase.

A folder of a supplier may hold `pickle.py` or a folder `accept`: Python puts the working folder first on its path for
`-m` and `-c` unless it is told not to (PYTHONSAFEPATH, Python 3.11)."""

import gc
import math
import mmap
import multiprocessing
import os
import pickle
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, TypeVar

from accept.base import worker_process
from accept.base.loading import SAFE_PATH, import_nothing_from_here
from specs.errors import AcceptError

T = TypeVar("T")
_Call = tuple[Callable[..., Any], tuple[Any, ...], float, float]  # what is bounded, seconds and gigabytes

_BUSY = 8  # times as long may it take where others compute too
_SHARED = 1 << 29  # bytes through which a kept child is asked and answers; only what is written takes memory
_ANY_GB = 1e3  # of a kept child between two calls
_GROWN_GB = 0.1  # by which a kept child may have grown after an answer, or it is ended
# Names of variables that hold one. The windows of `accept run --web` open the store, whose password they need.
_PASSPHRASE = re.compile("PASSPHRASE")
_SECRET = re.compile(
    "PASSPHRASE|PASSW|SECRET|TOKEN|CREDENTIAL|CONNECTION_STRING|STORE_URL|(ACCESS|ACCOUNT|API|PRIVATE|SAS)_?KEY",
    re.IGNORECASE,
)


def environment(given: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return the environment of a process that computes: without any secret."""
    return {name: value for name, value in given.items() if not _SECRET.search(name)} | {SAFE_PATH: "1"}


@contextmanager
def protected(secret: re.Pattern[str] = _PASSPHRASE) -> Iterator[None]:
    """Keep passphrases from all processes that are started inside: libraries pass their own environment on as it is."""
    before = dict(os.environ)
    kept = [name for name in before if secret.search(name)]
    try:
        import_nothing_from_here()
        for name in kept:
            del os.environ[name]
        yield
    finally:
        for name in kept:
            os.environ[name] = before[name]
        if SAFE_PATH not in before:
            del os.environ[SAFE_PATH]


class _Process(SpawnProcess):
    @staticmethod
    def _Popen(process_obj: Any) -> Any:
        with protected(_SECRET):
            return SpawnProcess._Popen(process_obj)  # noqa: SLF001 - what `Process` calls


class _Spawn(SpawnContext):
    Process = _Process


def process_pool(count: int) -> ProcessPoolExecutor:
    """Return a pool of fresh processes, which share nothing with this one, end with it and have a limit of memory."""
    with protected(_SECRET):  # the helper that watches over semaphores is started here
        return ProcessPoolExecutor(count, mp_context=_Spawn(), initializer=worker_process.begin)


class Exhausted(AcceptError, RuntimeError):
    """Work that took more time or memory than it was given."""


def bounded(work: Callable[..., T], *given: Any, seconds: float, gigabytes: float) -> T:
    """Return the result of a module's function, or raise its error, from a process of its own. The process is ended
    after so many seconds of computing (Windows: of waiting), and on Linux gets no more memory than given.

    Linux forks this process, in some milliseconds; elsewhere a new one starts. Within `kept_child` one process may
    answer several times. Raises Exhausted."""
    call = (work, given, seconds, gigabytes)
    try:
        what, error = _kept().ask(call) if _KEEP and sys.platform == "linux" else _answered_once(*call)
    except EOFError:
        raise Exhausted(f"takes more than {seconds:g} s or {gigabytes:g} GB of memory") from None
    if error is not None:
        raise error
    answer: T = what
    return answer


def _answered_once(work: Callable[..., Any], given: tuple[Any, ...], seconds: float, gigabytes: float) -> Any:
    context = multiprocessing.get_context("fork") if sys.platform == "linux" else _Spawn()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(sender, seconds, gigabytes, work, given))
    _start(process)
    sender.close()
    try:
        if not receiver.poll(seconds * (_BUSY if sys.platform != "win32" else 1)):
            raise EOFError
        return receiver.recv()
    finally:
        process.kill()
        process.join()
        receiver.close()


def _start(process: Any) -> None:
    with warnings.catch_warnings():  # a copy has none of the other threads, and waits for none of them
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()


_KEEP: list[bool] = []  # an entry for each `kept_child`
_CHILDREN: list["_Kept"] = []  # at most one


@contextmanager
def kept_child() -> Iterator[None]:
    """Let what is `bounded` inside be done by one process, on Linux: a fork and its copies of memory cost more than
    reading a certificate. Each call has its own limits; after one that fails, or leaves the process larger, the next
    has a new process."""
    keep_child()
    try:
        yield
    finally:
        _KEEP.pop()
        if _CHILDREN and not _KEEP:
            _CHILDREN[0].end()


def keep_child() -> None:
    """Do as `kept_child`, until this process ends."""
    _KEEP.append(True)


def _kept() -> "_Kept":
    if not _CHILDREN:
        _CHILDREN.append(_Kept())
    return _CHILDREN[-1]


class _Kept:
    """A fork of this process that is asked, and answers, through memory that both share: a pipe costs five times as
    much. It is ended at whatever interrupts an answer, so that none is taken for that of another call."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("fork")
        self.shared = mmap.mmap(-1, _SHARED)
        self.pipe, there = context.Pipe()
        self.process = context.Process(target=_serve, args=(there, self.pipe, self.shared), daemon=True)
        _start(self.process)
        there.close()

    def ask(self, call: _Call) -> Any:
        """Return the result and the error of a call. Raises EOFError if it took too much."""
        stays = False
        try:
            self.shared.seek(0)
            pickle.dump(call, self.shared, pickle.HIGHEST_PROTOCOL)
            self.pipe.send(None)
            if not self.pipe.poll(call[2] * _BUSY):
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
    _KEEP.clear()
    _CHILDREN.clear()
    worker_process.begin(_ANY_GB)
    limit, size, stays = worker_process.limiter(), worker_process.mapped(), True
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


def _answer(
    sender: Connection, seconds: float, gigabytes: float, work: Callable[..., Any], given: tuple[Any, ...]
) -> None:
    gc.freeze()  # a search for garbage among what is shared would copy all of it
    worker_process.begin(gigabytes)
    worker_process.limit_time(seconds)
    try:
        sender.send((work(*given), None))
    except MemoryError:
        os._exit(1)  # nothing more can be said
    except Exception as e:  # noqa: BLE001 - raised again by who asked
        sender.send((None, e))
