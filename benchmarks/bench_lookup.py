"""What the table buys, as ratios measured in one run: `python benchmarks/bench_lookup.py`."""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before numpy: one thread each, so that the ratio is that of the work
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np  # noqa: E402 - the thread count must be set first

from accept.models.lookup_cache import Plan, build, read_table  # noqa: E402
from accept.models.model_file import open_model  # noqa: E402
from checks.misalignment import MisalignmentTable, estimate_misalignment  # noqa: E402
from checks.model import Model  # noqa: E402
from tests.checks.misalignment.misaligned import draw  # noqa: E402
from tests.checks.model.units_model import NOMINAL  # noqa: E402


def seconds(work: Callable[[], object], runs: int, clock: Callable[[], float] = time.process_time) -> float:
    """Median of the runs, of processor time: what runs on one core costs that, whatever else the machine does."""
    took = []
    for _ in range(runs):
        start = clock()
        work()
        took.append(clock() - start)
    return float(np.median(took))


def row(what: str, value: str, asked: str = "-") -> None:
    print(f"{what:<60} {value:>14}   asked {asked}")


def main() -> None:
    os.environ["ACCEPT_HOME"] = tempfile.mkdtemp()
    for name in dict.fromkeys((str(NOMINAL) if NOMINAL.exists() else "strut", "strut")):
        model = open_model(name)
        print(f"\n{model.name}, {os.cpu_count()} cores")
        table = built(model)
        asked(model, table)


def built(model: Model) -> MisalignmentTable:
    plan = Plan.of(model)
    all_cores = seconds(lambda: build(plan, lambda _: None), 1, time.perf_counter)
    others = iter(range(3))  # a row that was computed just now is remembered
    one_row = seconds(lambda: plan.row(next(others)), 3)
    row("41 x 41 places on all cores", f"{all_cores:.1f} s", "<= 20 s")
    row("  processor time of its rows", f"{one_row * plan.dx.size:.1f} s")
    row("  opening the stored table, its hash checked", f"{seconds(lambda: read_table(plan), 3) * 1e3:.0f} ms")
    return read_table(plan)


def asked(model: Model, table: MisalignmentTable) -> None:
    drawn = draw(replace(model, tolerance=0.0), 6)
    table.query(drawn.first)
    query = seconds(lambda: table.query(drawn.first), 50)
    direct = seconds(lambda: model.frf(table.f, channels=("de", "da")), 10) * table.dx.size * table.dy.size
    row("query", f"{query * 1e3:.2f} ms", "<= 1 ms")
    row("  computing the same places anew takes", f"{direct / query:.0f} x")
    struts = [draw(model, k) for k in range(7)]
    refined = [seconds(partial(estimate_misalignment, model, d.first, table, d.second), 1) for d in struts]
    row("refined estimate, median of seven struts", f"{np.median(refined):.2f} s", "<= 3 s")
    row("  the slowest", f"{max(refined):.2f} s", "<= 3 s")


if __name__ == "__main__":
    main()
