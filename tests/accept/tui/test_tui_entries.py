"""Every entry lands where it was meant: keys faster than the store, slips of point and unit, what is saved already."""

import asyncio
import os
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from textual.events import Key, Paste
from textual.keys import _character_to_key
from textual.pilot import Pilot
from textual.widgets import DataTable, Input, Static

from accept.store import Store, open_store
from accept.tui.widgets.fields import Field
from accept.tui.widgets.step_list import StepList
from accept.workflow.entry.parse_entry import doubt, passing_range, usual_range
from accept.workflow.worker.judging import judge_step
from checks.acceptance import CHECKS
from checks.declare import Series
from specs.spec import Limit
from tests.accept.tui.tui_help import HEIGHTS, begin, loader, press, running, settled, type_line, until, words
from tests.shared.record_files import write_csv
from tests.soak import SOAK

ENTRIES = st.lists(st.integers(-199, 199).map(lambda n: n / 4), min_size=8, max_size=8)
PAUSES = st.lists(st.sampled_from([0, 0, 0, 1, 7, 60]), min_size=12, max_size=12)  # turns of the event loop
DELAYS = st.lists(st.sampled_from([0.0, 0.0, 0.005, 0.03]), min_size=8, max_size=8)  # seconds of the store


def stored(serial: str) -> list[dict]:
    with open_store() as store:
        return [event.data for event in store.events(serial, "value_taken")]


async def burst(pilot: Pilot[None], text: str, pauses: list[int]) -> None:
    """Letters and Enter as a terminal sends them; nobody waits for an answer."""
    for n, letter in enumerate(text):
        key = Key("enter", "\r") if letter == "\n" else Key(_character_to_key(letter), letter)
        pilot.app.post_message(key)
        for _ in range(pauses[n % len(pauses)]):
            await asyncio.sleep(0)


@settings(max_examples=40 if SOAK else 2, deadline=None, suppress_health_check=list(HealthCheck))
@given(values=ENTRIES, pauses=PAUSES, delays=DELAYS, comma=st.booleans())
def test_what_is_typed_is_stored_in_order_however_fast_the_keys_and_slow_the_store(values, pauses, delays, comma):
    asyncio.run(_typed_ahead(values, pauses, delays, comma))


async def _typed_ahead(values: list[float], pauses: list[int], delays: list[float], comma: bool) -> None:
    serial = f"APA-{time.monotonic_ns()}"
    append, waits = Store.append_many, iter(delays)

    def slow(self, entries, **named):
        if any(entry.what == "value_taken" for entry in entries):
            time.sleep(next(waits, 0.0))
        return append(self, entries, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "append_many", slow)
        async with running() as pilot:
            await begin(pilot, serial)
            await press(pilot, "enter")
            typed = "".join(f"{value:g}\n" for value in values)
            await burst(pilot, typed.replace(".", ",") if comma else typed, pauses)
            await settled(pilot)
    assert [(e["index"], e["value"]) for e in stored(serial)] == list(enumerate(values))


async def test_a_file_that_is_refused_is_replaced_by_the_name_that_is_typed_next(tmp_path: Path):
    (tmp_path / "bad.csv").write_text("x_mm,y_mm\n1,2\n")
    points = "x_mm,y_mm,z_um\n0,0,0\n10,0,1\n10,10,-1\n0,10,1\n20,0,0\n30,0,1\n30,10,0\n20,10,1\n"
    (tmp_path / "good.csv").write_text(points)
    os.utime(tmp_path / "good.csv", (1, 1))
    async with running(loader(records=tmp_path)) as pilot:
        await begin(pilot)
        await press(pilot, "enter", "f2")  # the step opens with the table: something is there for it
        names = [str(key.value) for key in pilot.app.screen.query_one(DataTable).rows]
        await press(pilot, *["down"] * names.index("f:bad.csv"), "enter")
        field = pilot.app.screen.query_one(Field)
        assert not field.input.value  # a file that is no use is not tried again: Enter takes what is proposed
        assert "it has x_mm (1 rows)" in str(field.query_one(".reason", Static).render())
        await until(lambda: pilot.app.focused is field.input)  # the cursor comes back behind what was typed ahead
        await press(pilot, *"good.csv", "enter")
        assert pilot.app.screen.dialogue.complete
        assert "good.csv" in str(field.query_one(".stored", Static).render())
        assert not field.input.placeholder  # its room is the name's


async def test_escape_closes_the_nearest_thing():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "escape", "f6")
        assert pilot.app.screen.dialogue.adds
        await press(pilot, "escape")
        assert not pilot.app.screen.dialogue.adds
        await press(pilot, "escape")
        assert "Esc again" in words(pilot, "#status")
        assert isinstance(pilot.app.focused, Input)
        assert pilot.app.is_running
        assert not pilot.app._exit


def test_what_is_bad_is_no_slip_and_what_is_a_slip_is_seen():
    mass, height = CHECKS["stiffness"].inputs["mass_kg"], CHECKS["flatness"].inputs["z_um"]
    limit = {"sensor_uF": Limit(lower=4.4, upper=5.5, unit="uF", rule="guarded", source="test")}
    sensor = usual_range(CHECKS["capacitance"].inputs["sensor_uF"], limit)
    assert "6.4 kg would be usual" in doubt(0.64, "kg", usual_range(mass, {}))
    assert doubt(6.4, "kg", usual_range(mass, {})) == ""
    assert "unusual" in doubt(99999.0, "um", usual_range(height, {}))
    assert "4.99 uF would be usual" in doubt(4990.0, "uF", sensor)  # nF
    both = {"actuator_uF": Limit(lower=8.8, upper=11.0, unit="uF", rule="guarded", source="test")}
    declared = CHECKS["capacitance"].inputs["actuator_uF"]
    asked = doubt(49.3, "uF", usual_range(declared, both), passing_range(declared, both))
    assert "4.93" not in asked  # the sensor's value: it would fail here too
    assert "8.8 to 11 uF" in asked
    assert "9.9 uF would be usual" in doubt(9900.0, "uF", usual_range(declared, both), passing_range(declared, both))
    assert doubt(1.72, "uF", sensor) == ""  # a dead stack: bad, and true
    assert doubt(1.72, "uF", None) == ""


async def test_a_burst_from_the_list_of_units_through_two_steps_loses_no_key():
    heights = [0, -4, -13, -7, -2, 1, -9, -21]
    async with running() as pilot:
        await begin(pilot, "APA-01")
        await press(pilot, "escape")
        await burst(pilot, f"APA-01\n\n\n{' '.join(map(str, heights))}\n\n4.99\n9.78\n", [0])
        await settled(pilot)
    assert [(e["step"], e["value"]) for e in stored("APA-01")] == [
        *(("flatness", value) for value in heights),
        ("capacitance", 4.99),
        ("capacitance", 9.78),
    ]


@pytest.mark.parametrize("leaving", ["escape", "ctrl+q"])
async def test_what_is_on_its_way_to_the_store_is_there_when_the_step_is_left(leaving: str):
    async with running() as pilot:
        await begin(pilot, "APA-01")
        await press(pilot, "enter")
        await burst(pilot, "0 -4 -13 -7 -2 1 -9 -21\n", [0])
        pilot.app.post_message(Key(leaving, None))
        await settled(pilot)
    assert [e["value"] for e in stored("APA-01")] == [0, -4, -13, -7, -2, 1, -9, -21]


async def test_letters_behind_a_key_that_opens_a_question_or_a_list_arrive_there():
    async with running() as pilot:
        await begin(pilot, "APA-01")
        pilot.app.post_message(Key("f5", None))
        await burst(pilot, "3.3 V on Va\n\n\n\n", [0])
        pilot.app.post_message(Key("escape", None))
        pilot.app.post_message(Key("f2", None))
        await burst(pilot, "APA-01\n", [0])
        await settled(pilot)
        assert type(pilot.app.screen).__name__ == "Steps"
        assert [note.text for note in pilot.app.session.state("flatness").notes] == ["3.3 V on Va"]
        assert pilot.app.session.operator == "Ann"


async def test_keys_behind_a_known_serial_belong_to_its_unit():
    async with running() as pilot:
        await begin(pilot, "APA-01")
        await press(pilot, "escape")
        await burst(pilot, "APA-01\n", [0])
        pilot.app.post_message(Key("f5", None))
        await burst(pilot, "apa\n\n\n\n", [0])
        await settled(pilot)
        assert (type(pilot.app.screen).__name__, pilot.app.session.operator) == ("Steps", "Ann")
        assert [note.text for note in pilot.app.session.state("flatness").notes] == ["apa"]


async def test_enter_at_the_last_step_opens_the_summary_of_a_strut_too(tmp_path: Path):
    """Red before: it landed in the list of steps, in which the keys of the summary do nothing."""
    async with running(loader("strut", tmp_path)) as pilot:
        await type_line(pilot, "ST-01")
        while type(pilot.app.screen).__name__ == "StartScreen":
            await press(pilot, "enter")
        for name in ("frf_noise.csv", "frf_noise_hf.csv"):
            rng, t = np.random.default_rng(len(name)), np.arange(2000) * 1e-3
            write_csv(tmp_path / name, {"t": t, **{c: rng.standard_normal(t.size) for c in ("Va", "Vs", "de", "da")}})
        session = pilot.app.session
        for step in session.steps:
            for declared in step.form(None).inputs if not step.derived else ():
                if isinstance(declared, Series) and not declared.optional:
                    high = tmp_path / f"frf_noise{'_hf' * (declared.name == 'high')}.csv"
                    session.records.link(step.name, declared, high)
            judge_step(session, step.name)
        last = session.steps[-1]
        pilot.app.screen.query_one(StepList).stand_at(last.name)
        await press(pilot, "enter")
        assert pilot.app.screen.step is last
        assert "Enter: summary" in pilot.app.screen.dialogue.complete_words
        await press(pilot, "enter")
        assert type(pilot.app.screen).__name__ == "Summary"


async def test_eight_heights_that_are_pasted_as_a_column_are_eight_heights():
    """Red before: the first was saved, and the others were dropped without a word."""
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        pilot.app.post_message(Paste("\r\n".join(HEIGHTS.split()) + "\r\n"))
        await settled(pilot)
        await press(pilot, "enter")
        assert [e["value"] for e in stored("APA-02")] == [float(z) for z in HEIGHTS.split()]


async def test_an_empty_reason_leaves_the_question_of_measuring_again_open():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        await type_line(pilot, "4.99")
        await press(pilot, "f8", "enter")
        assert type(pilot.app.screen).__name__ == "Question"
        assert "Type the reason" in words(pilot, "#wrong")
