"""Work that is done elsewhere, item by item, and what can go wrong with it."""

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
    """Workers somewhere, which have the same code."""

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        """Yield each item with what `work` makes of it, as they come back; `work` is a function of a module. Few items
        are handed in at a time: they may be made while others are worked on. A MemoryError comes back as GivenUp,
        anything else that `work` raises as WorkFailed.

        Raises WorkFailed, ClusterError where the scheduler or every worker stays away."""
