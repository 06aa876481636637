"""Ratio of one more unit on a full store to one on an empty store. Run: python benchmarks/bench_store.py EVENTS

Required: at 100,000 units at most 1.2, of an APA and of a strut with two parts that the store knows. Both are what
`accept batch` does after start-up: open the store, judge one unit of typed values, append, write the results, close.
The full store was checked whole and sealed when it was made; the walk of the whole chain, which a day's first opening
takes, is given too. On a busy machine only processor time means something. The memory is that of `accept batch` as a
program of its own, at its peak; that of `accept rejudge` must not depend on the units either, and grows by some two
kilobytes for each that flips.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from accept.batch import judge_batch
from accept.batch.judge_batch import BatchRequest
from accept.judging import load_spec
from accept.store import NewEvent, open_store
from specs.spec import parse
from tests.accept.units.units import GOOD, make_unit

RUNS, AT_ONCE = 9, 1000
SPECS = {"apa": load_spec("apa-basic")}
SPECS["strut"] = parse(SPECS["apa"].text.replace('kind = "apa"', 'kind = "strut"').encode(), "strut of typed values")


def strut(apa: str, encoder: str) -> str:
    """Text of the file of a strut of typed values with these parts."""
    return GOOD.replace('kind = "apa"', f'kind = "strut"\nparts = {{ apa = "{apa}", encoder = "{encoder}" }}')


def one_more(url: str, place: Path, name: str, texts: Sequence[str] = (GOOD,) * RUNS) -> tuple[float, float]:
    """Median time and processor time of a batch of one new unit [s]. texts: of their files."""
    times, busy = [], []
    for n, text in enumerate(texts):
        folder = make_unit(place / name / f"U-{n}", f"{name}-{n}", text)
        request = BatchRequest([folder], place / "out" / name / str(n), SPECS, "bench")
        began, began_busy = time.perf_counter(), time.process_time()
        with open_store(url) as store:
            report = judge_batch.run(request, store, lambda _: None)
        times.append(time.perf_counter() - began)
        busy.append(time.process_time() - began_busy)
        if report.verdicts != {"accepted": 1}:  # conditional, were a part not as it should be
            sys.exit(f"{name}-{n} is not accepted: {report}")
    return sorted(times)[RUNS // 2], sorted(busy)[RUNS // 2]


COMMAND = """import sys
from pathlib import Path
from accept.cli.main import app
try:
    app(sys.argv[1:])
finally:
    print(*[line.split()[1] for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")])
"""


def peak_MB(url: str, *words: str) -> float:
    """Of a command, as Linux tells it to the program itself (to its parent it tells the larger of both, before and
    after the start)."""
    environment = os.environ | {"ACCEPT_STORE_URL": url}
    done = subprocess.run([sys.executable, "-c", COMMAND, *words], env=environment, capture_output=True, text=True)
    return float(done.stdout.split()[-1]) / 1e3


def peak_of_one_more_MB(url: str, place: Path, name: str) -> float:
    unit = make_unit(place / name / "P", f"{name}-P")
    words = ("batch", str(unit), "--spec", "apa-basic", "--no-certificates", "--out", str(place / "out" / name / "P"))
    return peak_MB(url, *words)


def judged_again(url: str, place: Path) -> str:
    """Seconds and memory of `accept rejudge` where nothing flips, and where every unit does."""
    harder = place / "harder.toml"
    harder.write_text(HARDER)
    told = []
    for spec in ("apa-basic", str(harder)):
        began = time.perf_counter()
        peak = peak_MB(url, "rejudge", "--spec", spec, "--csv", str(place / "flips.csv"))
        flips = len((place / "flips.csv").read_text().splitlines()) - 1
        told.append(f"{flips} flips in {time.perf_counter() - began:.0f} s, {peak:.0f} MB at its peak")
    return "; ".join(told)


HARDER = """name = "harder"
kind = "apa"
title = "No unit of this benchmark keeps it"
[checks.capacitance.limits.sensor_uF]
lower = 5.4
upper = 5.5
unit = "uF"
rule = "simple"
source = "benchmark"
"""


def fill(url: str, units: int) -> None:
    """As many judgements of other units as asked for, like the last APA there is; each names two parts of its own."""
    with open_store(url) as store:
        like = next(store.events(f"E-{RUNS - 1}", "unit_judged"))
        for first in range(0, units, AT_ONCE):
            numbers = range(first, min(first + AT_ONCE, units))
            entries = [NewEvent(like.what, f"F-{n}", naming_parts(like.data, n), like.spec) for n in numbers]
            store.append_many(entries, who="bench")


def naming_parts(judgement: dict[str, Any], n: int) -> dict[str, Any]:
    return judgement | {"result": judgement["result"] | {"parts": {"apa": f"P-{n}", "encoder": f"Q-{n}"}}}


def ratios(empty: tuple[float, float], full: tuple[float, float], units: int) -> str:
    return (
        f"{1e3 * empty[0]:.0f} ms on an empty store, {1e3 * full[0]:.0f} ms on one of {units} units: "
        f"ratio {full[0] / empty[0]:.2f}, of processor time {full[1] / empty[1]:.2f} (required: at most 1.2)"
    )


def main(units: int) -> None:
    with tempfile.TemporaryDirectory(prefix="bench-store") as name:
        place = Path(name)
        url = f"sqlite:///{place / 'store.sqlite'}"
        one_more(url, place, "W")  # what is loaded once is loaded
        empty = one_more(url, place, "E")
        empty_strut = one_more(url, place, "ES", [strut(f"W-{n}", f"E-{n}") for n in range(RUNS)])
        before = peak_of_one_more_MB(url, place, "E")
        few = judged_again(url, place)
        fill(url, units)
        full = one_more(url, place, "FU")
        full_strut = one_more(url, place, "FS", [strut(f"F-{n}", f"F-{RUNS + n}") for n in range(RUNS)])
        after = peak_of_one_more_MB(url, place, "F")
        many = judged_again(url, place)
        (place / "store.seal").unlink()
        began = time.perf_counter()
        open_store(url).close()
        walked = time.perf_counter() - began
        print(f"one more unit: {ratios(empty, full, units)}")
        print(f"one more strut with two known parts: {ratios(empty_strut, full_strut, units)}")
        print(f"memory at its peak {before:.0f} and {after:.0f} MB; the whole chain walked: {walked:.1f} s")
        print(f"the whole store judged again: of {3 * RUNS + 1} units {few}; of all units {many}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
