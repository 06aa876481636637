"""Ratio of `accept --help` to the import of typer, which it cannot do without. Run: python benchmarks/bench_help.py

Required: at most twice. CPU time of the child, best of several: it then hardly depends on what else the machine does.
What must not be imported for it is a test (tests/test_imports.py), not a matter of time.
"""

import os
import subprocess
import sys

RUNS = 7


def best(arguments: list[str]) -> float:
    """[s] of user and system time."""
    times = []
    for _ in range(RUNS):
        before = os.times()
        subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
        after = os.times()
        times.append(after.children_user + after.children_system - before.children_user - before.children_system)
    return min(times)


if __name__ == "__main__":
    ours, least = best(["-m", "accept", "--help"]), best(["-c", "import typer"])
    print(f"accept --help {ours:.3f} s, import of typer {least:.3f} s: ratio {ours / least:.2f} (at most 2)")
