"""Stroke: against recorded units with known truth, and against loops with a closed form."""

import math
from functools import cache

import numpy as np
import pytest
import scipy.io
from scipy.signal import sawtooth
from scipy.stats import binom

from checks.acceptance import stroke
from checks.cause import Cause, because
from checks.declare import Measured
from checks.quantity import Quantity
from checks.record import Record
from specs.spec import CheckSpec, StatedU
from tests.causes import causes
from tests.checks.acceptance.play_model import Plays
from tests.shared.recorded_units import RecordedUnits
from tests.soak import SOAK

SPEC = CheckSpec(required=False, uncertainty={"d_um": StatedU(U_percent=1.0, source="gauge")})
ONE = Plays.of(gain=0.62e-6, share=0.3, largest=100.0)  # m per V
TWO = Plays.of(gain=1.24e-6, share=0.3, largest=100.0)
T = np.arange(0.0, 20.0, 0.002)
SINE = 65 - 85 * np.cos(2 * np.pi * 0.15 * T)


def record(V: np.ndarray, d: np.ndarray) -> Record:
    return Record(np.arange(V.size) * 0.002, {"V": V, "d": d}, {"V": "V", "d": "m"})


def gauge(d: np.ndarray, rng: np.random.Generator, noise: float = 5e-8, offset: float = 3e-6) -> np.ndarray:
    return 1e-7 * np.round((d + offset + noise * rng.standard_normal(d.size)) / 1e-7)


def measured(one: Record | None, two: Record | None, spec: CheckSpec = SPEC) -> dict[str, Quantity]:
    given = {"one_stack": one, "two_stacks": two}
    outcome = stroke.measure({k: v for k, v in given.items() if v is not None}, spec)
    assert {q.name for q in outcome.quantities} == set(stroke.CHECK.quantities)
    return {q.name: q for q in outcome.quantities}


@pytest.fixture(scope="module")
def sine_response() -> np.ndarray:
    return ONE.response(SINE)


@pytest.mark.parametrize("unit", ["A-01", "A-02", "A-03"])
def test_recorded_units_agree_with_their_truth(unit: str, recorded_units: RecordedUnits) -> None:
    records = []
    for name in ("one_stack", "two_stacks"):
        data = scipy.io.loadmat(recorded_units.folder(unit) / f"stroke_{name}.mat")
        records.append(Record(data["t"].ravel(), {"V": data["V"].ravel(), "d": data["d"].ravel()}, {}))
    q = measured(*records)
    truth = recorded_units.truth(unit)["stroke_um"]
    # The gauge's noise leaves 0.01 um of 370; a tenth of the 0.3 percent that is asked for is 1.1 um.
    assert q["stroke_um"].value == pytest.approx(truth, rel=3e-4)
    assert q["stroke_um"].value == pytest.approx(q["stroke_one_stack_um"].value + q["stroke_two_stacks_um"].value)
    assert q["stroke_um"].U == pytest.approx(0.01 * truth, rel=1e-3)


def drives() -> dict[str, np.ndarray]:
    triangle = 65 + 85 * sawtooth(2 * np.pi * 0.15 * T, width=0.5)
    held = np.interp(T, [0, 1, 6, 8, 13, 20], [-20, -20, 150, 150, -20, -20])
    return {"sines": SINE, "triangles": triangle, "held at both ends": held}


@pytest.mark.parametrize("drive", drives())
def test_recovers_a_closed_form_stroke(drive: str) -> None:
    V = drives()[drive]
    rng = np.random.default_rng(11)
    q = measured(record(V, gauge(ONE.response(V), rng)), record(V, gauge(TWO.response(V), rng)))
    for name, model in (("one_stack", ONE), ("two_stacks", TWO)):
        # 0.1 um of the gauge's step over 120 um; the highest sample alone would be 0.2 um too high
        assert q[f"stroke_{name}_um"].value == pytest.approx(1e6 * model.first_rise(170), abs=0.06)
        width = 100 * model.width(85) / model.first_rise(170)
        loop = q[f"stroke_hysteresis_{name}_percent"]
        if drive == "held at both ends":  # one cycle only
            assert "first rise" in (loop.note or "")
        else:
            assert loop.value == pytest.approx(width, abs=0.05)  # 0.05 um of noise over 120 um
            # both records have the same share of plays
            assert q["stroke_hysteresis_percent"].value == pytest.approx(width, abs=0.05)


def test_intervals_are_honest(sine_response: np.ndarray) -> None:
    """Scatter and the stated accuracy drawn, 95 percent interval = 1.96/2 of U."""
    repeats = 1000 if SOAK else 200
    rng = np.random.default_rng(20262)
    spec = CheckSpec(required=False, uncertainty={"d_um": StatedU(U=0.02, source="gauge")})
    truth, hits = 1e6 * ONE.first_rise(170), 0
    for _ in range(repeats):
        # A wide scatter and a small stated part, so that both count
        d = sine_response * (1 + 1e-8 / ONE.first_rise(170) * rng.standard_normal())
        q = measured(record(SINE, d + 2e-7 * rng.standard_normal(T.size)), None, spec)["stroke_one_stack_um"]
        assert q.U is not None
        hits += abs(q.value - truth) <= 1.96 / 2 * q.U
    lo, hi = binom.interval(0.999, repeats, 0.95)
    assert lo <= hits <= hi


def test_noise_does_not_lift_the_stroke(sine_response: np.ndarray) -> None:
    rng = np.random.default_rng(5)
    found = [
        measured(record(SINE, gauge(sine_response, rng, noise=5e-7)), None)["stroke_one_stack_um"].value
        for _ in range(20)
    ]
    # max() of these records is 1.5 um too high; the mean of 20 local fits scatters by 0.03 um
    assert np.mean(found) == pytest.approx(1e6 * ONE.first_rise(170), abs=0.15)


def refusals() -> dict[str, tuple[np.ndarray, float, Cause]]:
    return {
        "starts at 0 V": (np.maximum(SINE, 0.0), 1.0, Cause.VOLTAGE_START),
        "stops at 120 V": (np.minimum(SINE, 120.0), 1.0, Cause.VOLTAGE_TOP),
        "at the converter": (SINE / 20, 1.0, Cause.VOLTAGE_START),
        "gauge turned": (SINE, -1.0, Cause.STROKE_AWAY),
        "gauge does not follow": (SINE, 0.0, Cause.STROKE_AWAY),
    }


@pytest.mark.parametrize("case", refusals())
def test_no_result_with_the_reason(case: str) -> None:
    V, sign, cause = refusals()[case]
    rng = np.random.default_rng(3)
    good = record(SINE, gauge(TWO.response(SINE), rng))
    q = measured(record(V, gauge(sign * 0.65e-6 * V, rng)), good)
    assert causes(q["stroke_one_stack_um"]) == causes(q["stroke_um"]) == {cause}
    assert math.isnan(q["stroke_um"].value)
    assert q["stroke_two_stacks_um"].value == pytest.approx(1e6 * TWO.first_rise(170), rel=1e-3)


def test_one_record_is_not_the_stroke_of_three_stacks(sine_response: np.ndarray) -> None:
    q = measured(record(SINE, sine_response), None)
    absent = because(Cause.NOT_MEASURED, record="two_stacks")
    assert q["stroke_um"].reason == q["stroke_hysteresis_percent"].reason == absent


def test_half_a_loop_has_a_stroke_and_no_width() -> None:
    V = SINE[: T.size // 6]
    q = measured(record(V, ONE.response(V)), None)
    assert q["stroke_one_stack_um"].value == pytest.approx(1e6 * ONE.first_rise(170), rel=1e-3)
    assert causes(q["stroke_hysteresis_one_stack_percent"]) == {Cause.NO_LOOP}


def test_a_record_that_ends_rising_has_the_same_loop(sine_response: np.ndarray) -> None:
    n = round(2.5 / 0.15 / 0.002)  # two and a half cycles
    rising = measured(record(SINE[:n], sine_response[:n]), None)["stroke_hysteresis_one_stack_percent"]
    falling = measured(record(SINE, sine_response), None)["stroke_hysteresis_one_stack_percent"]
    assert rising.value == pytest.approx(falling.value, abs=0.01)
    assert rising.value > 0


def test_what_the_voltage_lacks_widens_the_interval(sine_response: np.ndarray) -> None:
    full = measured(record(SINE, sine_response), None)["stroke_one_stack_um"]
    V = SINE - 0.5
    short = measured(record(V, sine_response), None)["stroke_one_stack_um"]
    assert short.U is not None
    assert full.U is not None
    assert short.U > full.U
    assert any("voltage" in c.source for c in short.budget)


def test_unstated_accuracy_is_unknown_not_zero(sine_response: np.ndarray) -> None:
    bare = CheckSpec(required=False)
    given = record(SINE, sine_response), record(SINE, 2 * sine_response)
    q = measured(*given, bare)
    assert q["stroke_um"].U is None
    assert q["stroke_one_stack_um"].U is None
    whole = CheckSpec(required=False, uncertainty={"stroke_um": StatedU(U_percent=1.0, source="gauge")})
    assert measured(*given, whole)["stroke_um"].U == pytest.approx(0.01 * q["stroke_um"].value, rel=1e-3)


def test_typed_value() -> None:
    spec = CheckSpec(required=False, uncertainty={"stroke_um": StatedU(U_percent=1.0, source="s")})
    found = {q.name: q for q in stroke.measure({"stroke_um": Measured(365.5)}, spec).quantities}
    assert set(found) == set(stroke.CHECK.quantities)
    assert (found["stroke_um"].value, found["stroke_um"].U) == (365.5, pytest.approx(3.655))
    assert all(q.reason for name, q in found.items() if name != "stroke_um")


def test_panel_shows_both_loops(sine_response: np.ndarray) -> None:
    given = record(SINE, sine_response)
    panel = stroke.measure({"one_stack": given, "two_stacks": given}, SPEC).panels["loops"]
    assert [item.label for item in panel.items[:2]] == ["one stack", "two stacks"]


@cache
def spoiled() -> dict[str, tuple[np.ndarray, Cause]]:
    d = ONE.response(SINE)
    rng = np.random.default_rng(3)
    held = gauge(d, rng)
    held[4000:4400] = held[4000]  # 0.8 s of a period of 6.7 s
    return {
        "in mm": (gauge(1e3 * d, rng), Cause.STROKE_IMPLAUSIBLE),
        "two stacks, not one": (gauge(2 * d, rng), Cause.STROKE_IMPLAUSIBLE),
        "probe stuck": (held, Cause.CHANNEL_STUCK),
        "drifting": (gauge(d + 4e-5 * T / T[-1], rng), Cause.GAUGE_DRIFT),
        "slipped": (gauge(d + np.where(T > 10.0, -3e-5, 0.0), rng), Cause.GAUGE_DRIFT),
    }


@pytest.mark.parametrize("case", spoiled())
def test_what_could_only_be_a_wrong_record_is_no_result(case: str) -> None:
    """Each of these would lie inside a limit that has no upper bound."""
    d, cause = spoiled()[case]
    spec = SPEC.model_copy(update={"settings": {"stroke_max_um": 456.0}})
    q = measured(record(SINE, d), record(SINE, TWO.response(SINE)), spec)
    assert causes(q["stroke_um"]) == {cause}


@cache
def not_measured() -> dict[str, tuple[np.ndarray, np.ndarray, Cause]]:
    """V, d of one stack that look like 123 um of stroke but are no stack's."""
    rng = np.random.default_rng(9)
    half = SINE[: T.size // 6]
    return {
        "looped back": (SINE, 0.72e-6 * SINE, Cause.LOOP_NARROW),
        "looped back, noisy": (SINE, gauge(0.72e-6 * SINE, rng), Cause.LOOP_NARROW),
        "half a loop looped back": (half, gauge(0.72e-6 * half, rng), Cause.NO_CURVATURE),
        "turned in time": (SINE[::-1], gauge(ONE.response(SINE)[::-1], rng), Cause.LOOP_NARROW),
        "stored early": (SINE, gauge(np.roll(ONE.response(SINE), -60), rng), Cause.LOOP_NARROW),
    }


@pytest.mark.parametrize("case", not_measured())
def test_what_does_not_lag_as_a_stack_does_is_no_result(case: str) -> None:
    V, d, cause = not_measured()[case]
    assert causes(measured(record(V, d), None)["stroke_one_stack_um"]) == {cause}


def test_noise_does_not_take_a_loop_for_none() -> None:
    """A loop of 1.5 percent is a loop, also where 0.1 percent of the stroke is noise."""
    narrow = Plays.of(gain=0.7e-6, share=0.07, largest=100.0)
    assert 1.2 < 100 * narrow.width(85.0) / narrow.peak_to_peak(85.0) < 1.8
    d = gauge(narrow.response(SINE), np.random.default_rng(4), noise=1.2e-7)
    assert measured(record(SINE, d), None)["stroke_one_stack_um"].reason is None


@pytest.mark.parametrize(("share", "known"), [(1.0, True), (1.15, True), (0.9, True), (0.6, False), (1.6, False)])
def test_a_stack_unlike_the_others_cannot_pass(share: float, known: bool, sine_response: np.ndarray) -> None:
    """The sum of a weak stack and two strong ones may lie above the lower limit all the same."""
    q = measured(record(SINE, share * sine_response), record(SINE, 2 * sine_response))["stroke_um"]
    assert (q.U is not None) == known
    assert known or causes(q) == {Cause.STACKS_DIFFER}


def test_a_typed_stroke_that_no_actuator_makes_is_no_result() -> None:
    spec = SPEC.model_copy(update={"settings": {"stroke_max_um": 456.0}})
    found = {q.name: q for q in stroke.measure({"stroke_um": Measured(900.0)}, spec).quantities}["stroke_um"]
    assert causes(found) == {Cause.ENTRY_IMPLAUSIBLE}


@pytest.mark.parametrize("total_um", [3.0, 10.0])
def test_a_little_drift_is_in_the_uncertainty(total_um: float, sine_response: np.ndarray) -> None:
    """A linear drift moves the largest reading by no more than all of it; U must cover what it moved."""
    clean = measured(record(SINE, sine_response), None)["stroke_one_stack_um"]
    found = measured(record(SINE, sine_response + total_um * 1e-6 * T / T[-1]), None)["stroke_one_stack_um"]
    moved = found.value - clean.value
    assert moved > 0.3 * total_um
    assert found.U is not None
    assert clean.U is not None
    assert math.hypot(clean.U, moved) <= found.U < 3 * total_um
