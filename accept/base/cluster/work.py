"""Work that is done on other machines, item by item, and its errors."""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

from specs.errors import AcceptError

T = TypeVar("T")
R = TypeVar("R")


class ClusterError(AcceptError, RuntimeError):
    """The cluster cannot be used; the text states its address, the reason and the remedy."""


class GivenUp(Exception):
    """An item that killed every worker that tried it, or takes more memory than a worker may; the text states which."""


class WorkFailed(RuntimeError):
    """The work itself raised an error, in a worker; the text is its traceback."""


class Cluster(Protocol):
    """Workers on other machines or this one, which have the same code."""

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        """Yield each item with the result of `work`, a module's function, in order of completion. Few items are
        submitted in advance, so that they can be made meanwhile. A MemoryError is returned as GivenUp, any other error
        of `work` as WorkFailed.

        Raises WorkFailed, ClusterError if the scheduler or every worker stays away."""
