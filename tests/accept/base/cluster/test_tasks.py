"""How items are put into tasks and what is believed of a task that is lost: with a scheduler that is made up."""

from collections.abc import Callable
from typing import Any

import pytest
from distributed import KilledWorker

from accept.base.cluster import dask_workers
from accept.base.cluster.dask_workers import TOGETHER, DaskWorkers
from accept.base.runner import GivenUp, WorkFailed
from accept.base.version import code_sha256


class Done:
    """A future that came back."""

    def __init__(self, found: Any) -> None:
        self._found = found
        self.status = "error" if isinstance(found, Exception) else "finished"

    def cancelled(self) -> bool:
        return False

    def exception(self) -> Any:
        return self._found

    def result(self) -> Any:
        return self._found

    def add_done_callback(self, call: Callable[["Done"], None]) -> None:
        call(self)


class Blaming:
    """A scheduler with one worker that is always there. An item of `fatal` kills it; the death is blamed on all that
    was handed in together with it, and on the `beside` tasks before."""

    def __init__(self, fatal: set[int], beside: int = 0) -> None:
        self.fatal, self.beside = fatal, beside
        self.tasks: list[list[int]] = []

    def scheduler_info(self, **_: int) -> dict[str, Any]:
        return {"workers": {"tcp://one": {"resources": {code_sha256(): 1.0}}}}

    def register_plugin(self, _: object) -> None:
        pass

    def close(self, **_: float) -> None:
        pass

    def submit(self, done: Callable[..., Any], work: Any, items: list[int], **_: Any) -> Done:
        self.tasks.append(items)
        blamed = [item for task in self.tasks[-1 - self.beside :] for item in task] if len(items) > 1 else items
        return Done(KilledWorker("task", None, 3)) if self.fatal & set(blamed) else Done(done(work, items))


@pytest.fixture
def blaming(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[DaskWorkers, Blaming]]:
    def made(fatal: set[int], beside: int = 0) -> tuple[DaskWorkers, Blaming]:
        there = Blaming(fatal, beside)
        monkeypatch.setattr(dask_workers, "_client", lambda _: there)
        return DaskWorkers("tcp://nowhere", "tcp://nowhere", print), there

    return made


def negative(number: int) -> int:
    return -number


def test_short_items_travel_together_and_each_comes_back_once(blaming: Any) -> None:
    workers, there = blaming(set())
    back = list(workers.unordered(negative, iter(range(2000))))
    assert sorted(back) == [(n, -n) for n in range(2000)]
    assert max(map(len, there.tasks)) == TOGETHER
    assert len(there.tasks) < 60


def test_long_items_travel_alone(blaming: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of a second each: nobody waits for what travels with it."""
    workers, there = blaming(set())
    clock = iter(range(10_000))
    monkeypatch.setattr(dask_workers.time, "monotonic", lambda: 0.2 * next(clock))
    assert len(list(workers.unordered(negative, range(30)))) == 30
    assert {len(task) for task in there.tasks} == {1}


@pytest.mark.parametrize("beside", [0, 2])
def test_only_what_kills_its_worker_when_it_is_alone_is_given_up(blaming: Any, beside: int) -> None:
    """Dask blames a death on all that the worker had in hand: neighbours are tried again."""
    workers, there = blaming({31, 150}, beside)
    back = list(workers.unordered(negative, range(300)))
    assert sorted(item for item, _ in back) == list(range(300))
    assert sorted(item for item, found in back if isinstance(found, GivenUp)) == [31, 150]
    assert all(found == -item for item, found in back if item not in (31, 150))
    assert [31] in there.tasks


def test_what_one_item_raises_keeps_nothing_of_the_others_back(blaming: Any) -> None:
    def inverse(number: int) -> float:
        return 1 / (number - 20)

    workers, there = blaming(set())
    back: list[int] = []
    with pytest.raises(WorkFailed, match="ZeroDivisionError"):
        back.extend(item for item, _ in workers.unordered(inverse, range(40)))
    (task,) = (task for task in there.tasks if 20 in task)
    assert len(task) > 1
    assert set(task) - {20} <= set(back)
