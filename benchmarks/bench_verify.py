"""`accept verify` of many certificates with their records, by a bench whose store holds all of them, as ratio to
reading the records of one and one transform of every channel: python benchmarks/bench_verify.py COUNT

Required: each certificate after the first at most 14 times (processor time): its records are judged again and its
page is drawn; peak memory of COUNT certificates at most 1.25 times that of two. Simulated actuators with all records.
"""

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from accept.models.model_file import open_model
from accept.simulate import UnitRequest, simulate, write
from accept.simulate.unit_request import on_bench
from benchmarks.bench_batch import read_and_transform

COUNT = 10
FEW, LEAST_RUNS = 2, 3


@dataclass(frozen=True)
class Spent:
    """Processor time [s] and peak memory [MB] of a process."""

    cpu: float
    memory: float


def run(home: str, *arguments: object) -> Spent:
    """Run `accept`; it may find the certificates signed only, since no simulated unit is plainly valid."""
    environment = os.environ | {"ACCEPT_HOME": home, "ACCEPT_PASSPHRASE": "a benchmark", "ACCEPT_OPERATOR": "Bench"}
    command = [sys.executable, "-m", "accept", *map(str, arguments)]
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode in (0, 4), f"{command}: exit {process.returncode}"  # noqa: S101 - else nothing was timed
    return Spent(used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3)


def main(count: int) -> None:
    model = on_bench(open_model("apa-frame"), "apa")
    with tempfile.TemporaryDirectory() as name:
        units, home, out = Path(name) / "units", f"{name}/home", Path(name) / "out"
        for seed in range(count):
            write(simulate(UnitRequest(f"BENCH-{seed:03d}", "apa", model, seed=seed)), units / f"BENCH-{seed:03d}")
        reading = []
        for _ in range(LEAST_RUNS):
            began = time.process_time()
            read_and_transform(units / "BENCH-000")
            reading.append(time.process_time() - began)
        run(home, "keys", "init")
        made = run(home, "batch", units, "--out", out)
        pages = sorted((out / "certificates").glob("*.pdf"))
        few, many = (run(home, "verify", "--workers", 1, *some) for some in (pages[:FEW], pages))
        began = time.monotonic()
        both = run(home, "verify", "--workers", 2, *pages)
        waited = time.monotonic() - began
    each = (many.cpu - few.cpu) / (count - FEW)
    print(f"reading the records of one and a transform of each: {min(reading):.2f} s")
    print(f"judged and certified: {made.cpu / count:.2f} s each")
    print(f"verified: {many.cpu:.1f} s for {count}, {each:.2f} s each, {each / min(reading):.1f} times reading")
    print(f"by two processes: {both.cpu:.1f} s of processor, {waited:.1f} s of the clock")
    print(f"peak memory: {few.memory:.0f} MB for {FEW}, {many.memory:.0f} MB for {count}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else COUNT)
