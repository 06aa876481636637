"""Work that is done on other machines, item by item, and its errors."""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

from specs.errors import AcceptError

T = TypeVar("T")
R = TypeVar("R")


class ClusterError(AcceptError, RuntimeError):
    """The cluster cannot be used; the text names it, says why and what to do."""


class GivenUp(Exception):
    """An item that no worker could do: it killed each that tried it, or takes more memory than a worker may. The text
    says which."""


class WorkFailed(RuntimeError):
    """The work itself raised an error, in a worker; the text is its traceback."""


class Cluster(Protocol):
    """Workers on other machines or this one, which have the same code."""

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        """Yield each item with what `work` makes of it, as they come back; `work` is a function of a module. Few items
        are handed in at a time: they may be made while others are worked on. A MemoryError comes back as GivenUp, any
        other error of `work` as WorkFailed.

        Raises WorkFailed, ClusterError if the scheduler or every worker stays away."""
