"""Ratios of speed and memory of `h1` and `lpm`. Run: OMP_NUM_THREADS=1 python benchmarks/bench_frf.py

Required of 3 outputs over 400,000 samples: H1 and coherence >= 12 times faster than csd + welch + coherence per output
and at most 1.4 times the bare rfft of the same segments; local polynomials at every bin of 5 to 2000 Hz at most 4 times
the bare rfft of the records, and at the bins that fits take, which share no neighbour, beside it; memory at most 3
times the input. All of the processor.
"""

import time
import tracemalloc
from collections.abc import Callable

import numpy as np
import scipy.fft
from numpy.lib.stride_tricks import sliding_window_view
from scipy import signal

from checks.fitting.dataset import STEP
from checks.signals.spectral.frf import h1
from checks.signals.spectral.lpm import lpm

FS, NPERSEG, N, OUTPUTS = 10_000.0, 5_000, 400_000, 3


def best(runs: dict[str, Callable[[], object]], repeats: int = 9) -> dict[str, float]:
    """Least processor time of each [s]; turn by turn, so that what else the machine does falls on all of them."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            start = time.process_time()
            run()
            times[name].append(time.process_time() - start)
    return {name: min(t) for name, t in times.items()}


def peak(run: Callable[[], object]) -> int:
    """Bytes allocated above the start."""
    tracemalloc.start()
    run()
    top = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return top


def scipy_way(u: np.ndarray, y: dict[str, np.ndarray]) -> None:
    for channel in y.values():
        signal.csd(u, channel, FS, nperseg=NPERSEG)
        signal.welch(u, FS, nperseg=NPERSEG)
        signal.coherence(u, channel, FS, nperseg=NPERSEG)


def main() -> None:
    rng = np.random.default_rng(0)
    u, *outputs = rng.standard_normal((1 + OUTPUTS, N))
    y = {f"y{i}": channel for i, channel in enumerate(outputs)}
    frames = [sliding_window_view(x, NPERSEG)[:: NPERSEG // 2] for x in (u, *outputs)]
    segments = np.ascontiguousarray(np.stack(frames))
    records = np.stack([u, *outputs])
    took = best(
        {
            "h1": lambda: h1(u, y, FS, NPERSEG),
            "rfft": lambda: scipy.fft.rfft(segments),
            "scipy": lambda: scipy_way(u, y),
            "lpm": lambda: lpm(u, y, FS, f_lo=5.0, f_hi=2000.0),
            "fits": lambda: lpm(u, y, FS, f_lo=5.0, f_hi=2000.0, step=STEP),
            "whole": lambda: scipy.fft.rfft(records),
        }
    )
    print(f"h1 of {OUTPUTS} outputs, {N} samples: {1e3 * took['h1']:.1f} ms")
    print(f"scipy csd + welch + coherence per output / h1: {took['scipy'] / took['h1']:.1f} (required >= 12)")
    print(f"h1 / bare rfft of the same segments: {took['h1'] / took['rfft']:.2f} (required <= 1.4)")
    print(f"lpm of {OUTPUTS} outputs, {N} samples, every bin of 5..2000 Hz: {1e3 * took['lpm']:.0f} ms")
    print(f"lpm / bare rfft of the records: {took['lpm'] / took['whole']:.1f} (required <= 4)")
    print(f"lpm at every {STEP}th bin, as fits take it / bare rfft of the records: {took['fits'] / took['whole']:.1f}")
    share = peak(lambda: h1(u, y, FS, NPERSEG)) / (u.nbytes * (1 + OUTPUTS))
    print(f"h1 peak memory / input, the input not counted: {share:.2f} (required <= 3)")


if __name__ == "__main__":
    main()
