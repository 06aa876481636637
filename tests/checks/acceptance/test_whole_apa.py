"""A whole APA judged from simulated instruments only: gauge, meter and probe on pseudo-terminals, and a simulated rig
whose records are picked up from the folder that it writes."""

import tomllib
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from accept.base.documents.results import UnitRecord
from accept.capture.recipes import voltages
from accept.capture.watch_folder import WatchedFolder, pick_up
from accept.judging import judge_unit, load_spec, statement
from accept.models.model_file import open_model
from accept.simulate import UnitRequest, simulate, write
from accept.simulate.bench_truth import world_of
from accept.store import open_store
from accept.store.instrument_recall import touched
from accept.units import toml_edit, unit_folder
from checks.acceptance import CHECKS
from hw import records
from specs.bench import load_bench
from tests.hw.instruments.simbench import measure, new_unit, simulated_bench

MEASURED = ("flatness", "capacitance", "stroke")
RIG = """
[instruments.rig]
driver = "offline"
measures = ["hysteresis", "sensor_highpass", "spurious_modes", "frf"]
serial = "SIM-RIG"
calibration = { certificate = "SIM-5", due = 2099-12-31 }
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """(the simulated unit that stands on the bench, the folder of what was measured on it)."""
    folder = tmp_path_factory.mktemp("whole")
    model = open_model("apa-frame").with_values({"bench.payload_kg": 5.0})
    # the specs ask for 10 s
    write(simulate(UnitRequest("APA-01", "apa", model, 1, repeats=False, low_s=10.5, high_s=10.5)), folder / "truth")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACCEPT_HOME", str(folder / "home"))
        new_unit(folder / "APA-01")
        with simulated_bench(folder / "bench", world_of(folder / "truth")) as (_, bench):
            for section in MEASURED:
                measure(section, folder / "APA-01", bench)
            with bench_file(folder).open("a") as file:
                file.write(RIG)
        from_the_rig(folder / "truth", folder / "rig", folder / "APA-01")
    return folder / "truth", folder / "APA-01"


def bench_file(folder: Path) -> Path:
    return folder / "bench" / "bench.toml"


def from_the_rig(truth: Path, rig: Path, folder: Path) -> None:
    """The rig writes each record into its folder; each is picked up as what it is. Numbers that go with the records are
    entered as they are."""
    rig.mkdir()
    now = [0.0]
    watch = WatchedFolder(rig, clock=lambda: now[0])
    with open_store() as store:
        for section, entries in tomllib.loads((truth / "unit.toml").read_text()).items():
            if not isinstance(entries, dict) or section in (*MEASURED, "parts", "channels"):
                continue
            for name, entry in entries.items():
                if not isinstance(entry, str):
                    toml_edit.enter(folder, section, {name: entry})
                    continue
                (rig / entry).write_bytes((truth / entry).read_bytes())
                watch.stable()
                now[0] += 3.0
                (found,) = watch.stable()
                pick_up(found, folder, section, name, store, "T")


def judged(folder: Path, bench: Path | None = None) -> UnitRecord:
    spec = load_spec("apa")
    stated = statement(load_bench(bench), spec.checks, datetime.now(UTC).date()) if bench else None
    return judge_unit(unit_folder.read(folder), spec, stated)


def test_it_is_judged_as_the_unit_that_stands_on_the_bench(whole: tuple[Path, Path]) -> None:
    truth, folder = whole
    expected, result = judged(truth), judged(folder, bench_file(folder.parent))
    assert result.verdict == expected.verdict == "accepted", [f for f in result.findings if f.verdict != "pass"]
    values = {f.quantity: f for f in expected.findings}
    for found in result.findings:
        assert found.value is not None
        assert abs(found.value - (values[found.quantity].value or 0.0)) <= (found.U or 0.0), found


def test_every_instrument_can_be_recalled(whole: tuple[Path, Path]) -> None:
    _, folder = whole
    with open_store(f"sqlite:///{folder.parent / 'home' / 'store.sqlite'}") as store:
        for serial in ("SIM-GAUGE", "SIM-LCR", "SIM-PROBE"):
            assert {t.unit for t in touched(store.events(), serial, datetime(2020, 1, 1, tzinfo=UTC).date())} == {
                "APA-01"
            }
        picked = [event.data["input"] for event in store.events(what="record_picked_up")]
    assert {"closed_circuit", "record", "low", "high", "x_bending", "with_resistor"} <= set(picked)


def test_the_record_of_a_stroke_reads_back(whole: tuple[Path, Path]) -> None:
    truth, folder = whole
    record = records.read(folder / "stroke_one_stack.mat", CHECKS["stroke"].inputs["one_stack"])
    np.testing.assert_array_equal(record["V"], voltages())
    # the noise of one reading, twice, of some hundred
    assert record["d"].max() - record["d"][0] == pytest.approx(world_of(truth).one_stack_m, abs=0.3e-6)
