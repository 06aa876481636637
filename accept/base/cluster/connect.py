"""Connecting a command to a cluster. Dask is only loaded if one is asked for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from accept.base.runner import ClusterError, Workers
from specs.distribution import install


@contextmanager
def connected(where: str | None, say: Callable[[str], None]) -> Iterator[Workers | None]:
    """Yield the cluster at a scheduler's address (`tcp://HOST:8786`), or local workers, one a core, for the time of the
    work (`local`); None without an address. Raises ClusterError if no scheduler answers."""
    if where is None:
        yield None
        return
    try:
        from accept.base.cluster import dask_workers
    except ImportError as e:
        raise ClusterError(f"--cluster {where}: Dask is not installed ({e}): {install('cluster')}") from e
    with dask_workers.connected(where, say) as cluster:
        yield cluster
