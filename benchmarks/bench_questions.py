"""Seconds and memory of every question about many units, against those of a store of 2,000 units.

Run: python benchmarks/bench_questions.py [UNITS ...] (default 20,000 and 100,000). Wanted: 2 s and 300 MB each, the
start of the program included; in seconds of processor time, because a busy machine stretches the others, and as their
ratio to 2,000 units. The store is made of events as `accept batch` stores them for typed values, nine findings a unit;
the file of findings is brought up as a batch does at its end, and the time of that is given too. `accept match` is no
question of this kind: its search for the best set takes up to its own limit of time.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from accept.fleet.findings_file import keep_findings
from accept.store import NewEvent, Store, open_store

AT_ONCE, SMALL = 2000, 2000
LIMIT_S, LIMIT_MB = 2.0, 300.0
QUANTITIES = {  # quantity: check, mean, sigma, lower, upper
    "flatness_um": ("flatness", 3.0, 0.8, None, 10.0),
    "sensor_uF": ("capacitance", 4.9, 0.05, 4.4, 5.5),
    "actuator_uF": ("capacitance", 9.7, 0.15, 8.8, 11.0),
    "stroke_um": ("stroke", 360.0, 25.0, 304.0, None),
    "k_closed_N_per_um": ("stiffness", 1.8, 0.04, 1.62, 1.98),
    "k_open_N_per_um": ("stiffness", 2.3, 0.05, 2.07, 2.53),
    "hysteresis_percent": ("hysteresis", 12.0, 1.5, None, 20.0),
    "highpass_ratio": ("sensor_highpass", 0.4, 0.005, 0.359, 0.449),
    "axial_resonance_Hz": ("frf", 94.0, 1.0, 88.0, 102.0),
}
QUESTIONS = {
    "yield": ("yield", "--by", "month"),
    "pareto by lot": ("yield", "--by", "lot"),
    "trend": ("trend", "stroke_um"),
    "trend by bench": ("trend", "stroke_um", "--by", "bench"),
    "history": ("history", "Q-000007"),
    "list": ("list", "--failed", "--since", "2026-03", "--until", "2026-03"),
    "list of all": ("list",),
    "rr": ("rr", "--quantity", "stroke_um", "--study", "gauge"),
    "golden list": ("golden", "list"),
    "site": ("site", "--out", "{out}"),
}
COMMAND = """import sys
from pathlib import Path
from accept.cli.main import app
try:
    app(sys.argv[1:])
finally:
    print(*[line.split()[1] for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")])
"""


def fill(store: Store, units: int) -> None:
    """Append judgements of this many units, over a year, at four benches."""
    rng = np.random.default_rng(units)
    for first in range(0, units, AT_ONCE):
        z = rng.standard_normal((AT_ONCE, len(QUANTITIES)))
        store.append_many([event(n, units, z[n - first]) for n in range(first, min(first + AT_ONCE, units))], who="Ann")
    for who in ("Ann", "Bob", "Cyd"):  # a gauge study: five parts, three operators, three times each
        z = rng.standard_normal((15, len(QUANTITIES)))
        store.append_many([event(n % 5, units, z[n], "gauge") for n in range(15)], who=who)


def event(n: int, units: int, z: np.ndarray, study: str = "") -> NewEvent:
    """Return a judged APA, its findings as results.json has them."""
    day = f"2026-{1 + 12 * n // units:02d}-{1 + (336 * n // units) % 28:02d}"
    findings = []
    for (name, (check, mean, sigma, lower, upper)), off in zip(QUANTITIES.items(), z.tolist(), strict=True):
        value = mean + sigma * off
        ok = (lower is None or value >= lower) and (upper is None or value <= upper)
        findings.append(
            {"check": check, "quantity": name, "value": value, "unit": name.rpartition("_")[2], "U": sigma / 5,
             "lower": lower, "upper": upper, "rule": "guarded", "verdict": "pass" if ok else "fail",
             "p_false_accept": 1e-6, "reason": None if ok else "outside the limits", "required": True,
             "budget": [{"source": "instrument", "u": sigma / 10, "kind": "B"}]}
        )  # fmt: skip
    accepted = all(f["verdict"] == "pass" for f in findings)
    result = {
        "serial": f"Q-{n:06d}", "kind": "apa", "verdict": "accepted" if accepted else "rejected", "findings": findings,
        "information": [], "not_judged": [], "notes": [], "parts": {},
        "inputs": {"unit.toml": f"{n:064x}"}, "origin": {"lot": f"L{n // 500}"} | ({"study": study} if study else {}),
        "measured": dict.fromkeys({f["check"] for f in findings}, day),
        "calibration": {"bench": f"B{1 + n % 4}", "sha256": "1" * 64, "on": day, "instruments": []},
    }  # fmt: skip
    payload = {"path": f"/units/{n}", "inputs": result["inputs"], "spec_sha256": "2" * 64, "code_sha256": "3" * 64}
    return NewEvent("unit_judged", f"Q-{n:06d}", payload | {"result": result}, "apa@" + "2" * 64)


def asked(home: Path, *words: str) -> tuple[float, float]:
    """Return seconds of processor time and peak memory [MB] of a command as a program of its own."""
    began = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {"ACCEPT_HOME": str(home), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", COMMAND, *words], env=environment, capture_output=True, text=True)
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    taken = ended.ru_utime + ended.ru_stime - began.ru_utime - began.ru_stime
    if done.returncode not in (0, 3, 4):
        sys.exit(f"{' '.join(words)}: {done.returncode}: {done.stderr[-2000:]}")
    return taken, float(done.stdout.split()[-1]) / 1e3


def measured(place: Path, units: int) -> dict[str, tuple[float, float]]:
    """Return question -> seconds, MB, on a store of this many units."""
    home = place / f"home-{units}"
    os.environ["ACCEPT_HOME"] = str(home)
    with open_store() as store:
        fill(store, units)
        began = time.process_time()
        keep_findings(store)
        print(f"{units:7d} units, findings of all written in {time.process_time() - began:.1f} s", flush=True)
    out = str(place / f"site-{units}")
    return {name: asked(home, *(word.format(out=out) for word in words)) for name, words in QUESTIONS.items()}


def main() -> None:
    """Print a line for each question."""
    sizes = [int(word.replace(",", "")) for word in sys.argv[1:]] or [20_000, 100_000]
    with tempfile.TemporaryDirectory() as folder:
        small = measured(Path(folder), SMALL)
        for units in sizes:
            for name, (seconds, MB) in measured(Path(folder), units).items():
                good = "" if seconds <= LIMIT_S and MB <= LIMIT_MB else f"  above {LIMIT_S:g} s or {LIMIT_MB:g} MB"
                ratio = seconds / small[name][0]
                print(f"{units:7d} units, {name:15s} {seconds:5.2f} s (x {ratio:4.1f}) {MB:5.0f} MB{good}", flush=True)


if __name__ == "__main__":
    main()
