"""Work on units by a cluster: each must be the same folder there, and the files that the work writes come back with its
outcome, all or none."""

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Generic, TypeVar

from accept.base.atomic_files import write_atomic
from accept.base.cluster.work import Cluster, GivenUp
from accept.units.shared_folder import anywhere
from accept.units.unit_folder import inside

R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class Returned(Generic[R]):
    """What comes back of a job: its outcome, and its files by their names below the folder where it wrote them."""

    outcome: R
    files: Mapping[str, bytes]
    place: Path


def done_far(jobs: Iterable[partial[R]], cluster: Cluster | None) -> Iterator[tuple[partial[R], R | GivenUp]]:
    """Each job with its outcome, as they come back; done in this process where there is no cluster. A job is of one
    unit, its first argument, and writes into the folder `out`; what it wrote elsewhere is then there."""
    handed = map(for_another, jobs)
    for job, back in cluster.unordered(run_far, handed) if cluster else ((job, run_far(job)) for job in handed):
        if isinstance(back, GivenUp):
            yield job, back
            continue
        _put(back, job.keywords["out"])
        yield job, back.outcome


def for_another(job: partial[R]) -> partial[R]:
    """The job as another machine is handed it."""
    return partial(job.func, anywhere(job.args[0]), *job.args[1:], **job.keywords)


def run_far(job: partial[R]) -> Returned[R]:
    """Do it far from where its files belong."""
    with tempfile.TemporaryDirectory(prefix="accept-") as folder:
        place = Path(folder).resolve()
        outcome = job(out=place)
        files = {p.relative_to(place).as_posix(): p.read_bytes() for p in place.rglob("*") if p.is_file()}
    return Returned(outcome, files, place)


def _put(back: Returned[R], out: Path) -> None:
    """The files where they belong; a model names its own files from there."""
    for name, content in back.files.items():
        path = inside(out, name)
        if path.suffix == ".toml":
            from accept.models.model_file import moved  # loads what builds models: only when one came

            content = moved(content, (back.place / name).parent, path.parent)
        write_atomic(path, content)
