"""Work on many items: in processes of this machine, or on a cluster (`accept.base.cluster`) behind the same protocol.

The results are the same. A process that dies costs only the item that killed it. After Ctrl-C, or if the results are no
longer asked for, the items under way are finished and no other is started.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Protocol, TypeVar

from accept.base.child_processes import process_pool
from specs.errors import AcceptError

T = TypeVar("T")
R = TypeVar("R")


class GivenUp(Exception):
    """An item that killed every worker that tried it, or takes more memory than a worker may; the text states which."""


class WorkFailed(RuntimeError):
    """The work itself raised an error, in a worker of a cluster; the text is its traceback."""


class ClusterError(AcceptError, RuntimeError):
    """The cluster cannot be used; the text states its address, the reason and the remedy."""


class Workers(Protocol):
    """Workers on this machine or on others, which have the same code."""

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        """Yield each item with the result of `work`, a module's function, in order of completion.

        A cluster takes few items in advance, so that they can be made meanwhile. It returns a MemoryError as GivenUp,
        and raises any other error of `work` as WorkFailed; ClusterError if the scheduler or every worker stays away."""


@dataclass(frozen=True)
class Processes:
    """Fresh processes of this machine, or this process itself if `count` is 1 or there is one item only. pool: one that
    runs already; the first item is then done by this process, which must not be one that could break it."""

    count: int
    pool: ProcessPoolExecutor | None = None

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        """Yield results as `Workers.unordered` does. An error of the work here is raised as it is."""
        left = dict(enumerate(items))
        if self.count <= 1 or len(left) <= 1:
            yield from ((item, work(item)) for item in left.values())
            return
        try:
            with nullcontext(self.pool) if self.pool else process_pool(min(self.count, len(left))) as running:
                own = 0 if self.pool else None
                pending = {running.submit(work, item): key for key, item in left.items() if key != own}
                try:
                    if own is not None:
                        yield left[own], work(left[own])
                        del left[own]
                    for future in as_completed(pending):
                        outcome = future.result()
                        yield left.pop(pending[future]), outcome
                except (KeyboardInterrupt, GeneratorExit):
                    running.shutdown(wait=True, cancel_futures=True)
                    raise
        except BrokenProcessPool:
            yield from ((item, _apart(work, item)) for item in left.values())


def _apart(work: Callable[[T], R], item: T) -> R | GivenUp:
    """Do an item in a process of its own after a worker died."""
    try:
        with process_pool(1) as pool:
            return pool.submit(work, item).result()
    except BrokenProcessPool:
        return GivenUp("the process that worked on it died (out of memory?)")
