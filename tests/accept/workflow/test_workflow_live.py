"""The live value, readings that are stored with what went over the line, and instruments that fall silent."""

import datetime
import queue

import pytest

from accept.base.home import home
from accept.judging import load_spec
from accept.store import open_store
from accept.store.instrument_recall import touched
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.instruments.fault_words import fault_words
from accept.workflow.instruments.hardware import MOST_TRAFFIC, BenchInstruments, bounded
from accept.workflow.instruments.port import BROKEN, Watch, look
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.worker.judging import judge_step
from checks.declare import Measured
from hw.errors import Garbled, Implausible, NoReply, OverRange
from hw.instruments import Traffic
from hw.simulated import BenchSetup, SimulatedBench
from specs.bench import load_bench
from tests.hw.instruments.fake_instrument import Fake

TIMEOUT_S = 30.0  # for a thread on a crowded machine


@pytest.fixture
def session():
    with open_store() as store:
        opened = open_session(store, home(), load_spec("apa-basic"), "Ann", "APA-02")
        opened.begin({})
        yield opened
        opened.close()


def seen(watch_on: Fake, count: int) -> list:
    """The first looks of a watch, which is stopped then."""
    told: queue.Queue = queue.Queue()
    watch = Watch(watch_on, "uF", told.put)
    found = [told.get(timeout=TIMEOUT_S) for _ in range(count)]
    watch.stop()
    watch.join(TIMEOUT_S)
    return found


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (Garbled("p: A0000 was answered b'x'..., expected STX"), "its answer came damaged. Cable firm? F3: again"),
        (
            Garbled("g: b'+1,23\\r' has a decimal comma: set the instrument to a decimal point"),
            "its answer has a decimal comma: set the instrument to a decimal point",
        ),
        (
            Garbled("g: b'+1' came unasked; is it sending by itself, or was DATA pressed?"),
            "its answer came unasked; is it sending by itself, or was DATA pressed?",
        ),
        (
            OverRange("g: it is over range, or has no probe (b'---')"),
            "over its range, or no probe. Set it up. F3: again",
        ),
        (
            Implausible("g: readings in a row differ by 3 m ((b'+1', b'+2')), at most 1 are allowed; is it moving?"),
            "g: readings in a row differ by 3 m, at most 1 are allowed; is it moving?",
        ),
        (
            Implausible("g: b'+9.9' is outside -1 to 1 mm, the range in the bench file"),
            "g: its answer is outside -1 to 1 mm, the range in the bench file",
        ),
    ],
    ids=lambda given: type(given).__name__ if isinstance(given, Exception) else "",
)
def test_a_fault_is_said_in_words_with_its_remedy_and_without_bytes(error: Exception, said: str) -> None:
    """Red before: the bytes of the line stood on the screen. They are stored with the reading that failed."""
    assert fault_words(error) == said


def test_a_watch_goes_on_after_a_fault_and_keeps_its_words():
    first, second, third = seen(Fake([4.99e-6, NoReply("meter: nothing came"), 5.01e-6]), 3)
    assert first.measured.value == pytest.approx(4.99, rel=1e-12)
    assert (second.measured, second.error) == (None, "no whole answer in time. On? Cable in? F3: again")
    assert third.measured.value == pytest.approx(5.01, rel=1e-12)


def test_a_stopped_watch_tells_nothing_more():
    told: queue.Queue = queue.Queue()
    fake = Fake([4.99e-6], hold=True)
    watch = Watch(fake, "uF", told.put)
    fake.asked.wait(TIMEOUT_S)  # a look is under way
    watch.stop()
    fake.let_go.set()
    watch.join(TIMEOUT_S)
    assert told.empty()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_fault_of_the_program_is_not_a_silent_end():
    assert seen(Fake([ZeroDivisionError("bug")]), 1)[0].error == BROKEN


def test_a_reading_of_another_kind_is_none():
    assert "does not fit here; use uF" in look(Fake([4.99], unit="V"), "uF").error


def test_a_taken_reading_is_stored_with_its_line(session: Session):
    declared = session.step("capacitance").check.inputs["sensor_uF"]
    event = session.entries.read("capacitance", declared, Fake([4.99e-6]))
    assert event.data["value"] == pytest.approx(4.99, rel=1e-12)
    assert event.data["source"] == "meter X1 SN-7"
    assert event.data["evidence"]["transcript"] == [[0.0, "read", "4.99"]]
    assert [r.source for r in session.state("capacitance").readings("sensor_uF")] == ["meter X1 SN-7"]


@pytest.mark.parametrize(
    ("answer", "error"), [(NoReply("meter: nothing came"), NoReply), (4.99, EntryError)], ids=["silent", "implausible"]
)
def test_a_reading_that_fails_is_stored_as_one_and_is_no_value(session: Session, answer, error):
    """4.99 F is no capacitance of a stack: expected uF."""
    declared = session.step("capacitance").check.inputs["sensor_uF"]
    with pytest.raises(error):
        session.entries.read("capacitance", declared, Fake([answer]))
    assert not session.state("capacitance").entries
    kept = list(session.store.events("APA-02", "reading_failed"))
    assert len(kept) == 1
    assert kept[0].data["evidence"]["serial"] == "SN-7"


def test_recall_finds_units_that_the_workflow_measured(session: Session):
    declared = session.step("capacitance").check.inputs["sensor_uF"]
    session.entries.read("capacitance", declared, Fake([4.99e-6]))
    found = touched(session.store.events(), "SN-7", datetime.date(2000, 1, 1))
    assert [(t.unit, t.how) for t in found] == [("APA-02", "read capacitance sensor_uF")]
    assert not touched(session.store.events(), "SN-8", datetime.date(2000, 1, 1))


def test_recall_takes_a_serial_with_blanks_and_in_any_capitals(session: Session):
    """Red before: a reading of an instrument whose serial number has a blank was left out, without a word."""
    declared = session.step("capacitance").check.inputs["sensor_uF"]
    session.entries.take("capacitance", declared, Measured(4.99), source="lcr LCR 819 SN 123 45")
    for serial, count in (("SN 123 45", 1), (" sn  123 45", 1), ("SN 123 4", 0), ("", 0)):
        assert len(touched(session.store.events(), serial, datetime.date(2000, 1, 1))) == count, serial


def test_every_byte_of_a_simulated_meter_is_kept(session: Session, tmp_path):
    world = BenchSetup("APA-02", (0.0,) * 8, 4.99e-6, 9.85e-6, 120e-6, 240e-6)
    with SimulatedBench(world, tmp_path / "bench") as bench:
        instruments = BenchInstruments(load_bench(bench.bench_file))
        meter = instruments.serving("capacitance", "sensor_uF", None)
        declared = session.step("capacitance").check.inputs["sensor_uF"]
        event = session.entries.read("capacitance", declared, meter)
        instruments.close()
    evidence = event.data["evidence"]
    assert (evidence["model"], evidence["serial"], evidence["calibration"]["certificate"]) == (
        "LCR-819", "SIM-LCR", "SIM-2",
    )  # fmt: skip
    ways = [way for _, way, _ in evidence["transcript"]]
    assert {"sent", "read"} <= set(ways)
    assert event.data["value"] == pytest.approx(4.99, rel=0.01)  # the meter's noise is 0.1 % and less


def test_a_long_look_does_not_swell_the_store():
    traffic = [Traffic(float(n), "read", b"x") for n in range(MOST_TRAFFIC + 7)]
    kept = bounded(traffic)
    assert kept[1:] == traffic[7:]
    assert kept[0].data == b"7 earlier lines are not kept here"
    assert bounded(traffic[:5]) == traffic[:5]


def test_repeats_from_an_instrument_add_their_scatter(session: Session):
    declared = session.step("capacitance").check.inputs["sensor_uF"]
    fake = Fake([4.9e-6, 5.1e-6])
    session.entries.read("capacitance", declared, fake)
    session.entries.read("capacitance", declared, fake, repeat=True)
    session.entries.take("capacitance", session.step("capacitance").check.inputs["actuator_uF"], Measured(9.85))
    finding = judge_step(session, "capacitance").findings[0]
    assert finding.value == pytest.approx(5.0, rel=1e-12)  # the mean of both
