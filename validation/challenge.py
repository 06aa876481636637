"""The blind test: `make challenge`, or `python -m validation.challenge --set scatter-1 --cases 10`. Units are drawn,
their truth is sealed, its hash and those of thresholds and code are written down, and only then is anything run; the
workflow sees folders alone. Every finished unit is kept, so that a stopped run can be continued, or made in parts.

Seeds: thresholds are set with those in `DEVELOPMENT_SEEDS`; reports come from `REPORTED_SEED` only.
"""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from accept.base.cluster.connect import connected
from accept.base.runner import ClusterError, Workers, WorkFailed
from validation.cases import Case, seal
from validation.model_files import write_model
from validation.run_cases import METHOD, THREADS, Job, accept, run_all, talk
from validation.scoring.report import report_of_set, summary
from validation.scoring.results_store import Mixed, Store, stamp
from validation.scoring.scores import Lesson, Outcome
from validation.sets import SETS, Batch, Set, draw_set, order_of
from validation.shell import PUBLIC

REPORTED_SEED = 20270901  # another one after every change that a reported run has led to
DEVELOPMENT_SEEDS = range(1000)


def learn_all(batches: Sequence[Batch], base: Path, models: Path, code: str, workers: int) -> dict[str, Lesson]:
    """Learn a model from each batch, several batches at a time; return what came of each, by the batch's name."""
    tasks = [(batch, base, models / f"{code[:12]}-{batch.name}") for batch in batches]
    with ThreadPoolExecutor(max(workers, 1)) as pool:
        return dict(zip((b.name for b in batches), pool.map(lambda task: learned(*task), tasks), strict=True))


def learned(batch: Batch, base: Path, out: Path) -> Lesson:
    """Return what `accept model learn` makes of a batch's other units. What was learned before is kept."""
    done = out / "lesson.json"
    if not done.exists():
        talk(f"{batch.name}: learning from {len(batch.learn)} units")
        with tempfile.TemporaryDirectory(prefix="challenge-") as parent:
            folders = [str(case.write(Path(parent))) for case in batch.learn]
            ran = accept("model", "learn", *folders, "--model", str(base), "--out", str(out))
        made = (out / "population.toml").exists()
        error = None if made else f"exit {ran.code}: {ran.said.strip()[-500:]}"
        out.mkdir(parents=True, exist_ok=True)
        done.write_text(json.dumps([batch.name, len(folders), ran.seconds, ran.memory_MB, error]))
        talk(f"{batch.name}: {'learned' if made else error}; {ran.seconds:.0f} s of processor")
    name, units, seconds, memory, error = json.loads(done.read_text())
    return Lesson(name, out / "population.toml", units, seconds, memory, error)


def chosen_units(it: Set, batches: Sequence[Batch], number: int) -> dict[str, list[Case]]:
    """Return the first so many units to judge, by batch: of all benches in turn, or of one batch after the other. Weak
    ones are all taken."""
    judged = [(b.name, case) for b in batches if b.name != "weak" for case in b.judge]
    if it.benches is not None:
        judged.sort(key=lambda each: order_of(each[1]))
    judged = judged[:number] + [(b.name, case) for b in batches if b.name == "weak" for case in b.judge]
    return {name: [case for own, case in judged if own == name] for name, _ in judged}


def control_jobs(jobs: Sequence[Job], number: int) -> list[Job]:
    """Return the first units with one effect, each with a library that does not have it."""
    single = [job for job in jobs if job.case.kind == "one"][:number]
    return [replace(job, without=tuple(job.case.effects), misalign=False) for job in single]


def challenge_set(name: str, a: argparse.Namespace, cluster: Workers | None = None) -> tuple[list[Outcome], bool]:
    """Draw, seal, run and score one set; return its outcomes, and whether every target is met."""
    it, out = SETS[name], a.out / name
    first = it.units if a.cases is None else a.cases
    batches = draw_set(name, a.seed, max(first, it.units), a.weak if it.exact else 0)
    text, digest = seal([case for b in batches for case in (*b.learn, *b.judge)])
    version = stamp(digest)
    head = _sealed(name, a.seed, version, out)
    base = write_model(it, out / "model")
    truth, chosen = json.loads(text), chosen_units(it, batches, first)
    lessons = learn_all(
        [b for b in batches if b.learn and b.name in chosen], base, out / "models", version.code, a.workers
    )
    jobs = []
    for batch in batches:
        lesson = lessons.get(batch.name)
        model = base if lesson is None else lesson.model
        given = {
            "method": a.method,
            "model": model,
            "misalign": True,
            "unlearned": lesson.error if lesson else None,
        }
        jobs += [Job(case, truth[case.serial], **given) for case in chosen.get(batch.name, ())]
    if it.benches is not None:
        jobs.sort(key=lambda job: order_of(job.case))
    controls = control_jobs(jobs, a.controls) if it.exact else []
    outcomes = run_all([*jobs, *controls], a.workers, Store(out / "cases", version), cluster)
    (out / "truth.json").write_text(text)  # after the run: it may not lie beside the folders while they are judged
    said, met = report_of_set(name, outcomes[: len(jobs)], outcomes[len(jobs) :], list(lessons.values()))
    print(said, flush=True)
    (out / "report.txt").write_text(f"{head}\n{said}\n")
    return outcomes[: len(jobs)], met


def _sealed(name: str, seed: int, version: Any, out: Path) -> str:
    """Write down the hashes of the truth, of the thresholds and of the code, before anything is run."""
    use = " (development)" if seed in DEVELOPMENT_SEEDS else ""
    head = f"set {name} of seed {seed}{use}\ntruth      sha256 {version.sealed}\n"
    head += f"thresholds sha256 {version.thresholds}\ncode       sha256 {version.code}"
    out.mkdir(parents=True, exist_ok=True)
    (out / "sealed.txt").write_text(head + "\n")
    print(head, flush=True)
    return head


def challenge(a: argparse.Namespace) -> bool:
    """Run every requested set; return whether every target is met."""
    os.environ.setdefault("ACCEPT_HOME", str((a.out / "home").resolve()))
    for name in THREADS:  # one core for each worker: read when the worker loads its libraries
        os.environ.setdefault(name, "1")
    with connected(a.cluster, talk) as cluster:
        found = {name: challenge_set(name, a, cluster) for name in a.set or SETS}
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
    parser.add_argument("--cluster", help="Dask scheduler (tcp://HOST:8786) whose workers run the units, or local")
    parser.add_argument("--out", type=Path, default=Path("out/challenge"))
    parser.add_argument(
        "--method", "--workflow", default=METHOD, help="name, module:function, or a command with {unit} and {model}"
    )
    a = parser.parse_args()
    if not PUBLIC.exists():
        print(f"skipped: {PUBLIC} is not there; python -m validation.data.fetch", file=sys.stderr)
        return 0
    try:
        return 0 if challenge(a) else 3
    except (Mixed, ClusterError, WorkFailed) as e:
        print(e, file=sys.stderr)
        return 6


if __name__ == "__main__":
    sys.exit(main())
