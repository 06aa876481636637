"""Runs of equal values: found where a number was copied, and rare among readings of a meter."""

import numpy as np
import pytest

from accept.fleet.process_control.control_chart import chart
from accept.fleet.process_control.equal_runs import FALSE_ALARM, equal_runs


def read(rng: np.random.Generator, count: int, sigmas: float, step: float = 0.01) -> np.ndarray:
    """Readings of a process whose standard deviation is so many steps of the meter."""
    return np.round((5.1 + sigmas * step * rng.standard_normal(count)) / step).astype(int) * step


@pytest.mark.parametrize("sigmas", [0.5, 1.0, 4.0, 13.0, 100.0])
@pytest.mark.parametrize("count", [12, 50, 260])
def test_measured_values_show_such_a_run_in_fewer_charts_than_stated(count, sigmas):
    """From a step of two sigma to one of a hundredth. The bound is `FALSE_ALARM`; of 600 charts 3 sd more: 3.7 %."""
    rng = np.random.default_rng(18)
    rang = sum(bool(equal_runs(read(rng, count, sigmas), {})) for _ in range(600))
    assert rang / 600 <= FALSE_ALARM + 3.0 * np.sqrt(FALSE_ALARM / 600)


def test_a_drift_or_two_meters_do_not_ring():
    """The scatter is that within the process: 200 charts of 260 values that drift by 8 of their sigma, and of two
    operators in turn, one with the steps of a meter ten times as coarse."""
    rng, who = np.random.default_rng(19), np.array(["Ann", "Ben"] * 130, dtype=object)
    rang = [0, 0]
    for _ in range(200):
        rang[0] += bool(equal_runs(np.round(read(rng, 260, 4.0) + np.linspace(0.0, 0.32, 260), 2), {}))
        mixed = np.where(who == "Ann", read(rng, 260, 130.0, 0.001), read(rng, 260, 13.0))
        rang[1] += bool(equal_runs(mixed, {"operator": who, "bench": np.full(260, "", dtype=object)}))
    assert max(rang) <= 200 * FALSE_ALARM + 3.0 * np.sqrt(200 * FALSE_ALARM)


def test_a_number_that_one_of_two_operators_copies_is_found_with_its_values_and_whose_they_are():
    """160 times 4.95 after 100 readings at a step of 0.01 and a standard deviation of 0.13: four in a row happen once
    in (0.13 / 0.01)^3 = 2000 values, so five are found."""
    rng, who = np.random.default_rng(20), np.array(["Ann", "Ben"] * 260, dtype=object)
    x = read(rng, 520, 13.0)
    copied = np.flatnonzero(who == "Ben")[100:]
    x[copied] = 4.95
    (run,) = equal_runs(x, {"operator": who})
    assert (list(run.at), run.place, run.usual) == (list(copied), ("operator", "Ben"), 4)
    few = read(rng, 260, 13.0)
    few[40:45] = 5.11
    (run,) = equal_runs(few, {})
    assert {*range(40, 45)} <= {*run.at}


def test_a_meter_that_stands_still_is_found_among_the_values_of_its_bench():
    """Two operators at it in turn, both also at another bench."""
    rng = np.random.default_rng(21)
    x, who, bench = read(rng, 200, 13.0), np.full(200, "Ann", dtype=object), np.full(200, "B1", dtype=object)
    who[rng.permutation(200)[:100]] = "Ben"
    bench[1::2] = "B2"
    x[101:141:2] = 5.02
    (run,) = equal_runs(x, {"operator": who, "bench": bench})
    assert (run.at.size, run.place) == (20, ("bench", "B2"))


def test_values_that_never_vary():
    """Without any scatter an even chance of a tie is assumed: many in a row ring, few do not."""
    x = np.full(90, 4.95)
    assert [run.at.size for run in equal_runs(x, {})] == [90]
    assert equal_runs(x[:12], {}) == []
    x[35] = 1.575  # nor does one that was mistyped among them hide it
    assert [run.at.size for run in equal_runs(x, {})] == [35, 54]


@pytest.mark.parametrize("count", [60, 90, 140, 160])
def test_equal_values_ring_no_test_of_a_chart_by_their_rounding_error(count):
    """The mean of 90 times 4.95 is not 4.95 in floating point; sigma is zero."""
    for value in (4.95, 0.1, 10.28):
        assert chart(np.full(count, value)).alarms == ()
