"""Hysteresis loops: against recorded units, and against loops whose width has a closed form."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy.signal import lfilter, sawtooth
from scipy.stats import binom

from checks.acceptance import hysteresis
from checks.cause import Cause
from checks.quantity import Quantity
from checks.record import Record
from checks.signals.slow.loops import Cycle, last_cycles
from checks.verdict import Verdict, judge
from specs.spec import CheckSpec, load
from tests.causes import causes, no_result
from tests.checks.acceptance.play_model import Plays
from tests.shared.recorded_units import RecordedUnits
from tests.soak import SOAK

STRUT = load("strut").checks["hysteresis"]
BARE = CheckSpec(required=False)
PLAYS = Plays.of(gain=24e-6, share=0.15, largest=4.5, count=200)  # m per V of Va, up to 4.5 V
AMPLITUDES = (0.05, 0.2, 1.0, 2.0, 4.0)
PERIOD = 1000


def sines(amplitudes: tuple[float, ...] = AMPLITUDES, periods: int = 3, period: int = PERIOD) -> np.ndarray:
    one = np.sin(2 * np.pi * np.arange(periods * period) / period)
    return np.concatenate([a * one for a in amplitudes])


def record(Va: np.ndarray, de: np.ndarray, noise: float = 4e-9, seed: int = 1, **more: np.ndarray) -> Record:
    rng = np.random.default_rng(seed)
    de = 2.5e-9 * np.round((de + noise * rng.standard_normal(de.size)) / 2.5e-9)
    return Record(np.arange(Va.size) * 1e-3, {"Va": Va, "de": de, **more}, {})


def measured(given: Record, spec: CheckSpec = BARE) -> dict[str, Quantity]:
    outcome = hysteresis.measure({"record": given}, spec)
    assert {q.name for q in outcome.quantities} == set(hysteresis.CHECK.quantities)
    return {q.name: q for q in outcome.quantities}


def percent(amplitude: float, model: Plays = PLAYS) -> float:
    return 100 * model.width(amplitude) / model.peak_to_peak(amplitude)


@pytest.fixture(scope="module")
def response() -> np.ndarray:
    return PLAYS.response(sines())


def unit_record(folder: Path) -> Record:
    data = scipy.io.loadmat(folder / "hysteresis.mat")
    return Record(data["t"].ravel(), {c: data[c].ravel() for c in ("Va", "de")}, {})


@pytest.mark.needs_data
def test_recorded_actuators_have_a_loop_that_grows(recorded_units: RecordedUnits) -> None:
    units = {
        unit: measured(unit_record(recorded_units.folder(unit)))
        for unit in (("A-01", "A-02", "A-03") if SOAK else ("A-01",))
    }
    amplitudes = {unit: q["hysteresis_amplitude_V"].value for unit, q in units.items()}
    assert amplitudes == pytest.approx(dict.fromkeys(units, 4.0), rel=1e-4)
    # 3.49 percent: read from the last period by two parabolas about mid-voltage, an independent way
    widths = {unit: q["hysteresis_percent"].value for unit, q in units.items()}
    assert widths == pytest.approx(dict.fromkeys(units, 3.49), abs=0.02)
    small = {unit: q["hysteresis_small_signal_percent"] for unit, q in units.items()}
    assert all(q.value < 2 * (q.U or 0) for q in small.values()), small  # none below Va = 0.4 V, as [STB] 3.1.6 says


@pytest.mark.needs_data  # at rest: the simulated struts move with their damped guide, which opens a loop of 0.01 %
def test_recorded_struts_without_hysteresis_show_none(recorded_units: RecordedUnits) -> None:
    units = ("S-01", "S-04", "S-06") if SOAK else ("S-01",)
    outcomes = {u: hysteresis.measure({"record": unit_record(recorded_units.folder(u))}, STRUT) for u in units}
    widths = {u: next(q for q in each.quantities if q.name == "hysteresis_percent") for u, each in outcomes.items()}
    scatter = {u: q.budget[0].u for u, q in widths.items()}
    assert all(q.value < 4 * scatter[u] for u, q in widths.items()), (widths, scatter)  # four standard uncertainties
    assert all(u < 0.005 for u in scatter.values()), scatter
    # whether de was stored a sample beside Va the record cannot say: 1 ms of a sine of 1 Hz, evenly distributed
    stored = {u: q.budget[1].u for u, q in widths.items()}
    assert stored == pytest.approx(dict.fromkeys(units, 100 * 2e-3 * math.pi / math.sqrt(3)), rel=2e-3)
    found = {u: judge("hysteresis", q, STRUT.limits["hysteresis_percent"]) for u, q in widths.items()}
    said = Verdict.PASS, "below what can be measured: at most 0.73 percent"  # 0 ± 0.73 lies below 20 percent
    assert {u: (each.verdict, each.note) for u, each in found.items()} == dict.fromkeys(units, said)
    notes = {u: [note for note in each.notes if "no hysteresis is seen" in note] for u, each in outcomes.items()}
    assert {u: len(each) for u, each in notes.items()} == dict.fromkeys(units, 1)
    assert not any("?" in note for each in notes.values() for note in each), notes  # what passes raises no suspicion


def test_of_a_loop_that_is_seen_nothing_more_is_said(response: np.ndarray) -> None:
    notes = hysteresis.measure({"record": record(sines(), response)}, BARE).notes
    assert not any("no hysteresis" in note for note in notes)


def test_recovers_a_closed_form_width(response: np.ndarray) -> None:
    q = measured(record(sines(), response))
    # 0.2 percent of the width: a sum of 200 plays is not quite the smooth loop that is fitted
    assert q["hysteresis_percent"].value == pytest.approx(percent(4.0), rel=2e-3)
    small = q["hysteresis_small_signal_percent"]
    assert abs(small.value - percent(0.05)) < 2 * (small.U or 0)


def drives() -> dict[str, np.ndarray]:
    ramp = np.concatenate([np.linspace(-3.25, 0, 2000), np.zeros(500)])
    pause = np.zeros(700)
    paused = np.concatenate([np.concatenate([sines((a,)), pause]) for a in AMPLITUDES])
    envelope = np.interp(np.arange(9000), [0, 3000, 6000, 9000], [0, 4, 4, 0])
    rng = np.random.default_rng(0)
    return {
        "ramped to the mean": np.concatenate([ramp, sines(), ramp[::-1]]),
        "pauses between": paused,
        "largest first": sines(AMPLITUDES[::-1]),
        "one period more": sines(periods=4),
        "other frequency": sines(period=733),
        "cosines": np.concatenate([a * np.cos(2 * np.pi * np.arange(3000) / 1000) for a in AMPLITUDES]),
        "cut in a period": sines()[:-400],
        "fading in and out": np.concatenate([sines((0.05,)), envelope * np.sin(2 * np.pi * np.arange(9000) / 1000)]),
        "noisy drive": sines() + 3e-4 * rng.standard_normal(sines().size),
    }


@pytest.mark.parametrize("name", drives())
def test_finds_the_last_period_of_other_drives(name: str) -> None:
    drive = drives()[name]
    q = measured(record(drive + 3.25, PLAYS.response(drive) + 5e-5))
    amplitude = q["hysteresis_amplitude_V"].value
    # of a sine that fades in and out only the steady middle counts
    assert amplitude == pytest.approx(4.0, rel=0.01)
    assert q["hysteresis_percent"].value == pytest.approx(percent(4.0), rel=0.02)


def test_last_cycles_are_the_last() -> None:
    cycles = last_cycles(sines() + 3.25)
    assert [c.amplitude for c in cycles] == pytest.approx(list(AMPLITUDES), rel=1e-6)
    assert [round(c.start / PERIOD) for c in cycles] == [2, 5, 8, 11, 14]
    assert [c.centre for c in cycles] == pytest.approx([3.25] * 5, abs=1e-6)


def test_drift_and_a_turned_encoder_leave_the_width_alone(response: np.ndarray) -> None:
    t = np.arange(response.size) * 1e-3
    drifting = measured(record(sines(), response + 1e-6 * t))["hysteresis_percent"].value
    turned = measured(record(sines(), -response))["hysteresis_percent"].value
    plain = measured(record(sines(), response))["hysteresis_percent"].value
    assert drifting == pytest.approx(plain, rel=2e-3)
    assert turned == pytest.approx(plain, rel=2e-3)


def test_intervals_are_honest() -> None:
    """Rayleigh's parabolas, exact in closed form: width = opening / peak to peak."""
    repeats = 200 if SOAK else 100
    drive = sines((4.0,))
    angle = 2 * np.pi * np.arange(drive.size) / PERIOD
    de = 24e-6 * drive - 24e-6 * 4 * 0.03 * np.cos(angle) * np.abs(np.cos(angle))
    hits = 0
    for seed in range(repeats):
        q = measured(record(drive, de, noise=1e-7, seed=seed))["hysteresis_percent"]
        hits += abs(q.value - 3.0) <= 1.96 * q.budget[0].u  # here both are stored at once: only the scatter is left
    lo, hi = binom.interval(0.999, repeats, 0.95)
    assert lo <= hits <= hi


def test_a_phase_shift_is_an_ellipse_of_known_width() -> None:
    drive = sines((1.0, 4.0))
    late = np.concatenate([np.zeros(20), drive[:-20]])
    q = measured(record(drive, 24e-6 * late))["hysteresis_percent"]
    assert q.value == pytest.approx(100 * math.sin(2 * math.pi * 0.02), rel=2e-3)


def test_sensor_shows_only_what_grows_with_the_amplitude(response: np.ndarray) -> None:
    drive = sines(periods=6)
    b = [1 / (1 + np.pi * 0.39e-3), -1 / (1 + np.pi * 0.39e-3)]  # high-pass at 0.39 Hz: a wide ellipse at 1 Hz
    a = [1.0, -(1 - np.pi * 0.39e-3) / (1 + np.pi * 0.39e-3)]
    passed = 0.05 * lfilter(b, a, drive)
    rng = np.random.default_rng(2)
    Vs = passed + 1e-4 * rng.standard_normal(drive.size)
    q = measured(record(drive, 24e-6 * drive, Vs=Vs))["sensor_hysteresis_percent"]
    # what the start of the record leaves in the sixth period is below 0.2 percent
    assert q.value < 0.2 + (q.U or 0)
    with_loop = 2000 * response
    q = measured(record(sines(), response, Vs=with_loop))["sensor_hysteresis_percent"]
    assert q.value == pytest.approx(percent(4.0) - percent(0.05), rel=0.01)
    assert causes(measured(record(sines(), response))["sensor_hysteresis_percent"]) == {Cause.CHANNEL_MISSING}


def refusals() -> dict[str, tuple[Record, Cause]]:
    n = sines().size
    rng = np.random.default_rng(6)
    drive = sines()
    return {
        "triangles": (record(sawtooth(2 * np.pi * np.arange(n) / 1000, 0.5), 1e-6 * drive), Cause.NO_SINE),
        "noise": (record(rng.standard_normal(n), 1e-6 * drive), Cause.NO_SINE),
        "half a period": (record(drive[-1000:-500], 1e-6 * drive[-1000:-500]), Cause.NO_SINE),
        "de is another signal": (record(drive, 1e-5 * np.cumsum(rng.standard_normal(n))), Cause.NO_RESPONSE),
        "de stands still": (record(drive, np.zeros(n)), Cause.NO_RESPONSE),
    }


@pytest.mark.parametrize("case", refusals())
def test_no_result_with_the_reason(case: str) -> None:
    given, cause = refusals()[case]
    with no_result(cause):
        measured(given)


def test_a_small_sine_is_not_taken_for_the_full_range(response: np.ndarray) -> None:
    spec = CheckSpec(required=False, settings={"min_amplitude_V": 4.0})
    with no_result(Cause.SINE_SMALL, needed=4.0):
        measured(record(sines()[:12000], response[:12000]), spec)
    assert measured(record(sines(), response), spec)["hysteresis_percent"].value > 0


def test_one_amplitude_has_no_small_signal_width(response: np.ndarray) -> None:
    q = measured(record(sines()[12000:], response[12000:]))
    assert causes(q["hysteresis_small_signal_percent"]) == {Cause.ONE_AMPLITUDE}


def test_panels(response: np.ndarray) -> None:
    outcome = hysteresis.measure({"record": record(sines(), response)}, BARE)
    assert set(outcome.panels) == {"displacement_loops", "displacement_width"}
    assert len(outcome.panels["displacement_loops"].items) == len(AMPLITUDES)


def test_a_response_ahead_of_its_drive_is_no_result(response: np.ndarray) -> None:
    backwards = record(sines()[::-1], response[::-1])
    with no_result(Cause.RESPONSE_LEADS, channel="de"):
        hysteresis.measure({"record": backwards}, BARE)
    # A straight line stored one sample early is still a line: 2 pi / 1000 of the loop, not taken for hysteresis turned
    early = record(sines(), np.roll(24e-6 * sines(), -1))
    assert math.isfinite(measured(early)["hysteresis_percent"].value)


def test_a_clipped_response_is_no_result(response: np.ndarray) -> None:
    top = 0.7 * response.max()  # a polynomial centre line would follow so flat a top
    with no_result(Cause.CHANNEL_STUCK, channel="de"):
        hysteresis.measure({"record": record(sines(), np.minimum(response, top), noise=0.0)}, BARE)


@pytest.mark.parametrize("spec", ["apa", "strut", "strut-basic"])
def test_the_built_in_limits_are_for_a_stated_amplitude(spec: str, response: np.ndarray) -> None:
    """A limit at full drive says nothing on a record of small sines."""
    small = record(sines()[:6000], response[:6000])
    with no_result(Cause.SINE_SMALL):
        hysteresis.measure({"record": small}, load(spec).checks["hysteresis"])


def test_a_drive_measured_behind_the_amplifier_is_no_result(response: np.ndarray) -> None:
    """0.2 V at the DAC would else be taken for the 4 V that are asked for."""
    with no_result(Cause.DRIVE_BEHIND_AMPLIFIER):
        hysteresis.measure({"record": record(20 * sines(), response)}, BARE)


@cache
def not_measured() -> dict[str, tuple[np.ndarray, Cause]]:
    rng = np.random.default_rng(12)
    moved, lagging = 24e-6 * sines(), PLAYS.response(sines())
    return {
        "computed": (moved, Cause.CHANNEL_NOISELESS),
        "looped back": (moved + 4e-9 * rng.standard_normal(moved.size), Cause.LOOP_NARROW),
        "stored early": (np.roll(lagging, -20) + 4e-9 * rng.standard_normal(moved.size), Cause.RESPONSE_LEADS),
    }


@pytest.mark.parametrize("case", not_measured())
def test_what_no_actuator_makes_is_no_result(case: str) -> None:
    """The width is a ratio: neither a wrong scale nor a wire in place of the actuator shows in it."""
    de, cause = not_measured()[case]
    given = Record(np.arange(de.size) * 1e-3, {"Va": sines(), "de": de}, {})
    with no_result(cause):
        hysteresis.measure({"record": given}, load("apa").checks["hysteresis"])


@pytest.mark.parametrize(
    ("scale", "verdict"), [(1.0, "pass"), (1e3, "conditional"), (0.5, "conditional"), (2.0, "conditional")]
)
def test_a_loop_of_another_gain_cannot_pass(scale: float, verdict: str) -> None:
    """The width is a ratio: in mm, or with one of two stacks dead, it is the same."""
    check = load("apa").checks["hysteresis"]
    noise = 4e-9 * np.random.default_rng(13).standard_normal(sines().size)
    given = Record(np.arange(noise.size) * 1e-3, {"Va": sines(), "de": scale * (PLAYS.response(sines()) + noise)}, {})
    finding = judge("hysteresis", measured(given, check)["hysteresis_percent"], check.limits["hysteresis_percent"])
    assert finding.verdict.value == verdict
    assert verdict == "pass" or Cause.WRONG_GAIN in causes(finding.cause)


def test_a_loop_too_wide_fails_whatever_its_gain() -> None:
    """Play adds to the motion: 3 times the usual loss moves half as much again."""
    check = load("apa").checks["hysteresis"]
    wide = Plays.of(gain=20e-6, share=3.0, largest=4.5, count=200)
    q = measured(record(sines(), wide.response(sines())), check)["hysteresis_percent"]
    assert q.U is None
    assert judge("hysteresis", q, check.limits["hysteresis_percent"]).verdict.value == "fail"


def test_a_period_of_too_few_samples_to_show_a_loop_is_no_sine() -> None:
    """As a record of noise has them: five samples cannot carry the centre line and the shape of the opening."""
    period = np.array([0.0, 1.0, 0.1, -1.0, -0.1])
    cycle = Cycle(0, 5, 1.0, 0.0, 2 * np.pi * np.arange(5) / 5)
    with no_result(Cause.NO_SINE):
        hysteresis.loop_of(period, 24e-6 * period, cycle)
