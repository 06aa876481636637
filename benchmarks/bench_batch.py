"""Ratio of `accept batch` to reading its files and one transform of every record. Run: python benchmarks/bench_batch.py

Required: over 20 APA units with all their records, 2 workers, after start-up: at most 5 times what two processes need
to read the same files and to take one rfft of every channel. Start-up is what the same batch takes on 20 units that
hold typed values only: processes, imports, store, results. Needs the recorded units in ../shared/data/units.
"""

import resource
import shutil
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
from accept.batch.request import BatchRequest
from accept.certificate.trust import keys
from accept.judging.judge_unit import load_spec
from accept.store import open_store
from accept.units import unit_folder
from checks.declare import Series
from hw import records
from tests.accept.units.units import GOOD, make_unit

UNITS = Path(__file__).parents[1] / "../shared/data/units"
COUNT, WORKERS = 20, 2


def copies(place: Path) -> list[Path]:
    """COUNT units made of the recorded ones, each with a serial of its own."""
    sources = sorted(UNITS.glob("A-0*"))
    made = []
    for n in range(COUNT):
        source = sources[n % len(sources)]
        folder = place / f"B-{n:02d}"
        shutil.copytree(source, folder)
        text = (source / "unit.toml").read_text().replace(f'"{source.name}"', f'"B-{n:02d}"')
        (folder / "unit.toml").chmod(0o644)
        (folder / "unit.toml").write_text(text)
        made.append(folder)
    return made


def read_and_transform(folder: Path) -> int:
    """Every record of a unit read, every channel transformed once; returns the samples."""
    one = unit_folder.read(folder)
    samples = 0
    for section in one.sections.values():
        for entry in section.entries.values():
            if isinstance(entry, unit_folder.FileEntry) and isinstance(entry.declared, Series):
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
    """A whole batch."""
    order = BatchRequest(folders, out, {"apa": load_spec("apa")}, "bench", credential, WORKERS)
    with open_store(f"sqlite:///{out.with_suffix('.sqlite')}") as store:
        judge_batch.run(order, store, lambda _: None)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        keys.init(place / "home", "correct horse", "bench")
        folders = copies(place / "units")
        typed = [make_unit(place / "typed" / f"T-{n:02d}", f"T-{n:02d}", GOOD) for n in range(COUNT)]
        least = spent(lambda: read_all(folders)) - spent(lambda: read_all(typed))
        print(f"reading and one rfft of every record: {least.wall:.2f} s, {least.cpu:.2f} s of processors")
        for words, credential in (
            ("judged", None),
            ("judged and certified", keys.unlock(place / "home", keys.TECHNICIAN, "correct horse")),
        ):
            start_up = spent(partial(judge, typed, place / f"typed {words}", credential))
            took = spent(partial(judge, folders, place / f"units {words}", credential)) - start_up
            ratios = f"ratio {took.wall / least.wall:.1f}, of processor time {took.cpu / least.cpu:.1f}"
            print(f"{words}: {took.wall:.2f} s after {start_up.wall:.2f} s of start-up: {ratios} (required: at most 5)")


if __name__ == "__main__":
    main()
