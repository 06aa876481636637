"""The instruments on the screen: a live value in its limits, with its faults, taken with one key; a step measured as a
whole."""

import asyncio
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from textual.widgets._toast import Toast

from accept.capture import recipes
from accept.store import open_store
from accept.tui.screens.ask import Question
from accept.tui.widgets.fields import Field
from accept.tui.widgets.limit_bar import numbers
from accept.tui.widgets.live_value import Followed, Gauge, gauge_text
from accept.workflow.bench import Workbench
from accept.workflow.open_bench import open_bench
from checks.declare import Measured
from hw.errors import NoReply
from hw.records import mat_bytes
from specs.spec import Limit
from tests.accept.tui.tui_help import (
    APART,
    begin,
    focused_again,
    loader,
    press,
    running,
    settled,
    shown,
    title,
    told,
    until,
    words,
)
from tests.hw.instruments.fake_instrument import Fake, Only
from tests.hw.instruments.simbench import simulated_bench

SENSOR = Limit(lower=4.4, upper=5.5, unit="uF", rule="guarded", source="test")
METER = Followed("meter", "sensor stack", "uF", SENSOR)


def with_meter(fake: Fake):
    def load() -> Workbench:
        return replace(loader()(), instruments=Only("capacitance", fake))

    return load


def test_a_value_stands_inside_its_limits():
    text = gauge_text(METER, Measured(4.95, 0.02), "").plain
    number, bar, _ = text.split("\n")
    assert "4.950 ± 0.020 µF" in number
    zone = bar.partition("  ")[0]
    assert zone.index("┃") < zone.index("◆") < zone.rindex("┃")
    assert abs(zone.index("◆") - len(zone) / 2) <= 1  # 4.95 is the middle of 4.4 to 5.5
    assert "outside" not in text


def test_a_value_beyond_its_limits_says_so_without_colour():
    assert "outside" in gauge_text(METER, Measured(1.72), "").plain


def test_a_fault_stays_beside_the_value_that_follows_it():
    assert "✗ silent" in gauge_text(METER, None, "silent").plain
    assert "✗ before: silent" in gauge_text(METER, Measured(4.9), "silent").plain


def test_nothing_is_never_minus_zero():
    assert "-0 µm" not in gauge_text(Followed("probe", "", "um"), Measured(-0.0), "").plain


async def test_the_live_value_is_taken_with_one_key_and_repeated_with_another():
    fake = Fake([4.99e-6])
    async with running(with_meter(fake)) as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        await shown(pilot, "#gauge", "4.99 µF")
        assert "meter (X1)" in words(pilot, "#gauge")
        await press(pilot, "f3")
        field = pilot.app.screen.query(Field).first()
        assert "4.99 µF" in str(field.query_one(".stored").render())
        field.input.focus()
        await press(pilot, "f4")
        assert "2 readings" in str(field.query_one(".stored").render())
    with open_store() as store:
        taken = [e.data for e in store.events("APA-02", "value_taken")]
    assert [(e["repeat"], e["source"]) for e in taken] == [(False, fake.name), (True, fake.name)]
    assert all(e["evidence"]["serial"] == "SN-7" for e in taken)


async def test_an_instrument_that_drops_out_is_told_and_goes_on_when_mended():
    fake = Fake([NoReply("meter: nothing came in time")])
    async with running(with_meter(fake)) as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        await shown(pilot, "#gauge", "✗ no whole answer in time")
        await press(pilot, "f3")
        assert "Not read, nothing is saved" in words(pilot, "#status")
        field = pilot.app.screen.query(Field).first()
        assert "no whole answer in time. On? Cable in?" in str(field.query_one(".reason").render())
        await focused_again(pilot, field.input)  # the cursor comes back, and the fault stays in sight
        await shown(pilot, "#gauge", "✗ no reading")  # the field says why
        fake.mend(4.99e-6)
        await shown(pilot, "#gauge", "4.99 µF")
        assert "✗" not in words(pilot, "#gauge")  # the field has it
        await press(pilot, "f3")
        assert "Saved " in told(pilot)
        assert "before: " not in words(pilot, "#gauge")
    with open_store() as store:
        kinds = [e.what for e in store.events("APA-02")]
    assert kinds.count("reading_failed") == 1
    assert kinds.count("value_taken") == 1


async def test_nobody_looks_when_the_line_is_left():
    async with running(with_meter(Fake([4.99e-6]))) as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        await shown(pilot, "#gauge", "4.99 µF")
        gauge = pilot.app.screen.query_one(Gauge)
        await press(pilot, "f1")
        assert gauge._watch is None  # a question stands in front
        await press(pilot, "escape")
        await shown(pilot, "#gauge", "4.99 µF")
        await press(pilot, "escape")
        await settled(pilot)
        assert gauge._watch is None


async def test_a_stored_value_stands_in_its_limits_without_an_instrument():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter", *"1.72", "enter", "up")
        assert "outside" in words(pilot, "#gauge")
        assert "4.4 … 5.5 µF" in words(pilot, "#gauge")


def test_a_pure_number_has_no_unit():
    assert numbers(1.35, 0.05, "1") == "1.350 ± 0.050"
    assert numbers(1.35, None, "um") == "1.35 µm, U unknown"
    assert numbers(None, None, "1") == "no value"


STROKE = ("down", "down", "enter")  # from the list of steps of apa-basic
# Both ends and the middle of the range, once up and down: what a test has time for.
FEW = [*np.linspace(-20.0, 150.0, 10), *np.linspace(150.0, -20.0, 10)[1:]]


def opened(file: Path):
    return replace(open_bench("apa-basic", bench_file=file), services=APART)


@pytest.fixture
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recipes, "voltages", lambda: FEW)
    monkeypatch.setattr(recipes, "voltages_by_hand", lambda: FEW)


async def to_records_of_stroke(pilot) -> None:
    await begin(pilot, "APA-01")
    await press(pilot, *STROKE)
    if "^F" in title(pilot, "#entries") and not any(f.place.is_file for f in pilot.app.screen.query("Field")):
        await press(pilot, "ctrl+f")


@pytest.mark.slow
@pytest.mark.usefixtures("few_steps")
async def test_a_stroke_is_measured_from_its_screen_and_undone_like_any_entry(tmp_path):
    with simulated_bench(tmp_path / "bench") as (simulated, _):
        async with running(lambda: opened(simulated.bench_file), toasts=True) as pilot:
            await to_records_of_stroke(pilot)
            await pilot.press("f3")
            await until(lambda: "Saved" in told(pilot))
            await asyncio.sleep(2.0)  # for a person who looks up from the rig
            (note,) = pilot.app.screen.query(Toast)
            assert "^Z takes back" in str(note.render())
            await settled(pilot)
            session = pilot.app.screen.session
            state = session.state("stroke")
            assert {link.input for link in state.entries} == {"one_stack", "two_stacks"}
            assert all((session.folder / link.file).is_file() for link in state.entries)
            (journal,) = (session.folder / "readings").iterdir()
            assert len(journal.read_text().splitlines()) == 2 * len(FEW)
            await press(pilot, "ctrl+z")
            assert {link.input for link in session.state("stroke").entries} == {"one_stack"}
    with open_store() as store:
        first, second = (event.data for event in store.events("APA-01", "record_linked"))
    assert first["source"] == second["source"] == "gauge C1216 SIM-GAUGE"
    assert first["evidence"]["transcript"]
    assert "transcript" not in second["evidence"]


@pytest.mark.slow
@pytest.mark.usefixtures("few_steps")
async def test_a_record_that_is_there_is_not_measured_again_by_one_key(tmp_path, monkeypatch):
    """Measuring takes minutes, and the record that is proposed is one Enter away."""
    records = tmp_path / "records"
    records.mkdir()
    monkeypatch.chdir(records)
    with simulated_bench(tmp_path / "bench") as (simulated, _):
        async with running(lambda: opened(simulated.bench_file)) as pilot:
            await begin(pilot, "APA-01")
            t = np.arange(0.0, 10.0, 1e-2)
            volts = 65.0 + 85.0 * np.sin(0.2 * np.pi * t)
            there = records / "stroke_one_stack.mat"
            there.write_bytes(mat_bytes({"t": t, "V": volts, "d": 1e-6 * volts}))
            os.utime(there, (time.time() - 60.0,) * 2)  # written to its end
            await press(pilot, *STROKE)
            if not any(f.place.is_file for f in pilot.app.screen.query(Field)):
                await press(pilot, "ctrl+f")
            await press(pilot, "f3")
            assert "Enter: take stroke_one_stack.mat. F3 again: measure at the rig" in words(pilot, "#status")
            session = pilot.app.screen.session
            assert not session.state("stroke").entries
            await press(pilot, "f3")
            assert {link.input for link in session.state("stroke").entries} == {"one_stack", "two_stacks"}
            with open_store() as store:
                assert {e.data["source"] for e in store.events("APA-01", "record_linked")} == {"gauge C1216 SIM-GAUGE"}


@pytest.mark.slow
@pytest.mark.usefixtures("few_steps")
async def test_a_person_is_asked_and_stops_it(tmp_path):
    with simulated_bench(tmp_path / "bench") as (simulated, _):
        text = simulated.bench_file.read_text()
        simulated.bench_file.write_text("\n".join(row for row in text.splitlines() if not row.startswith("stage")))
        async with running(lambda: opened(simulated.bench_file)) as pilot:
            await to_records_of_stroke(pilot)
            await pilot.press("f3")
            await until(lambda: isinstance(pilot.app.screen, Question) and pilot.app.screen.query(".words"))
            await shown(pilot, ".words", "Connect the amplifier to one stack")
            await pilot.press("escape")
            await settled(pilot)
            assert "stopped" in words(pilot, "#status")
            assert not pilot.app.screen.session.state("stroke").entries
    with open_store() as store:
        (failed,) = store.events("APA-01", "reading_failed")
    assert "stopped" in failed.data["reason"]
