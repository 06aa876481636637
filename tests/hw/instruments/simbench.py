"""A simulated bench with a unit in front of it, for tests."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from accept.capture.operator_actions import StagedOperator
from accept.capture.setup import CaptureResult
from accept.store import open_store
from accept.units import toml_edit
from accept.workflow.capture import measure_folder
from accept.workflow.instruments.hardware import BenchInstrument
from hw.instruments import open_instrument
from hw.simulated import BenchSetup, SimulatedBench
from specs.bench import BenchFile, load_bench

# APA 1 of [STB], its stroke split into one stack and the two others.
HEIGHTS_UM = (0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46)
WORLD = BenchSetup("APA-01", tuple(z * 1e-6 for z in HEIGHTS_UM), 5.10e-6, 10.03e-6, 124.4e-6, 248.8e-6)


def nobody(words: str) -> str:
    raise AssertionError(f"nobody is there to answer: {words}")


@contextmanager
def simulated_bench(folder: Path, world: BenchSetup = WORLD) -> Iterator[tuple[SimulatedBench, BenchFile]]:
    with SimulatedBench(world, folder, timeout_s=0.5) as simulated:
        yield simulated, load_bench(simulated.bench_file)


def measure(section: str, unit: Path, bench: BenchFile, say=lambda words: None) -> CaptureResult:
    """Capture a section with the bench's instrument for it and its staged hands."""
    name, entry = next((n, e) for n, e in bench.instruments.items() if section in e.measures)
    assert bench.stage is not None
    with open_store() as store:
        instrument = BenchInstrument(name, open_instrument(name, entry, nobody), entry)
        return measure_folder(unit, section, instrument, StagedOperator(Path(bench.stage)), store, "T", say)


def new_unit(folder: Path, serial: str = "APA-01") -> Path:
    toml_edit.begin(folder, serial, "apa")
    return folder
