"""Where units are judged: in this process, in others of this machine, or on a cluster. What comes back is the same."""

import os
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from pathlib import Path

from accept.base import worker_process
from accept.base.child_processes import process_pool
from accept.base.cluster.work import Cluster, GivenUp
from accept.batch.cluster_jobs import done_far
from accept.batch.worker import Job, JudgedOrRefused
from accept.units.unit_folder import UnitFolder

MIN_UNITS_PER_WORKER = 3  # a worker takes about a second to start: fewer units are done sooner in this process


def processes(count: int) -> ProcessPoolExecutor:
    """Fresh ones, which share nothing with this one, end with it and have a limit of memory."""
    return process_pool(count, worker_process.begin)


def judge_far(jobs: Iterable[Job], cluster: Cluster) -> Iterator[tuple[Job, JudgedOrRefused]]:
    """Judge on a cluster; a unit that no worker can judge is refused."""
    for job, outcome in done_far(jobs, cluster):
        yield job, f"{folder_of(job)}: {outcome}" if isinstance(outcome, GivenUp) else outcome


def judge_here(
    jobs: list[Job], workers: int | None, pool: ProcessPoolExecutor | None = None
) -> Iterator[tuple[Job, JudgedOrRefused]]:
    """Judge here, or in fresh processes when there is enough to do; a worker that dies costs only its own unit. With a
    pool of its own the caller judges the longest unit here."""
    wanted = workers if workers is not None else min(os.cpu_count() or 1, len(jobs) // MIN_UNITS_PER_WORKER)
    if wanted <= 1 or len(jobs) <= 1:
        yield from ((job, job()) for job in jobs)
        return
    left = dict(enumerate(sorted(jobs, key=_bytes, reverse=True)))  # the longest first, so that no worker waits for it
    try:
        with nullcontext(pool) if pool else processes(min(wanted, len(jobs))) as running:
            own = 0 if pool else None
            pending = {running.submit(job): key for key, job in left.items() if key != own}
            if own is not None:
                yield left[own], left[own]()
                del left[own]
            try:
                for future in as_completed(pending):
                    judged = future.result()
                    yield left.pop(pending[future]), judged
            except KeyboardInterrupt:
                running.shutdown(wait=True, cancel_futures=True)  # what is under way ends, nothing else is begun
                raise
    except BrokenProcessPool:
        yield from ((job, _judge_apart(job)) for job in left.values())


def folder_of(job: Job) -> Path:
    """Of the unit that a job judges."""
    unit: UnitFolder = job.args[0]
    return unit.path


def _bytes(job: Job) -> int:
    """Of the files in a unit's folder, which say how long it takes."""
    return sum(path.stat().st_size for path in folder_of(job).iterdir() if path.is_file())


def _judge_apart(job: Job) -> JudgedOrRefused:
    """Judge one unit in a process of its own after a worker died; the unit that kills its worker is refused."""
    try:
        with processes(1) as pool:
            return pool.submit(job).result()
    except BrokenProcessPool:
        return f"{folder_of(job)}: the process that judged it died (out of memory?)"
