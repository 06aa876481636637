"""Ratio of `accept batch` to reading its files and one transform of every record. Run: python tests/bench_batch.py

Required: over 20 APA units with all their records, 2 workers, after start-up: at most 5 times what two processes need
to read the same files and to take one rfft of every channel. Start-up is what the same batch takes on 20 units that
hold typed values only: processes, imports, store, results. Needs the recorded units in ../shared/data/units.
"""

import shutil
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import scipy.fft

from accept import batch, unit
from accept.campaign import load_spec
from accept.certificate import keys
from accept.store import open_store
from checks.declare import Series
from hw import records
from tests.units import GOOD, make_unit

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
    one = unit.read(folder)
    samples = 0
    for section in one.sections.values():
        for entry in section.entries.values():
            if isinstance(entry, unit.FileEntry) and isinstance(entry.declared, Series):
                for x in records.read(folder / entry.name, entry.declared).channels.values():
                    samples += scipy.fft.rfft(x).size
    return samples


def reference(folders: list[Path]) -> float:
    """Seconds that WORKERS processes, already started and warm, need for all folders."""
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
        list(pool.map(read_and_transform, folders[: 2 * WORKERS]))
        start = time.perf_counter()
        list(pool.map(read_and_transform, folders))
        return time.perf_counter() - start


def judge(folders: list[Path], out: Path, credential: keys.Credential | None) -> float:
    """Seconds of a whole batch."""
    order = batch.Order(folders, out, {"apa": load_spec("apa")}, "bench", credential, WORKERS)
    start = time.perf_counter()
    with open_store(f"sqlite:///{out.with_suffix('.sqlite')}") as store:
        batch.run(order, store, lambda words: None)
    return time.perf_counter() - start


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        keys.init(place / "home", "bench", "bench", "bench")
        folders = copies(place / "units")
        typed = [make_unit(place / "typed" / f"T-{n:02d}", f"T-{n:02d}", GOOD) for n in range(COUNT)]
        least = min(reference(folders) for _ in range(2))
        print(f"reading and one rfft of every record: {least:.2f} s for {COUNT} units on {WORKERS} cores")
        for words, credential in (
            ("judged", None),
            ("judged and certified", keys.unlock(place / "home", keys.TECHNICIAN, "bench")),
        ):
            start_up = judge(typed, place / f"typed {words}", credential)
            took = judge(folders, place / f"units {words}", credential)
            ratio = (took - start_up) / least
            print(f"{words}: {took:.2f} s, of it start-up {start_up:.2f} s: ratio {ratio:.1f} (required: at most 5)")


if __name__ == "__main__":
    main()
