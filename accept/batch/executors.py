"""Executors of jobs: this process, others of this machine, or a cluster. The outcome is the same.

A job is of one unit, and may write files below its folder `out`; files written on another machine come back with its
outcome, all or none.
"""

import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

from accept.base import worker_process
from accept.base.atomic_files import write_atomic
from accept.base.child_processes import process_pool
from accept.base.cluster.work import Cluster, GivenUp
from accept.units.shared_folder import anywhere
from accept.units.unit_folder import UnitFolder, inside

MIN_UNITS_PER_WORKER = 3  # a worker takes about a second to start: fewer units are done sooner in this process


class Job(Protocol):
    """A frozen dataclass that can be sent to another process."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def unit(self) -> UnitFolder: ...

    @property
    def out(self) -> Path | None: ...

    def run(self) -> Any:
        """Do the job and return its outcome."""
        ...


J = TypeVar("J", bound=Job)


class Executor(Protocol):
    """Runs jobs of units."""

    def run(self, jobs: Iterable[J]) -> Iterator[tuple[J, Any]]:
        """Yield each job with its outcome, as they come back; GivenUp if no worker could do it."""
        ...


def executor(
    workers: int | None = None, pool: ProcessPoolExecutor | None = None, cluster: Cluster | None = None
) -> Executor:
    """Return the executor for these options: a cluster, a number of processes, or as many processes as the work
    needs."""
    return Processes(workers, pool) if cluster is None else OnCluster(cluster)


def processes(count: int) -> ProcessPoolExecutor:
    """Return fresh processes, which share nothing with this one, end with it and have a limit of memory."""
    return process_pool(count, worker_process.begin)


@dataclass(frozen=True)
class Processes:
    """Jobs done in this process, or in fresh ones if there is enough to do; a worker that dies costs only its own unit.
    workers: how many, None for as many as pay. pool: one that runs already; the longest job is then done by this
    process, which must not be one that could break it."""

    workers: int | None = None
    pool: ProcessPoolExecutor | None = None

    def run(self, jobs: Iterable[J]) -> Iterator[tuple[J, Any]]:
        jobs = list(jobs)
        worthwhile = min(os.cpu_count() or 1, len(jobs) // MIN_UNITS_PER_WORKER)
        count = worthwhile if self.workers is None else self.workers
        if count <= 1 or len(jobs) <= 1:
            yield from ((job, job.run()) for job in jobs)
            return
        left = dict(enumerate(sorted(jobs, key=_bytes, reverse=True)))  # the longest first: no worker waits for it
        try:
            with nullcontext(self.pool) if self.pool else processes(min(count, len(jobs))) as running:
                own = 0 if self.pool else None
                pending = {running.submit(job.run): key for key, job in left.items() if key != own}
                if own is not None:
                    yield left[own], left[own].run()
                    del left[own]
                try:
                    for future in as_completed(pending):
                        outcome = future.result()
                        yield left.pop(pending[future]), outcome
                except KeyboardInterrupt:
                    running.shutdown(wait=True, cancel_futures=True)  # what is under way ends, nothing else is begun
                    raise
        except BrokenProcessPool:
            yield from ((job, _run_apart(job)) for job in left.values())


def _bytes(job: Job) -> int:
    """Return the size of the files in a unit's folder, a measure of how long its job takes."""
    return sum(path.stat().st_size for path in job.unit.path.iterdir() if path.is_file())


def _run_apart(job: Job) -> Any:
    """Do a job in a process of its own after a worker died; the unit that kills its worker is given up."""
    try:
        with processes(1) as pool:
            return pool.submit(job.run).result()
    except BrokenProcessPool:
        return GivenUp("the process that judged it died (out of memory?)")


@dataclass(frozen=True)
class OnCluster:
    """Jobs done by workers of a cluster, each of which must see the same folder of the unit."""

    cluster: Cluster

    def run(self, jobs: Iterable[J]) -> Iterator[tuple[J, Any]]:
        handed = (replace(job, unit=anywhere(job.unit)) for job in jobs)
        for job, back in self.cluster.unordered(run_remotely, handed):
            if isinstance(back, GivenUp):
                yield job, back
                continue
            if job.out is not None:
                _put(back, job.out)
            yield job, back.outcome


@dataclass(frozen=True, eq=False)
class Returned:
    """The return of a job: its outcome, and its files by their names below the folder where it wrote them."""

    outcome: Any
    files: Mapping[str, bytes]
    place: Path


def run_remotely(job: Job) -> Returned:
    """Run a job on another machine than the one where its files belong."""
    with tempfile.TemporaryDirectory(prefix="accept-") as folder:
        place = Path(folder).resolve()
        outcome = replace(job, out=place).run()
        files = {p.relative_to(place).as_posix(): p.read_bytes() for p in place.rglob("*") if p.is_file()}
    return Returned(outcome, files, place)


def _put(back: Returned, out: Path) -> None:
    """Write the files to their place; a model names its own files from there."""
    for name, content in back.files.items():
        path = inside(out, name)
        if path.suffix == ".toml":
            from accept.models.model_file import with_moved_paths  # loads what builds models: only when one came

            content = with_moved_paths(content, (back.place / name).parent, path.parent)
        write_atomic(path, content)
