"""What reading a record costs, against scipy.io.loadmat on the same file and against hashing its bytes.

A record of 400,000 samples of five channels, as the bench makes them; the least of seven runs each.
Run: OMP_NUM_THREADS=1 python benchmarks/bench_records.py
"""

import hashlib
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from scipy.io import loadmat

from hw import records
from tests.hw.records import records_files as made

RUNS = 7


def least_ms(run: Callable[[], object]) -> float:
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def main() -> None:
    data = made.channels(400_000)
    files = {"MATLAB 5": made.mat5(data), "MATLAB 7, compressed": made.mat5(data, True), "MATLAB 7.3": made.mat73(data)}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.mat"
        for name, raw in files.items():
            path.write_bytes(raw)
            ours, hashing = least_ms(lambda: records.read(path, made.SERIES)), least_ms(partial(hashlib.sha256, raw))
            print(f"{name:20} read {ours:6.1f} ms, of it SHA-256 {hashing:5.1f} ms", end="")
            if "7.3" in name:  # which scipy does not read
                print()
                continue
            scipys = least_ms(lambda: loadmat(path))
            print(f"; loadmat {scipys:6.1f} ms; ratio to loadmat + SHA-256 {ours / (scipys + hashing):5.2f}")


if __name__ == "__main__":
    main()
