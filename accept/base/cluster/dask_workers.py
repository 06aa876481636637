"""A Dask cluster that works through items; the outcome is the same as on this machine.

Each worker process reports its code to the scheduler (`Labelled`) as a resource of which it has one, and an item
requires one of the coordinator's code. So a worker with other code gets no item, and no worker has two at once, however
many threads it has. If a worker dies, its item goes to another one; an item that took several workers with it is given
up. A restarted scheduler has forgotten everything: unfinished items are submitted again."""

import os
import queue
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

import dask
from distributed import CancelledError, Client, Future, KilledWorker, LocalCluster, Status, WorkerPlugin

from accept.base import worker_process
from accept.base.child_processes import protected
from accept.base.runner import ClusterError, GivenUp, WorkFailed
from accept.base.version import code_sha256

T = TypeVar("T")
R = TypeVar("R")
Out = dict[Future[Any], "_Task"]  # submitted and not yet returned
Back = queue.SimpleQueue[Future[Any]]
Say = Callable[[str], None]

LOCAL = "local"
CONNECT_S = 15.0  # until a scheduler is said not to answer
AWAY_S = 120.0  # how long a scheduler may be away, or without a worker, before the work is given up
LOOK_S = 1.0  # between two looks at who works
NEW_S = 5.0  # a new worker has not reported its code yet
AHEAD = 3  # tasks handed in per worker: one in work, others at hand while results travel
TASK_S, TOGETHER = 0.1, 50  # how long the items of one task should take [s], and how many there are at most
# Every stream of messages keeps the last ones for who debugs Dask: a thousand, each with its units.
KEPT, KEPT_MESSAGES = "distributed.admin.low-level-log-length", 10


@dataclass(frozen=True)
class _Raised:
    """The traceback of an error in a worker."""

    words: str


@dataclass(frozen=True)
class _Task:
    """Items that travel together. alone: a single item, sent while no other is on the way."""

    items: list[Any]
    alone: bool = False


@dataclass(frozen=True)
class _Did:
    """The outcomes of a task's items in order, and the computing time [s]."""

    found: list[Any]
    seconds: float


class _Pace:
    """The number of items to put into one task."""

    def __init__(self) -> None:
        self.together = 1  # nothing is known yet

    def took(self, did: _Did) -> None:
        """Adapt the size, at most doubled: the next items may be slower."""
        each = did.seconds / len(did.found)
        self.together = max(1, min(2 * self.together, TOGETHER, int(TASK_S / max(each, 1e-6))))


class Labelled(WorkerPlugin):
    """Reports a worker's code to the scheduler and limits its memory as that of a local process. Only the name is sent;
    the worker runs its own code."""

    name = "accept-code"
    idempotent = True

    async def setup(self, worker: Any) -> None:
        worker_process.limit_memory(worker_process.memory_GB())
        await worker.set_resources(**{code_sha256(): 1.0})
        if worker.status is Status.running:
            # Dask looks for work that waits when a worker comes or goes on, not when one tells what it has: without
            # this, work whose workers had all died waited for ever beside those that were started again.
            worker.status = Status.paused
            worker.status = Status.running


class DaskWorkers:
    """The workers of a scheduler. Raises ClusterError if none answers."""

    def __init__(self, where: str, scheduler: str | LocalCluster, say: Say) -> None:
        self._where, self._scheduler, self._say = where, scheduler, say
        try:
            self._client = _client(scheduler)
        except Exception as e:  # another program than Dask may listen there: its bytes can raise any error
            raise ClusterError(f"{where}: no Dask scheduler answers; `dask scheduler` starts one") from e
        self._looked = 0.0
        self._ours, self._others = 0, dict[str, float]()  # workers of our code; others, and since when they are here
        self._told: set[str] = set()
        self._idle_since = time.monotonic()

    def unordered(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | GivenUp]]:
        self._label()
        left, more, pace = iter(items), True, _Pace()
        doubtful: list[T] = []
        out: Out = {}
        back: Back = queue.SimpleQueue()
        while more or out or doubtful:
            at_once = AHEAD * max(1, self._workers())
            while more and len(out) < at_once:
                together = list(islice(left, pace.together))
                more = len(together) == pace.together
                if together:
                    self._hand_in(work, _Task(together), out, back)
            if doubtful and not (more or out):
                self._hand_in(work, _Task([doubtful.pop()], alone=True), out, back)
            future = _first(back)
            if future in out and not future.cancelled():
                did = _outcome(future)
                if did is None:
                    back.put(future)  # asked for again, or cancelled in a moment
                    continue
                task = out.pop(future)
                if isinstance(did, _Did):
                    pace.took(did)
                    yield from _sound(zip(task.items, did.found, strict=True))
                elif task.alone:
                    yield task.items[0], did
                else:
                    doubtful += task.items
            lost = [future for future in out if future.cancelled()]
            if lost:
                self._reconnected()
                for future in lost:
                    self._hand_in(work, out.pop(future), out, back)

    def close(self) -> None:
        with suppress(Exception):  # it may be gone
            self._client.close(timeout=5)

    def _hand_in(self, work: Callable[[T], R], task: _Task, out: Out, back: Back) -> None:
        future = self._client.submit(_done, work, task.items, pure=False, resources={code_sha256(): 1.0})
        out[future] = task
        future.add_done_callback(back.put)

    def _label(self) -> None:
        with suppress(Exception):  # a worker without this module cannot load it: it stays without a label
            self._client.register_plugin(Labelled())

    def _workers(self) -> int:
        """Return how many workers run our code. Raises ClusterError if there has been none for too long."""
        now = time.monotonic()
        if now - self._looked > LOOK_S:
            self._looked = now
            self._look(now)
        if self._ours:
            self._idle_since = now
        elif now - self._idle_since > AWAY_S:
            raise ClusterError(f"{self._where}: no worker runs this version of accept{self._why_none()}")
        return self._ours

    def _look(self, now: float) -> None:
        try:
            there = self._client.scheduler_info(n_workers=-1)["workers"]
        except (OSError, TimeoutError, KeyError):
            return
        ours = {address for address, one in there.items() if code_sha256() in one["resources"]}
        self._ours = len(ours)
        self._others = {a: self._others.get(a, now) for a in there if a not in ours}
        for address, since in self._others.items():
            if now - since > NEW_S and address not in self._told:
                self._told.add(address)
                self._say(f"worker {address} runs another version of the code: refused, it is given no work")

    def _why_none(self) -> str:
        return f" ({len(self._others)} run another one; update them)" if self._others else " (there is none at all)"

    def _reconnected(self) -> None:
        self._say(f"{self._where}: the scheduler was lost; what had not come back is handed in again")
        deadline = time.monotonic() + AWAY_S
        self.close()
        while True:
            try:
                self._client = _client(self._scheduler)
                break
            except Exception as e:
                if time.monotonic() > deadline:
                    words = "the scheduler stays away; what came back is stored, run again"
                    raise ClusterError(f"{self._where}: {words}") from e
        self._idle_since = time.monotonic()
        self._label()


def _first(back: Back) -> Future[Any] | None:
    try:
        return back.get(timeout=LOOK_S)
    except queue.Empty:
        return None


def _done(work: Callable[[T], R], items: list[T]) -> _Did:
    began = time.monotonic()
    return _Did([_guarded(work, item) for item in items], time.monotonic() - began)


def _guarded(work: Callable[[T], R], item: T) -> R | GivenUp | _Raised:
    """Return the outcome for one item, an error in words: Dask pickles errors and loses some of them."""
    try:
        return work(item)
    except MemoryError:
        return GivenUp(worker_process.too_large())
    except Exception:  # noqa: BLE001
        return _Raised(traceback.format_exc())


def _outcome(future: Future[Any]) -> _Did | GivenUp | None:
    """Return the outcome of a task, None after a broken connection. Raises WorkFailed if it is lost for good."""
    if future.status == "error":
        error = future.exception()
        if isinstance(error, KilledWorker):
            return GivenUp("every worker that tried it died (out of memory?)")
        raise WorkFailed(repr(error))
    try:
        did: _Did = future.result()
    except (CancelledError, OSError, TimeoutError):
        return None
    return did


def _sound(pairs: Iterable[tuple[T, R | GivenUp | _Raised]]) -> Iterator[tuple[T, R | GivenUp]]:
    """Yield items and their outcomes. Raises WorkFailed, after the others, for an error that the work raised."""
    raised: _Raised | None = None
    for item, found in pairs:
        if isinstance(found, _Raised):
            raised = raised or found
        else:
            yield item, found
    if raised is not None:
        raise WorkFailed(raised.words)


@contextmanager
def connected(where: str, say: Say) -> Iterator[DaskWorkers]:
    """Connect as `accept.base.cluster.connect.connected` does."""
    with dask.config.set({KEPT: KEPT_MESSAGES}), _local_workers() if where == LOCAL else nullcontext() as local:
        workers = DaskWorkers(where, local or where, say)
        try:
            yield workers
        finally:
            workers.close()


@contextmanager
def _local_workers() -> Iterator[LocalCluster]:
    """Start a worker for each core. `Labelled` limits their memory as that of local processes; Dask's own limit, a
    share of this machine's memory, would kill units that can be judged here."""
    here, count = "127.0.0.1", os.cpu_count()
    with protected():  # also of workers that are started again
        local = LocalCluster(
            n_workers=count, threads_per_worker=1, memory_limit=0, host=here, dashboard_address=f"{here}:0"
        )
        try:
            yield local
        finally:
            local.close(timeout=10)


def _client(scheduler: str | LocalCluster) -> Client:
    return Client(scheduler, timeout=CONNECT_S, set_as_default=False)
