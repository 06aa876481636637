"""Drawn units handed to the workflow: here, in processes of this machine, or on a Dask cluster. The outcomes are the
same wherever a unit was run; only their times differ."""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from math import nan
from multiprocessing import get_context
from pathlib import Path
from threading import Timer
from typing import Any

from accept.base.runner import GivenUp, Workers
from validation.cases import Case
from validation.methods.call import PATIENCE_S, method_of
from validation.scoring.results_store import Store, stamp
from validation.scoring.scores import Outcome
from validation.shell import matrices
from validation.strut import MODEL_FILE

METHOD = "gap"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
ROOT = Path(__file__).parent.parent


@dataclass(frozen=True)
class Job:
    """One unit to run with a model file. without: effects to take out of the library, which makes it a control;
    misalign: `accept misalign` is run too, if no other effect is hidden; unlearned: why its bench's model could not be
    learned, which is the unit's outcome then."""

    case: Case
    truth: Mapping[str, Any]
    method: str = METHOD
    without: tuple[str, ...] = ()
    model: Path = MODEL_FILE
    misalign: bool = False
    unlearned: str | None = None

    @property
    def name(self) -> str:
        return "-".join((self.case.serial, *self.without))


def run(job: Job) -> Outcome:
    """Record the unit, run the workflow on its folder and delete it. Any exception of the workflow is an outcome
    too."""
    if job.unlearned is not None:
        return Outcome(job.case.serial, job.truth, {}, nan, f"NotLearned: {job.unlearned}", job.without)
    method = method_of(job.method)
    with tempfile.TemporaryDirectory(prefix="challenge-") as parent:
        folder = job.case.write(Path(parent))
        forget_peak()
        start, busy = time.perf_counter(), time.process_time()
        try:
            # through text, as it is promised: what json cannot hold is an error as well
            gap, error = json.loads(json.dumps(method(folder, job.model, without=job.without))), None
        except Exception as e:  # noqa: BLE001 a crash of the workflow is what this has to count
            gap, error = {}, f"{type(e).__name__}: {e}"
        wall, seconds, memory = time.perf_counter() - start, time.process_time() - busy, peak_MB()
        asked = job.misalign and not set(job.case.effects) - {"misalignment"} and not job.case.outside
        misalign, cost = _misalign(folder, job.model) if asked else (None, ())
    truth = {**job.truth, "detectability": job.case.detectability()}
    return Outcome(job.case.serial, truth, gap, seconds, error, job.without, wall, misalign, memory, *cost)


def _misalign(folder: Path, model: Path) -> tuple[Mapping[str, Any], tuple[float, float]]:
    """Return the document that `accept misalign` writes, or the reason if it wrote none; with seconds and memory."""
    out = folder.parent / "misalign.json"
    done = accept("misalign", str(folder), "--model", str(model), "--json", str(out))
    found = dict(json.loads(out.read_text())) if out.exists() else {"reason": f"exit {done.code}: {done.said}"}
    return found, (done.seconds, done.memory_MB)


def forget_peak() -> None:
    """Let the peak of this process's memory begin anew, if the system can."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_MB() -> float | None:
    """Return the most memory that this process held since `forget_peak`, or none if the system does not tell."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) / 1024
    return None


@dataclass(frozen=True)
class Ran:
    """A finished program: exit code, what it said to stderr, seconds of processor, the most memory."""

    code: int
    said: str
    seconds: float
    memory_MB: float


def accept(*arguments: str) -> Ran:
    """Run the program itself, on one core, and end it if it takes longer than anybody waits."""
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "accept", *arguments],
            cwd=ROOT,
            env={**os.environ, **dict.fromkeys(THREADS, "1")},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
        )
        patience = Timer(PATIENCE_S, process.kill)
        patience.start()
        _, status, used = os.wait4(process.pid, 0)
        patience.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read().decode(errors="replace")
    return Ran(process.returncode, text, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def run_all(
    jobs: Sequence[Job], workers: int, store: Store | None = None, cluster: Workers | None = None
) -> list[Outcome]:
    """Run all jobs and return their outcomes, in the order of the jobs. workers: processes of this machine, 0 for none
    beside this one; cluster: works instead of them. store: of finished ones, which are not run again. Raises Mixed,
    ClusterError, WorkFailed."""
    done = {} if store is None else store.finished({job.name: job.case.seed for job in jobs})
    left = [job for job in jobs if job.name not in done]
    if done:
        talk(f"{len(done)} of {len(jobs)} were finished before")
    finished = _finished(left, workers) if cluster is None else _far(left, cluster)
    for count, (job, outcome) in enumerate(finished, start=len(done) + 1):
        done[job.name] = outcome
        if store is not None:
            store.keep(job.name, job.case.seed, outcome)
        truth = "+".join((*outcome.truth["effects"], *outcome.truth["outside"])) or "nothing"
        said = "+".join(outcome.named) or outcome.label
        talk(f"{count:4d}/{len(jobs)} {job.name}: {said} ({outcome.verdict}), was {truth}; {outcome.seconds:.1f} s")
    return [done[job.name] for job in jobs]


def _finished(jobs: Sequence[Job], workers: int) -> Iterable[tuple[Job, Outcome]]:
    if workers == 0:
        yield from ((job, run(job)) for job in jobs)
        return
    for name in THREADS:  # one core for each worker: read when the worker loads its libraries
        os.environ.setdefault(name, "1")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        running = {pool.submit(run, job): job for job in jobs}
        for future in as_completed(running):
            yield running[future], future.result()


def _far(jobs: Sequence[Job], cluster: Workers) -> Iterable[tuple[Job, Outcome]]:
    """Yield jobs and outcomes from a cluster; a unit that no worker could do counts as a crash of the workflow."""
    looks = {model: looks_of(model) for model in {job.model for job in jobs}}
    for (job, _), found in cluster.unordered(run_far, [(job, looks[job.model]) for job in jobs]):
        if isinstance(found, GivenUp):
            found = Outcome(job.case.serial, job.truth, {}, 0.0, f"GivenUp: {found}", job.without)
        yield job, found


def run_far(item: tuple[Job, Mapping[str, str]]) -> Outcome:
    """Call `run` in a worker. Raises RuntimeError if the worker has other code or files: a score of those would mean
    nothing."""
    job, looks = item
    here = looks_of(job.model)
    differs = [what for what in looks if looks[what] != here[what]]
    if differs:
        raise RuntimeError(f"{ROOT}: {', '.join(differs)} differ from the coordinator's; share them with every worker")
    return run(job)


def looks_of(model: Path) -> Mapping[str, str]:
    """Return the hashes of everything that a unit is run with: code (of this validation too), matrices, model file."""
    return {"code": _code(), str(matrices()): _hash(matrices()), str(model): _hash(model)}


@cache
def _code() -> str:
    return stamp("").code


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "not there"


def talk(text: str) -> None:
    """Print progress to stderr."""
    print(text, file=sys.stderr, flush=True)
