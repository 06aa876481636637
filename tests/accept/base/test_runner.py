"""Work in processes of this machine: what dies costs only itself, what is abandoned begins nothing else."""

import os
import signal
import time
from functools import partial
from pathlib import Path

import pytest

from accept.base.child_processes import process_pool
from accept.base.runner import GivenUp, Processes

DEADLY = 3


def squared(number: int) -> int:
    if number == DEADLY:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def process_of(_: int) -> int:
    return os.getpid()


def mark(folder: Path, number: int) -> None:
    (folder / str(number)).touch()
    time.sleep(0.05)


def divided(number: int) -> float:
    return 1 / number


@pytest.mark.parametrize("count", [0, 1])
def test_one_process_is_this_one(count: int) -> None:
    assert list(Processes(count).unordered(process_of, [4, 2])) == [(4, os.getpid()), (2, os.getpid())]


@pytest.mark.skipif(os.name == "nt", reason="no signal kills a process there")
def test_an_item_that_kills_its_process_is_given_up_alone() -> None:
    found = dict(Processes(2).unordered(squared, range(6)))
    assert isinstance(found[DEADLY], GivenUp)
    assert "died (out of memory?)" in str(found[DEADLY])
    assert {n: square for n, square in found.items() if n != DEADLY} == {0: 0, 1: 1, 2: 4, 4: 16, 5: 25}


def test_a_pool_that_runs_already_is_used_and_left_running() -> None:
    with process_pool(1) as pool:
        there = pool.submit(process_of, 0).result()
        assert list(Processes(2, pool).unordered(process_of, [7, 8])) == [(7, os.getpid()), (8, there)]
        assert pool.submit(process_of, 0).result() == there


def test_what_is_abandoned_begins_nothing_else(tmp_path: Path) -> None:
    results = Processes(2).unordered(partial(mark, tmp_path), range(200))
    next(iter(results))
    results.close()  # type: ignore[attr-defined]
    begun = len(list(tmp_path.iterdir()))
    assert begun < 100
    time.sleep(0.3)
    assert len(list(tmp_path.iterdir())) == begun


def test_an_error_of_the_work_is_raised_as_it_is() -> None:
    with pytest.raises(ZeroDivisionError):
        list(Processes(2).unordered(divided, [1, 0, 2]))
