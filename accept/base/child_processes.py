"""Child processes: they import nothing from the folder that they are started in, and get no passphrase.

A folder of a supplier may hold `pickle.py` or a folder `accept`: Python puts the working folder first on its path for
`-m` and `-c` unless it is told not to (PYTHONSAFEPATH, Python 3.11)."""

import gc
import multiprocessing
import os
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

_BUSY = 8  # times as long may it take where others compute too
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

    Linux forks this process, in some milliseconds; elsewhere a new one starts. Raises Exhausted."""
    context = multiprocessing.get_context("fork") if sys.platform == "linux" else _Spawn()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(sender, seconds, gigabytes, work, given))
    with warnings.catch_warnings():  # a copy has none of the other threads, and waits for none of them
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    try:
        if not receiver.poll(seconds * (_BUSY if sys.platform != "win32" else 1)):
            raise EOFError
        what, error = receiver.recv()
    except EOFError:
        raise Exhausted(f"takes more than {seconds:g} s or {gigabytes:g} GB of memory") from None
    finally:
        process.kill()
        process.join()
        receiver.close()
    if error is not None:
        raise error
    answer: T = what
    return answer


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
