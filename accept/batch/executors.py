"""Jobs of units, run in this process, in others of this machine, or on a cluster. The outcome is the same.

A job is of one unit, and may write files below its folder `out`; files written on another machine come back with its
outcome, all or none.
"""

import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from operator import methodcaller
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

from accept.base.atomic_files import write_atomic
from accept.base.runner import GivenUp, Processes, Workers
from accept.units import UnitFolder, anywhere, inside

MIN_UNITS_PER_WORKER = 3  # a worker takes about a second to start: fewer units are done sooner in this process


class Job(Protocol):
    """A frozen dataclass that can be sent to another process."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def unit(self) -> UnitFolder: ...

    @property
    def out(self) -> Path | None: ...

    def run(self) -> Any: ...


J = TypeVar("J", bound=Job)


def run_jobs(
    jobs: Iterable[J],
    workers: int | None = None,
    pool: ProcessPoolExecutor | None = None,
    cluster: Workers | None = None,
) -> Iterator[tuple[J, Any]]:
    """Yield each job with its outcome, as they come back; GivenUp if no worker could do it.

    workers: processes of this machine, None for as many as pay. pool: processes that run already. cluster: in place of
    both; each of its workers must see the same folder of the unit."""
    if cluster is not None:
        yield from _on_cluster(cluster, jobs)
        return
    jobs = list(jobs)
    worthwhile = min(os.cpu_count() or 1, len(jobs) // MIN_UNITS_PER_WORKER)
    here = Processes(worthwhile if workers is None else workers, pool)
    if here.count > 1:
        # the longest first, as the size of its files tells: no worker waits for it
        jobs.sort(key=lambda job: sum(p.stat().st_size for p in job.unit.path.iterdir() if p.is_file()), reverse=True)
    yield from here.unordered(methodcaller("run"), jobs)


def _on_cluster(cluster: Workers, jobs: Iterable[J]) -> Iterator[tuple[J, Any]]:
    handed = (replace(job, unit=anywhere(job.unit)) for job in jobs)
    for job, back in cluster.unordered(run_remotely, handed):
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
