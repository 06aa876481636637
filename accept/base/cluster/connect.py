"""Connecting a command to a cluster. Dask is only loaded if one is asked for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from accept.base.runner import ClusterError, Workers
from specs.distribution import install


@contextmanager
def connected(where: str | None, say: Callable[[str], None]) -> Iterator[Workers | None]:
    """Yield the cluster at the address of a scheduler (`tcp://HOST:8786`), or workers of this machine, one a core
    (`local`), which end with the work; None without an address. Raises ClusterError if no scheduler answers."""
    if where is None:
        yield None
        return
    try:
        from accept.base.cluster import dask_workers
    except ImportError as e:
        raise ClusterError(f"--cluster {where}: Dask is not installed ({e}): {install('cluster')}") from e
    with dask_workers.connected(where, say) as cluster:
        yield cluster
