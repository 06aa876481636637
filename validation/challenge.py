"""The blind test: `make challenge`, or `python -m validation.challenge --set scatter-1 --cases 10`. Units are drawn,
their truth is sealed, its hash and those of thresholds and code are written down, and only then is anything run; the
workflow sees folders alone. Every finished unit is kept, so that a run goes on where it was stopped and can be made in
pieces.

Seeds: whoever sets thresholds uses those in `DEVELOPMENT_SEEDS`; what is reported comes from `REPORTED_SEED` alone.
"""

import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

from validation.cases import Case, seal
from validation.model_files import write_model
from validation.report import report_of_set, summary
from validation.results_store import Mixed, Store, stamp
from validation.scores import Outcome
from validation.sets import SETS, Batch, draw_set
from validation.shell import MATRICES
from validation.strut import MODEL_FILE

REPORTED_SEED = 20261125  # another one after every change that a reported run has led to
DEVELOPMENT_SEEDS = range(1000)
WORKFLOW = "accept.gap.analyse_unit:run_gap"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
PATIENCE_S = 900.0
ROOT = Path(__file__).parent.parent


class Workflow(Protocol):
    """Folder and model file in, gap.json as a mapping out. without: effects that the library is to do without."""

    def __call__(
        self, folder: Path, model: Path, out: Path | None, without: Sequence[str] = ()
    ) -> Mapping[str, Any]: ...


@dataclass(frozen=True)
class Job:
    """One unit to run with a model file. without: effects to take out of the library, which makes it a control;
    misalign: `accept misalign` is asked too, where nothing else is hidden."""

    case: Case
    truth: Mapping[str, Any]
    workflow: str = WORKFLOW
    without: tuple[str, ...] = ()
    model: Path = MODEL_FILE
    misalign: bool = False

    @property
    def name(self) -> str:
        return "-".join((self.case.serial, *self.without))


def run(job: Job) -> Outcome:
    """Record the unit, hand its folder over, forget it. Whatever the workflow raises is an outcome of its own."""
    module, function = job.workflow.split(":")
    workflow: Workflow = getattr(importlib.import_module(module), function)
    with tempfile.TemporaryDirectory(prefix="challenge-") as parent:
        folder = job.case.write(Path(parent))
        start, busy = time.perf_counter(), time.process_time()
        try:
            # through text, as it is promised: what json cannot hold is an error as well
            gap, error = json.loads(json.dumps(workflow(folder, job.model, None, without=job.without))), None
        except Exception as e:  # noqa: BLE001 a crash of the workflow is what this has to count
            gap, error = {}, f"{type(e).__name__}: {e}"
        wall, seconds = time.perf_counter() - start, time.process_time() - busy
        asked = job.misalign and not set(job.case.effects) - {"misalignment"} and not job.case.outside
        misalign = _misalign(folder, job.model) if asked else None
    truth = {**job.truth, "detectability": job.case.detectability()}
    return Outcome(job.case.serial, truth, gap, seconds, error, job.without, wall, misalign)


def _misalign(folder: Path, model: Path) -> Mapping[str, Any]:
    """What `accept misalign` writes; nothing where it wrote none."""
    out = folder.parent / "misalign.json"
    done = _accept("misalign", str(folder), "--model", str(model), "--json", str(out))
    return dict(json.loads(out.read_text())) if out.exists() else {"reason": f"exit {done.returncode}: {done.stderr}"}


def _accept(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "accept", *arguments],
        cwd=ROOT,
        env={**os.environ, **dict.fromkeys(THREADS, "1")},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


def learned(batch: Batch, base: Path, out: Path) -> Path:
    """The model file that `accept model learn` makes of a batch's other units; raises RuntimeError where it makes none.
    A file that is there stays."""
    path = out / "population.toml"
    if path.exists():
        return path
    _talk(f"{batch.name}: learning from {len(batch.learn)} units")
    with tempfile.TemporaryDirectory(prefix="challenge-") as parent:
        folders = [str(case.write(Path(parent))) for case in batch.learn]
        done = _accept("model", "learn", *folders, "--model", str(base), "--out", str(out))
    if not path.exists():
        raise RuntimeError(f"{batch.name}: nothing was learned, exit {done.returncode}: {done.stderr}")
    return path


def run_all(jobs: Sequence[Job], workers: int, store: Store | None = None) -> list[Outcome]:
    """All outcomes, in the order of the jobs. store: of finished ones, which are not run again. Raises Mixed."""
    done = {} if store is None else store.finished({job.name: job.case.seed for job in jobs})
    left = [job for job in jobs if job.name not in done]
    if done:
        _talk(f"{len(done)} of {len(jobs)} were finished before")
    for count, (job, outcome) in enumerate(_finished(left, workers), start=len(done) + 1):
        done[job.name] = outcome
        if store is not None:
            store.keep(job.name, job.case.seed, outcome)
        truth = "+".join((*outcome.truth["effects"], *outcome.truth["outside"])) or "nothing"
        said = "+".join(outcome.named) or outcome.label
        _talk(f"{count:4d}/{len(jobs)} {job.name}: {said} ({outcome.verdict}), was {truth}; {outcome.seconds:.1f} s")
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


def _talk(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def control_jobs(jobs: Sequence[Job], number: int) -> list[Job]:
    """The first units with one effect, each with a library that does not have it."""
    single = [job for job in jobs if job.case.kind == "one"][:number]
    return [replace(job, without=tuple(job.case.effects), misalign=False) for job in single]


def challenge_set(name: str, a: argparse.Namespace) -> tuple[list[Outcome], bool]:
    """Draw, seal, run, score one set: its outcomes, and whether every target is met."""
    it, out = SETS[name], a.out / name
    first = it.units if a.cases is None else a.cases
    batches = draw_set(name, a.seed, max(first, it.units), a.weak if it.exact else 0)
    text, digest = seal([case for b in batches for case in (*b.learn, *b.judge)])
    version = stamp(digest)
    head = _sealed(name, a.seed, version, out)
    base = write_model(it, out / "model")
    truth, jobs = json.loads(text), []
    for batch in batches:
        cases = batch.judge if batch.name == "weak" else batch.judge[: max(first - len(jobs), 0)]
        if not cases:
            continue
        model = learned(batch, base, out / "models" / f"{version.code[:12]}-{batch.name}") if batch.learn else base
        jobs += [Job(case, truth[case.serial], a.workflow, model=model, misalign=True) for case in cases]
    controls = control_jobs(jobs, a.controls) if it.exact else []
    outcomes = run_all([*jobs, *controls], a.workers, Store(out / "cases", version))
    (out / "truth.json").write_text(text)  # after the run: it may not lie beside the folders while they are judged
    said, met = report_of_set(name, outcomes[: len(jobs)], outcomes[len(jobs) :])
    print(said, flush=True)
    (out / "report.txt").write_text(f"{head}\n{said}\n")
    return outcomes[: len(jobs)], met


def _sealed(name: str, seed: int, version: Any, out: Path) -> str:
    """Written down before anything is run: the hashes of the truth, of the thresholds and of the code."""
    use = " (development)" if seed in DEVELOPMENT_SEEDS else ""
    head = f"set {name} of seed {seed}{use}\ntruth      sha256 {version.sealed}\n"
    head += f"thresholds sha256 {version.thresholds}\ncode       sha256 {version.code}"
    out.mkdir(parents=True, exist_ok=True)
    (out / "sealed.txt").write_text(head + "\n")
    print(head, flush=True)
    return head


def challenge(a: argparse.Namespace) -> bool:
    """Every set that was asked for. Returns whether every target is met."""
    os.environ.setdefault("ACCEPT_HOME", str((a.out / "home").resolve()))
    found = {name: challenge_set(name, a) for name in a.set or SETS}
    said, met = summary({name: outcomes for name, (outcomes, _) in found.items()})
    print(said)
    (a.out / "summary.txt").write_text(said + "\n")
    return met and all(each for _, each in found.values())


def main() -> int:
    parser = argparse.ArgumentParser(prog="challenge", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--set", action="append", choices=list(SETS), help="only this set; may be given again")
    parser.add_argument("--cases", type=int, help="only the first so many units of each set, or more than it has")
    parser.add_argument("--seed", type=int, default=REPORTED_SEED)
    parser.add_argument("--controls", type=int, default=15, help="exact units run again without their effect")
    parser.add_argument("--weak", type=int, default=0, help="units with one weak effect: power, and no part of the mix")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("out/challenge"))
    parser.add_argument("--workflow", default=WORKFLOW, help="module:function to put to the test")
    a = parser.parse_args()
    if not MATRICES.exists():
        print(f"skipped: the blind units need the super-element matrices, and {MATRICES} is not there", file=sys.stderr)
        return 0
    try:
        return 0 if challenge(a) else 3
    except Mixed as e:
        print(e, file=sys.stderr)
        return 6


if __name__ == "__main__":
    sys.exit(main())
