"""Ratio of `accept batch` to reading its files and one transform of every record. Run: python benchmarks/bench_batch.py

Required: over the recorded APAs and struts with all their records, 2 workers, after start-up, judged alone at most 3
times what two processes need to read the same files and to take one rfft of every channel, judged and certified 6 times
(processor time). Struts are judged by strut-basic; what their model takes the blind challenge says. Start-up is what
the same batch takes on as many units that hold typed values only: processes, imports, store, results. The least of some
runs each. Needs the recorded units in ../shared/data/units.
"""

import resource
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import scipy.fft

from accept.batch import judge_batch
from accept.batch.judge_batch import BatchRequest
from accept.certificate.trust import keys
from accept.judging import load_spec
from accept.store import open_store
from accept.units import unit_folder
from accept.units.unit_entry import FileEntry
from checks.declare import Series
from hw import records
from tests.accept.units.units import GOOD, make_unit

UNITS = Path(__file__).parents[1] / "../shared/data/units"
WORKERS, RUNS = 2, 3


def read_and_transform(folder: Path) -> int:
    """Every record of a unit read, every channel transformed once; returns the samples."""
    one = unit_folder.read(folder)
    samples = 0
    for section in one.sections.values():
        for entry in section.entries.values():
            if isinstance(entry, FileEntry) and isinstance(entry.declared, Series):
                for x in records.read(folder / entry.name, entry.declared).channels.values():
                    samples += scipy.fft.rfft(x).size
    return samples


def cpu() -> float:
    """Processor seconds of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(r.ru_utime + r.ru_stime for r in used)


@dataclass(frozen=True)
class Spent:
    """wall and cpu: seconds. On a busy machine only the second means something."""

    wall: float
    cpu: float

    def __sub__(self, other: "Spent") -> "Spent":
        return Spent(self.wall - other.wall, self.cpu - other.cpu)


def spent(run: Callable[[], object]) -> Spent:
    start = time.perf_counter(), cpu()
    run()
    return Spent(time.perf_counter() - start[0], cpu() - start[1])


def read_all(folders: list[Path]) -> None:
    """All folders, in WORKERS new processes."""
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
        list(pool.map(read_and_transform, folders))


def judge(folders: list[Path], out: Path, credential: keys.Credential | None) -> None:
    """Judge a whole batch."""
    specs = {"apa": load_spec("apa"), "strut": load_spec("strut-basic")}
    request = BatchRequest(folders, out, specs, "bench", credential, WORKERS)
    with open_store(f"sqlite:///{out.with_suffix('.sqlite')}") as store:
        judge_batch.run(request, store, lambda _: None)


def least(runs: Callable[[int], Spent]) -> Spent:
    """Of RUNS runs, each by its number."""
    took = [runs(n) for n in range(RUNS)]
    return Spent(min(t.wall for t in took), min(t.cpu for t in took))


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        keys.init(place / "home", "correct horse", "bench")
        folders = sorted(UNITS.glob("[AS]-0*"))
        typed = [make_unit(place / "typed" / f"T-{n:02d}", f"T-{n:02d}", GOOD) for n in range(len(folders))]
        read = least(lambda _: spent(partial(read_all, folders))) - least(lambda _: spent(partial(read_all, typed)))
        print(f"reading and one rfft of every record: {read.wall:.2f} s, {read.cpu:.2f} s of processors")
        for words, credential, goal in (
            ("judged", None, 3),
            ("judged and certified", keys.unlock(place / "home", keys.TECHNICIAN, "correct horse"), 6),
        ):

            def run(units: list[Path], n: int, named: str = words, by: keys.Credential | None = credential) -> Spent:
                return spent(partial(judge, units, place / f"{units[0].name} {named} {n}", by))

            start_up = least(partial(run, typed))
            took = least(partial(run, folders)) - start_up
            ratios = f"ratio {took.wall / read.wall:.1f}, of processor time {took.cpu / read.cpu:.1f}"
            print(f"{words}: {took.wall:.2f} s after {start_up.wall:.2f} s of start-up: {ratios} (at most {goal})")


if __name__ == "__main__":
    main()
