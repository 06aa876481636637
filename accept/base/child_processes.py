"""Child processes: they import nothing from the folder that they are started in, and do not get the passphrase.

A folder of a supplier may hold `pickle.py` or a folder `accept`: Python puts the working folder first on its path for
`-m` and `-c` unless it is told not to (PYTHONSAFEPATH, Python 3.11).
"""

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

SAFE_PATH = "PYTHONSAFEPATH"
_SECRET = "PASSPHRASE"  # in the names of variables that hold one


def environment() -> dict[str, str]:
    """Return the environment of a child process."""
    return {name: value for name, value in os.environ.items() if _SECRET not in name} | {SAFE_PATH: "1"}


@contextmanager
def protected() -> Iterator[None]:
    """Make this the environment of all processes that are started inside: libraries pass theirs on as it is."""
    before = dict(os.environ)
    secret = [name for name in before if _SECRET in name]
    try:
        os.environ[SAFE_PATH] = "1"
        for name in secret:
            del os.environ[name]
        yield
    finally:
        for name in secret:
            os.environ[name] = before[name]
        if SAFE_PATH not in before:
            del os.environ[SAFE_PATH]


class _Process(SpawnProcess):
    @staticmethod
    def _Popen(process_obj: Any) -> Any:
        with protected():
            return SpawnProcess._Popen(process_obj)  # noqa: SLF001 - what `Process` calls


class _Spawn(SpawnContext):
    Process = _Process


def process_pool(count: int, initializer: Any = None, initargs: tuple[Any, ...] = ()) -> ProcessPoolExecutor:
    """Return a pool of fresh processes, which share nothing with this one."""
    with protected():  # the helper that watches over semaphores is started here
        return ProcessPoolExecutor(count, mp_context=_Spawn(), initializer=initializer, initargs=initargs)
