"""The live value on the screen: in its limits, with its faults, taken with one key."""

from dataclasses import replace

from accept.store import open_store
from accept.tui.widgets.fields import Field
from accept.tui.widgets.limit_bar import numbers
from accept.tui.widgets.live_value import Gauge, gauge_text
from accept.workflow.bench import Workbench
from checks.declare import Measured
from hw.errors import NoReply
from specs.spec import Limit
from tests.accept.tui.tui_help import begin, loader, press, running, settled, shown, words
from tests.hw.instruments.fake_instrument import Fake, Only

SENSOR = Limit(lower=4.4, upper=5.5, unit="uF", rule="guarded", source="test")


def with_meter(fake: Fake):
    def load() -> Workbench:
        return replace(loader()(), instruments=Only("capacitance", fake))

    return load


def test_a_value_stands_inside_its_limits():
    text = gauge_text("meter", Measured(4.95, 0.02), "uF", SENSOR, "").plain
    number, bar = text.split("\n")
    assert "4.950 ± 0.020 uF" in number
    zone = bar.partition("  ")[0]
    assert zone.index("┃") < zone.index("●") < zone.rindex("┃")
    assert abs(zone.index("●") - len(zone) / 2) <= 1  # 4.95 is the middle of 4.4 to 5.5
    assert "outside" not in text


def test_a_value_beyond_its_limits_says_so_without_colour():
    assert "outside" in gauge_text("meter", Measured(1.72), "uF", SENSOR, "").plain


def test_a_fault_stays_beside_the_value_that_follows_it():
    assert "✗ silent" in gauge_text("meter", None, "uF", SENSOR, "silent").plain
    assert "✗ before: silent" in gauge_text("meter", Measured(4.9), "uF", SENSOR, "silent").plain


def test_nothing_is_never_minus_zero():
    assert "-0 um" not in gauge_text("probe", Measured(-0.0), "um", None, "").plain


async def test_the_live_value_is_taken_with_one_key_and_repeated_with_another():
    fake = Fake([4.99e-6])
    async with running(with_meter(fake)) as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        await shown(pilot, "#gauge", "4.99 uF")
        assert "meter X1 SN-7" in words(pilot, "#gauge")
        await press(pilot, "f3")
        field = pilot.app.screen.query(Field).first()
        assert "4.99 uF" in str(field.query_one(".stored").render())
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
        await shown(pilot, "#gauge", "✗ meter: nothing came in time")
        await press(pilot, "f3")
        assert "nothing came in time" in words(pilot, "#status")
        assert "nothing came in time" in str(pilot.app.screen.query(Field).first().query_one(".reason").render())
        fake.mend(4.99e-6)
        await shown(pilot, "#gauge", "4.99 uF")
        assert "before: meter" in words(pilot, "#gauge")
        await press(pilot, "f3")
        assert "Saved (" in words(pilot, "#status")
    with open_store() as store:
        kinds = [e.what for e in store.events("APA-02")]
    assert kinds.count("reading_failed") == 1
    assert kinds.count("value_taken") == 1


async def test_nobody_looks_when_the_line_is_left():
    async with running(with_meter(Fake([4.99e-6]))) as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter")
        await shown(pilot, "#gauge", "4.99 uF")
        gauge = pilot.app.screen.query_one(Gauge)
        await press(pilot, "f1")
        assert gauge._watch is None  # a question stands in front
        await press(pilot, "escape")
        await shown(pilot, "#gauge", "4.99 uF")
        await press(pilot, "escape")
        await settled(pilot)
        assert gauge._watch is None


async def test_a_stored_value_stands_in_its_limits_without_an_instrument():
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "down", "enter", *"1.72", "enter", "up")
        assert "outside" in words(pilot, "#gauge")
        assert "4.4 … 5.5 uF" in words(pilot, "#gauge")


def test_a_pure_number_has_no_unit():
    assert numbers(1.35, 0.05, "1") == "1.350 ± 0.050"
    assert numbers(1.35, None, "um") == "1.35 um, U unknown"
    assert numbers(None, None, "1") == "no value"
