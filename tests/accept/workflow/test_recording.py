"""A recorder drives the unit, waits for the hammer, and its records are judged like those of a rig."""

import re
import threading
from pathlib import Path

import numpy as np
import pytest

from accept.base.home import home
from accept.capture.operator_actions import StagedOperator
from accept.capture.reading_loop import CaptureStopped
from accept.commands.bench.simulate_bench import recorder_entry
from accept.judging import load_spec
from accept.simulate import recorder as simulated
from accept.simulate.recorder import SimulatedConverter
from accept.store import open_store
from accept.workflow.capture import capture
from accept.workflow.instruments.hardware import BenchInstruments
from accept.workflow.session.open_session import open_session
from accept.workflow.worker.judging import judge_step
from checks.acceptance import spurious_modes
from checks.record import Record
from checks.signals.impact.impacts import Impact
from checks.signals.impact.progress import HitsSoFar
from checks.verdict import Verdict
from hw.errors import Implausible, OverRange, SettingsError
from hw.records import read
from specs.bench import BenchFile, parse_bench

SEED = 3


def bench_of(folder: Path, kind: str = "apa", **change: str) -> BenchFile:
    (folder / "unit.toml").write_text(f'serial = "X"\nkind = "{kind}"\n')
    text = 'name = "bench"\n' + recorder_entry(folder, folder / "stage.json", SEED, pace=0.0)
    for old, new in change.items():
        text = text.replace(f"{old} = ", f"{new} #")
    return parse_bench(text.encode(), "bench.toml")


class Work:
    """A unit at a bench with a recorder, and what was said."""

    def __init__(self, bench: BenchFile, folder: Path, spec: str = "apa") -> None:
        self.store = open_store()
        self.session = open_session(self.store, home(), load_spec(spec), "Ann", "APA-51", bench)
        self.session.begin({})
        self.instruments, self.actions = BenchInstruments(bench), StagedOperator(folder / "stage.json")
        self.said: list[str] = []

    def measure(self, step: str, stopped: threading.Event | None = None) -> dict[str, tuple[Verdict, float]]:
        instrument = self.instruments.recording(step)
        capture(self.session, step, instrument, self.actions, self.said.append, stopped=stopped)
        judged = judge_step(self.session, step)
        return {f.quantity: (f.verdict, f.value) for f in judged.findings}

    def close(self) -> None:
        self.session.close()
        self.store.close()


@pytest.fixture
def work(tmp_path: Path):
    made = Work(bench_of(tmp_path), tmp_path)
    yield made
    made.close()


def figures():
    return SimulatedConverter("truth", simulated.SimulatedSettings(kind="apa", seed=SEED))._figures


@pytest.mark.slow
def test_hits_are_judged_while_the_hammer_is_in_the_hand(work: Work) -> None:
    found = work.measure("spurious_modes")
    truth = figures().modes_Hz
    for name, f_Hz in zip(("x_bending_Hz", "y_bending_Hz"), truth, strict=False):
        verdict, value = found[name]
        assert verdict is Verdict.PASS
        assert value == pytest.approx(f_Hz, rel=1e-3)  # U of a step of 0.2 %
    told = [words for words in work.said if words.startswith("x-bending")]
    assert told[0].endswith("hit now")
    assert [("double hit" in words) for words in told[1:]] == [k == 2 for k in range(11)]  # the third bounces
    assert "9 more hits" in told[1]
    assert told[-1].endswith("enough")
    linked = work.session.state("spurious_modes").link("x_bending")
    record = read(work.session.folder / linked.file, spurious_modes.CHECK.inputs["x_bending"])
    assert record.duration < 26.0  # ends with the tenth good hit, not after three minutes


def test_a_drive_is_played_recorded_and_judged(work: Work) -> None:
    found = work.measure("stroke")
    verdict, value = found["stroke_um"]
    assert verdict is Verdict.PASS
    assert value == pytest.approx(sum(figures().stacks_um), rel=5e-3)  # the check's own U is 1 um
    (event,) = [e for e in work.session.events if e.data.get("input") == "one_stack"]
    assert event.data["source"] == "recorder simulated recorder SIM-DAQ"
    assert event.data["evidence"]["settings"]["channels"]["d"]["unit"] == "m"
    assert event.data["evidence"]["calibration"]["certificate"] == "SIM-5"


@pytest.mark.slow
def test_responses_and_slow_sines_are_recorded(work: Work) -> None:
    assert work.measure("frf")["axial_resonance_Hz"][0] is Verdict.PASS
    verdict, value = work.measure("hysteresis")["hysteresis_percent"]
    assert verdict is Verdict.PASS
    assert value == pytest.approx(100 * figures().loop, rel=0.02)
    assert work.session.state("frf").link("high_repeat") is not None


def test_a_stopped_recording_enters_nothing(work: Work) -> None:
    stopped = threading.Event()
    stopped.set()
    for step in ("spurious_modes", "stroke"):
        with pytest.raises(CaptureStopped):
            work.measure(step, stopped)
        assert not work.session.state(step).entries


def test_a_hammer_that_only_bounces_is_no_measurement(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("accept.capture.recorded.HAMMER_s", 9.0)
    bench = bench_of(tmp_path)
    text = bench.text.replace("bouncing = [2]", "bouncing = [0, 1, 2, 3, 4, 5, 6, 7]")
    work = Work(parse_bench(text.encode(), "bench.toml"), tmp_path)
    try:
        with pytest.raises(Implausible, match="double hit"):
            work.measure("spurious_modes")
        assert not work.session.state("spurious_modes").entries
        failed = [e for e in work.session.events if e.what == "reading_failed"]
        assert "0 good" in failed[0].data["reason"]
    finally:
        work.close()


def test_an_overloaded_hammer_channel_is_seen_at_once() -> None:
    spec = load_spec("apa").checks["spurious_modes"]
    t = np.arange(round(1.0 * 5120)) / 5120
    force = np.where(np.abs(t - 0.5) < 4e-4, 100.0, 0.0) + 1e-3 * np.sin(40 * t)
    response = 1e-5 * np.sin(2 * np.pi * 280 * t) * np.exp(-20 * np.maximum(t - 0.5, 0)) * (t > 0.5)
    record = Record(t, {"Track1": force, "Track2": response + 1e-9 * np.cos(9 * t)}, {})
    so_far = spurious_modes.hammer_progress(record, spec)
    assert [hit.fault for hit in so_far.hits] == ["overload"]
    assert so_far.more == 3
    assert "overload" in so_far.words
    assert "3 more hits" in so_far.words


def test_hits_that_came_while_one_was_judged_are_told_too() -> None:
    good = Impact(start=0, peak=1, end=2, force_N=90.0)
    bad = good.aside("double hit", "12 ms later")
    so_far = HitsSoFar((good, bad, good, good), False, 5, float("nan"))
    assert re.findall(r"hit (\d): (\w+)", so_far.words_after(1)) == [("2", "double"), ("3", "good"), ("4", "good")]
    assert re.findall(r"hit (\d)", so_far.words) == ["4"]
    assert re.findall(r"hit (\d)", HitsSoFar((), False, 5, float("nan")).words) == []


def test_silence_is_no_hit() -> None:
    spec = load_spec("apa").checks["spurious_modes"]
    t = np.arange(1000) / 5120
    still = Record(t, {"Track1": np.zeros(1000), "Track2": np.zeros(1000)}, {})
    assert spurious_modes.hammer_progress(still, spec).hits == ()


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ('measures = ["frf", "hysteresis", "stroke", "spurious_modes"]', 'measures = ["capacitance"]', SettingsError),
        ('driver = "simulated"', 'driver = "tape"', SettingsError),
        ('kind = "apa"', 'kind = "bridge"', SettingsError),
    ],
)
def test_a_recorder_that_cannot_be_is_refused_with_the_bench_file(
    tmp_path: Path, old: str, new: str, error: type[Exception]
) -> None:
    text = bench_of(tmp_path).text
    assert old in text
    with pytest.raises(error, match=r"recorder"):
        BenchInstruments(parse_bench(text.replace(old, new).encode(), "bench.toml"))


def test_a_channel_at_its_converters_end_is_no_record(tmp_path: Path) -> None:
    text = bench_of(tmp_path).text.replace(
        "[recorders.recorder.channels.V]\n", "[recorders.recorder.channels.V]\nrange = 100.0\n"
    )
    work = Work(parse_bench(text.encode(), "bench.toml"), tmp_path)
    try:
        with pytest.raises(OverRange, match="V reached the end of its range"):
            work.measure("stroke")
    finally:
        work.close()
