"""Live capture from simulated instruments: what is kept, and what a bad run leaves. A whole APA: test_whole_apa."""

import json
import tomllib
from dataclasses import replace
from datetime import UTC, date, datetime

import numpy as np
import pytest

from accept.capture.recipes import _must_follow
from accept.store import open_store
from accept.store.instrument_recall import touched
from accept.store.payloads import SectionCaptured
from accept.units import toml_edit, unit_folder
from accept.units.unit_folder import UnitError
from checks.acceptance import CHECKS
from hw import records
from hw.errors import Implausible, InstrumentError
from hw.simulated import FaultKind, LineFault, Stage
from tests.hw.instruments.simbench import HEIGHTS_UM, measure, new_unit, simulated_bench


@pytest.fixture(autouse=True)
def short_pauses(monkeypatch):
    """A simulated plug is back sooner than a real one."""
    monkeypatch.setattr("accept.capture.reading_loop.PAUSES_S", (0.05, 0.3))


def test_the_meters_accuracy_stands_beside_the_value(tmp_path):
    with simulated_bench(tmp_path / "bench") as (_, bench):
        folder = new_unit(tmp_path / "U")
        measure("capacitance", folder, bench)
    sensor = tomllib.loads((folder / "unit.toml").read_text())["capacitance"]["sensor_uF"]
    assert sensor["U"] == pytest.approx(0.002 * sensor["value"])
    assert sensor["value"] == pytest.approx(5.10, rel=1e-3)


def test_readings_and_every_byte_are_kept(tmp_path):
    with simulated_bench(tmp_path / "bench") as (_, bench):
        folder = new_unit(tmp_path / "U")
        measure("flatness", folder, bench)
    with open_store() as store:
        (event,) = store.events("APA-01", "record_linked")
    assert event.data["source"].endswith("SIM-PROBE")
    data = event.data["evidence"]
    assert (data["serial"], data["calibration"]["certificate"]) == ("SIM-PROBE", "SIM-3")
    (journal,) = (folder / "readings").iterdir()
    lines = [json.loads(line) for line in journal.read_text().splitlines()]
    assert lines == data["readings"]
    assert len(lines) == 24
    read = "".join(text for _, way, text in data["transcript"] if way == "read")
    assert all(raw in read for line in lines for raw in line["raw"])
    heights = records.read_table(folder / "flatness.csv", CHECKS["flatness"].inputs["points"])["z_um"]
    # the mean of three readings with 0.1 um of noise and steps of 0.1 um, two answers each
    np.testing.assert_allclose(heights, HEIGHTS_UM, atol=0.3)


@pytest.mark.parametrize("kind", [FaultKind.GARBAGE, FaultKind.HALF_LINE, FaultKind.ECHO_LOST, FaultKind.UNPLUG])
def test_a_passing_fault_costs_a_repeat_and_no_reading(kind, tmp_path):
    said = []
    with simulated_bench(tmp_path / "bench") as (simulated, bench):
        folder = new_unit(tmp_path / "U")
        simulated.probe.inject(LineFault(kind, after=12, at=3, seconds=0.05, seed=3))
        measure("flatness", folder, bench, said.append)
    assert any("once more" in words for words in said)
    assert len(next((folder / "readings").iterdir()).read_text().splitlines()) == 24


def test_a_lasting_fault_ends_the_run_with_its_reason_and_no_entry(tmp_path):
    with simulated_bench(tmp_path / "bench") as (simulated, bench):
        folder = new_unit(tmp_path / "U")
        simulated.lcr.inject(LineFault(FaultKind.OVERRANGE))
        with pytest.raises(InstrumentError, match="PRIM:OVER"):
            measure("capacitance", folder, bench)
    assert not unit_folder.read(folder).sections
    with open_store() as store:
        (event,) = store.events("APA-01", "reading_failed")
    assert "PRIM:OVER" in event.data["reason"]
    assert event.data["evidence"]["transcript"]


def test_a_probe_that_is_not_seated(tmp_path, monkeypatch):
    """One of three rounds reads 10 um more at point 3."""
    with simulated_bench(tmp_path / "bench") as (simulated, bench):
        seen, height = [], simulated.probe.device.source

        def lifted():
            if simulated.stage.read().probe == 3:
                seen.append(3)
            return height() + (10e-6 if simulated.stage.read().probe == 3 and 2 < len(seen) <= 4 else 0.0)

        simulated.probe.device.source = lifted
        with pytest.raises(Implausible, match="point 3"):
            measure("flatness", new_unit(tmp_path / "U"), bench)


def test_a_display_that_stands_still(tmp_path):
    """On hold a readout answers as before, and never changes."""
    with simulated_bench(tmp_path / "bench") as (simulated, bench):
        simulated.probe.device.source = lambda: 12.3e-6
        with pytest.raises(Implausible, match="stands still"):
            measure("flatness", new_unit(tmp_path / "U"), bench)


@pytest.mark.parametrize("display", ["hold", "max", "zeroed"])
def test_a_displacement_that_does_not_follow_the_voltage(display):
    up = np.linspace(0.0, 120e-6, 60)
    d = np.concatenate([up, up[::-1]]) + np.random.default_rng(5).normal(0.0, 5e-8, 120)
    _must_follow("one_stack", list(d))
    if display == "zeroed":
        d[40:] -= d[40]
    shown = {"hold": np.full(120, 3e-6), "max": np.maximum.accumulate(d), "zeroed": d}[display]
    with pytest.raises(Implausible, match="does not follow"):
        _must_follow("one_stack", list(shown))


def test_two_instruments_swapped_are_found(tmp_path):

    with simulated_bench(tmp_path / "bench") as (simulated, bench):
        simulated.gauge.swap_with(simulated.lcr)
        for section in ("stroke", "capacitance"):
            with pytest.raises(InstrumentError):
                measure(section, new_unit(tmp_path / "U"), bench)


def test_leads_that_are_not_connected(tmp_path):
    with simulated_bench(tmp_path / "bench") as (simulated, bench):
        simulated.lcr.device.source = lambda: None
        with pytest.raises(InstrumentError, match="is the stack connected"):
            measure("capacitance", new_unit(tmp_path / "U"), bench)


def test_a_stage_of_another_kind(tmp_path):
    with simulated_bench(tmp_path / "bench") as (simulated, _):
        simulated.stage.path.write_text('{"other": 1}')
        with pytest.raises(ValueError, match="is not a stage"):
            simulated.stage.read()
        simulated.stage.write(Stage(probe=1))


def test_entries_replace_another_way_of_giving_the_data(tmp_path):
    folder = new_unit(tmp_path / "U")
    toml_edit.enter(folder, "stroke", {"stroke_um": 365.5})
    (folder / "unit.toml").write_text("# kept\n" + (folder / "unit.toml").read_text())
    toml_edit.enter(folder, "stroke", {"one_stack": "a.mat", "two_stacks": "b.mat"})
    text = (folder / "unit.toml").read_text()
    assert text.startswith("# kept")
    assert tomllib.loads(text)["stroke"] == {"one_stack": "a.mat", "two_stacks": "b.mat"}
    assert abs((unit_folder.read(folder).measured["stroke"] - datetime.now(UTC).date()).days) <= 1  # run at midnight


def test_nothing_unreadable_is_written(tmp_path):
    folder = new_unit(tmp_path / "U")
    before = (folder / "unit.toml").read_bytes()
    with pytest.raises(UnitError, match="unknown key"):
        toml_edit.enter(folder, "stroke", {"strok_um": 1.0})
    with pytest.raises(UnitError, match="is the apa APA-01"):
        toml_edit.begin(folder, "APA-02", "apa")
    assert (folder / "unit.toml").read_bytes() == before


def test_an_instrument_is_recalled_by_what_it_measured_now_and_in_stores_of_before(tmp_path):
    with simulated_bench(tmp_path / "bench") as (simulated, bench):
        measure("capacitance", new_unit(tmp_path / "U"), bench)
        simulated.lcr.inject(LineFault(FaultKind.OVERRANGE))
        with pytest.raises(InstrumentError):
            measure("capacitance", tmp_path / "U", bench)
    before = SectionCaptured(
        section="stroke", instrument="lcr", model="LCR-819", serial="SIM-LCR", calibration=None, settings={},
        readings=(), journal="x.jsonl", transcript=(), entries={}, notes=(),
    )  # fmt: skip
    with open_store() as store:
        store.write(before, "APA-77", who="T")
        found = [(t.unit, t.how) for t in touched(store.events(), "SIM-LCR", date(2020, 1, 1))]
        store.write(replace(before, serial=None), "APA-78", who="T")
        nothing = touched(store.events(), " ", date(2020, 1, 1))
    assert nothing == []  # red before: a blank was the name of every instrument that states no serial number
    assert found == [
        ("APA-01", "read capacitance sensor_uF"),
        ("APA-01", "read capacitance actuator_uF"),
        ("APA-01", "read capacitance"),  # it failed: no value, but the instrument was at the unit
        ("APA-77", "measured stroke"),
    ]
