"""A batch on a local Dask cluster: overhead of the engine per unit, memory of the coordinator, two workers against one.

Run: python benchmarks/bench_cluster.py 10000. Required: the engine adds at most 10 ms to a unit; the coordinator's
memory does not grow with the units; two workers on two cores at least 1.7 times one. Units hold typed values; the third
figure is of work that one core can do alone, 60 pieces of 0.2 s of processor time. The scheduler runs in this process
too, as with `--cluster local`: its memory counts. Ten thousand units take about four minutes of two idle cores.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import dask
from distributed import Client, LocalCluster

from accept.base.cluster.dask_workers import KEPT, KEPT_MESSAGES, DaskWorkers
from accept.batch import judge_batch
from accept.batch.judge_batch import BatchRequest
from accept.judging import load_spec
from accept.store import open_store
from tests.accept.units.units import make_unit

PART = 200  # units of a folder, and of the comparison


def resident_MB() -> float:
    """Of this process now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def processor_s(worker: Client) -> float:
    """Of this process and the workers' [s]: on a busy machine only that means something."""
    return time.process_time() + sum(worker.run(time.process_time).values())


def burn(seconds: float) -> float:
    """Work of one core, by its own clock of processor time."""
    began = time.process_time()
    while time.process_time() - began < seconds:
        sum(range(10_000))
    return seconds


def batch(units: Path, place: Path, cluster: DaskWorkers | None) -> tuple[float, list[float]]:
    """Seconds of a batch, and the memory of this process at every 500th unit [MB]."""
    seen: list[float] = []
    count = 0

    def say(_: str) -> None:
        nonlocal count
        count += 1
        if count % 500 == 0:
            seen.append(resident_MB())

    specs = {"apa": load_spec("apa-basic")}
    request = BatchRequest([units], place / "out", specs, "bench", workers=1, cluster=cluster)
    place.mkdir()
    with open_store(f"sqlite:///{place / 'store.sqlite'}") as store:
        began = time.perf_counter()
        judge_batch.run(request, store, say)
        return time.perf_counter() - began, seen


def growth(seen: list[float]) -> str:
    """Of the memory (MB at every 500th unit) over the second half, and what it would come to."""
    half = seen[len(seen) // 2 :]
    if len(half) < 3:
        return "too few units for the growth"
    each = (half[-1] - half[0]) / (500.0 * (len(half) - 1))
    later = half[-1] + each * 1e5
    return f"{1e3 * each:.2f} kB a unit over the second half, {later:.0f} MB after 100,000 more at that rate"


def main(units: int) -> None:
    dask.config.set({KEPT: KEPT_MESSAGES})  # as `accept` does where it starts workers
    with tempfile.TemporaryDirectory(prefix="bench-cluster") as name:
        place = Path(name)
        for n in range(units):
            make_unit(place / "units" / f"{n // PART:03d}" / f"T-{n:06d}", f"T-{n:06d}")
        first = place / "units" / "000"
        times = {}
        for count in (1, 2):
            local = LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address="127.0.0.1:0")
            cluster = DaskWorkers("local", local, print)
            list(cluster.unordered(burn, [0.1] * 4))  # started, and their imports done
            began = time.perf_counter()
            list(cluster.unordered(burn, [0.2] * 60))
            times[count] = time.perf_counter() - began
            if count == 1:
                worker = Client(local, set_as_default=False)
                for name, where in (("warm-far", cluster), ("warm-near", None)):  # what is loaded once is loaded
                    batch(make_unit(place / "warm" / name, "W-1"), place / name, where)
                began_cpu = processor_s(worker)
                far, _ = batch(first, place / "far", cluster)
                far_cpu = processor_s(worker) - began_cpu
                near, _ = batch(first, place / "near", None)
                near_cpu = processor_s(worker) - began_cpu - far_cpu
                each = len(list(first.iterdir()))
                print(
                    f"{each} units: {1e3 * near / each:.1f} ms each here, {1e3 * far / each:.1f} ms on one worker: ",
                    end="",
                )
                print(f"{1e3 * (far - near) / each:.1f} ms of engine (at most 10 on an idle machine), ", end="")
                print(
                    f"{1e3 * (far_cpu - near_cpu) / each:.1f} ms of processors, of {1e3 * near_cpu / each:.1f} ms here"
                )
                worker.close()
            else:
                took, seen = batch(place / "units", place / "all", cluster)
                print(f"{units} units in {took:.0f} s; memory at every 500th: ", *(f"{m:.0f}" for m in seen), "MB")
                print(f"{growth(seen)}; {resident_MB():.0f} MB when the results were written")
            cluster.close()
            local.close()
        print(f"two workers {times[1] / times[2]:.2f} times one (at least 1.7 on two idle cores)")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
