"""How fast the model is, as ratios and times of the processor in one run: `python benchmarks/bench_model.py`."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before numpy: one thread each, so that the ratio is that of the work
sys.path.insert(0, str(Path(__file__).parents[1]))

import control  # noqa: E402 - the thread count must be set first
import numpy as np  # noqa: E402

from accept.models.model_file import open_model  # noqa: E402
from checks.model import build_model  # noqa: E402
from checks.model.dynamics.complex_modes import Modal, direct_frf  # noqa: E402
from checks.model.structure.matrix_builder import System  # noqa: E402
from hw.superelement import matrices_of  # noqa: E402
from specs.model import load_model  # noqa: E402
from tests.checks.model.units_model import NOMINAL  # noqa: E402

F = np.linspace(10.0, 2000.0, 1000)


def seconds(work: Callable[[], object], runs: int) -> float:
    """Median processor time of the runs: other work on the machine comes in bursts."""
    took = []
    for _ in range(runs):
        start = time.process_time()
        work()
        took.append(time.process_time() - start)
    return float(np.median(took))


def first_order(system: System) -> control.StateSpace:
    """Return the same states for python-control: positions and velocities."""
    n = len(system.K)
    inverse = np.linalg.inv(system.M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ system.K, -inverse @ system.C]])
    B = np.concatenate([np.zeros(n), inverse @ system.force])[:, None]
    C = np.hstack([system.outputs, np.zeros_like(system.outputs)])
    return control.ss(A, B, C, np.zeros((len(C), 1)))


def row(what: str, value: str, asked: str) -> None:
    print(f"{what:<66} {value:>16}   asked {asked}")


def modal_against_control(form: Modal, system: System) -> None:
    plant = first_order(system)
    fast = seconds(lambda: form.frf(F), 200)
    slow = seconds(lambda: plant.frequency_response(2 * np.pi * F), 3)
    H = plant.frequency_response(2 * np.pi * F).frdata[:, 0, :].T
    apart = np.abs(form.frf(F) / H - 1).max()
    row("modal form, 3 outputs x 1000 frequencies", f"{fast * 1e3:.2f} ms", "-")
    row(f"  python-control frequency_response, {2 * len(system.K)} states", f"{slow / fast:.0f} x", ">= 100 x")
    row("  the two differ by", f"{apart:.0e}", "-")


def change_to_response(name: str) -> None:
    spec = load_model(name)
    model = open_model(name)
    whole = build_model(spec, matrices_of(spec), reduced=False)
    kz = iter(np.linspace(80.0, 100.0, 400))
    fast = seconds(lambda: model.frf(F, {"joint.kz_N_per_um": next(kz)}), 300)
    slow = seconds(lambda: whole.direct(F), 3)
    reduced = np.abs(model.frf(F) / model.direct(F) - 1).max()
    unreduced = np.abs(model.frf(F) / whole.direct(F) - 1).max()
    print(
        f"\n{spec.name}: {whole.apa(whole.values).size} coordinates of the APA, {model.apa(model.values).size} reduced"
    )
    row("change of a parameter to new responses", f"{fast * 1e3:.2f} ms", "<= 1.5 ms")
    row("  against direct solves of all coordinates", f"{slow / fast:.0f} x", ">= 200 x")
    row("  against direct solves of the reduced matrices, largest error", f"{reduced:.0e}", "<= 1e-6")
    row("  against direct solves of all coordinates, largest error", f"{unreduced:.0e}", "<= 1e-3")


def parts(name: str) -> None:
    model = open_model(name)
    c = model.calibrated
    row(
        f"derivatives by {len(c.names)} parameters",
        f"{seconds(lambda: model.jacobian(F, c.names), 5) * 1e3:.1f} ms",
        "<= 5 ms",
    )
    row("opening the model: matrices, checks, reduction", f"{seconds(lambda: open_model(name), 5) * 1e3:.0f} ms", "-")


def main() -> None:
    name = str(NOMINAL) if NOMINAL.exists() else "strut"
    model = open_model(name)
    system = model.system()
    if not np.allclose(direct_frf(system, F[:5]), model.modal().frf(F[:5])):
        raise SystemExit("the two ways to the responses differ: their times compare nothing")
    modal_against_control(model.modal(), system)
    for each in dict.fromkeys((name, "strut")):
        change_to_response(each)
    parts(name)


if __name__ == "__main__":
    main()
