"""The blind test: `make challenge`, or `python -m validation.challenge --cases 300`. Units are drawn, their truth is
sealed, its hash and that of the thresholds are printed, and only then is anything run; the workflow sees folders alone.

Seeds: whoever sets thresholds uses those in `DEVELOPMENT_SEEDS`; what is reported comes from `REPORTED_SEED` alone.
"""

import argparse
import importlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

from validation.cases import Case, draw_cases, draw_weak, seal
from validation.results_store import Mixed, Store, stamp
from validation.scores import Outcome, Score, confusion, controls, details, power, scores
from validation.strut import MATRICES, MODEL_FILE

REPORTED_SEED = 20261121
DEVELOPMENT_SEEDS = range(1000)
WORKFLOW = "accept.gap.analyse_unit:run_gap"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Workflow(Protocol):
    """Folder and model file in, gap.json as a mapping out. without: effects that the library is to do without."""

    def __call__(
        self, folder: Path, model: Path, out: Path | None, without: Sequence[str] = ()
    ) -> Mapping[str, Any]: ...


@dataclass(frozen=True)
class Job:
    """One unit to run. without: effects to take out of the library, which makes it a control."""

    case: Case
    truth: Mapping[str, Any]
    workflow: str = WORKFLOW
    without: tuple[str, ...] = ()

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
            gap, error = json.loads(json.dumps(workflow(folder, MODEL_FILE, None, without=job.without))), None
        except Exception as e:  # noqa: BLE001 a crash of the workflow is what this has to count
            gap, error = {}, f"{type(e).__name__}: {e}"
        wall, seconds = time.perf_counter() - start, time.process_time() - busy
    truth = {**job.truth, "detectability": job.case.detectability()}
    return Outcome(job.case.serial, truth, gap, seconds, error, job.without, wall)


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
    return [Job(job.case, job.truth, job.workflow, tuple(job.case.effects)) for job in single]


def report(outcomes: Sequence[Outcome], removed: Sequence[Outcome]) -> str:
    """Everything that a run has to say, as text."""
    parts = [_table(scores(outcomes)), "Controls", _table(controls(outcomes, removed))]
    parts += ["In detail", _table(details(outcomes))]
    parts += ["Truth, and what was said first", *_confusion(outcomes), "Seen, against detectability", *_power(outcomes)]
    failures = [f"  {o.serial}: {o.error}" for o in (*outcomes, *removed) if o.error]
    wrong = [f"  {o.serial}: {', '.join(o.false_names)}, was {_was(o)}" for o in outcomes if o.false_names]
    return "\n".join([*parts, "False names", *(wrong or ["  none"]), "Errors", *(failures or ["  none"])])


def _was(o: Outcome) -> str:
    return "+".join((*o.truth["effects"], *o.truth["outside"])) or "nothing"


def _table(rows: Sequence[Score]) -> str:
    lines = [f"{'score':47} {'value':>8} {'n':>4}  {'interval':19} {'target':16} "]
    for s in rows:
        verdict = ("met" if s.met else ("NOT MET" if s.n else "NOT MEASURED")) if s.target else ""
        lines.append(f"{s.name:47} {s.value:8.3f} {s.n:4d}  {s.lo:8.3f} ..{s.hi:8.3f} {s.target:16} {verdict}")
    return "\n".join(lines)


def _confusion(outcomes: Sequence[Outcome]) -> list[str]:
    return [
        f"  {truth:26} " + ", ".join(f"{said} {n}" for said, n in row.most_common())
        for truth, row in confusion(outcomes).items()
    ]


def _power(outcomes: Sequence[Outcome]) -> list[str]:
    return [
        f"  {lo:9.0f} ..{hi:9.0f} sd: {s.value:6.1%} of {s.n} ({s.lo:.1%} .. {s.hi:.1%})"
        for lo, hi, s in power(outcomes)
    ]


def challenge(a: argparse.Namespace) -> bool:
    """Draw, seal, run, score. Returns whether every target is met."""
    number, seed, out = a.cases, a.seed, a.out
    out.mkdir(parents=True, exist_ok=True)
    cases = [*draw_cases(number, seed), *draw_weak(a.weak, seed)]
    text, digest = seal(cases)
    version = stamp(digest)
    use = " (development)" if seed in DEVELOPMENT_SEEDS else ""
    head = f"{number} units of seed {seed}{use}, {a.weak} with weak effects, {a.controls} controls\n"
    head += f"truth      sha256 {digest}\nthresholds sha256 {version.thresholds}\ncode       sha256 {version.code}"
    print(head, flush=True)
    truth = json.loads(text)
    jobs = [Job(case, truth[case.serial], a.workflow) for case in cases]
    every = [*jobs, *control_jobs(jobs, a.controls)]
    outcomes = run_all(every, a.workers, Store(out / "cases", version))
    (out / "truth.json").write_text(text)  # after the run: it may not lie beside the folders while they are judged
    blind, removed = outcomes[: len(jobs)], outcomes[len(jobs) :]
    said = report(blind, removed)
    print(said)
    (out / "report.txt").write_text(f"{head}\n{said}\n")
    return all(s.met for s in (*scores(blind), *controls(blind, removed)))


def main() -> int:
    parser = argparse.ArgumentParser(prog="challenge", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--seed", type=int, default=REPORTED_SEED)
    parser.add_argument("--controls", type=int, default=30, help="units run again without their effect in the library")
    parser.add_argument(
        "--weak", type=int, default=36, help="units with one weak effect: power, and no part of the mix"
    )
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
