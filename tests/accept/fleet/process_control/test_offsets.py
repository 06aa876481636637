"""Offsets of a meter: found with their size, and no difference of days, lots or people who share a meter."""

import numpy as np
import pytest

from accept.fleet.process_control.offsets import largest_offset

DAY = np.repeat(np.arange(52), 10)
WHO = np.array(["Ann", "Ben"] * 260, dtype=object)


def test_an_offset_has_its_place_and_its_size():
    """0.5 sigma between 260 values each: 5.7 standard errors."""
    x = np.random.default_rng(1).standard_normal(520) + 0.5 * (WHO == "Ben")
    found = largest_offset(x, {"operator": WHO, "bench": np.where(WHO == "Ann", "LCR-1", "LCR-2").astype(object)}, DAY)
    assert found.place == ("bench", "LCR-2")  # both columns part the values alike: one comparison
    assert (found.at == np.flatnonzero(WHO == "Ben")).all()
    assert found.error == pytest.approx(np.sqrt(2 / 260), rel=0.1)  # 468 degrees know sigma to 3 %: 3 sd
    assert found.size == pytest.approx(0.5, abs=3.0 * found.error)
    assert found.chance < 1e-5


@pytest.mark.parametrize("people", [2, 3, 5])
def test_its_chance_is_that_of_values_without_a_cause(people):
    """Of 400 charts with lots that differ, 5 % and 1 % by chance; the bound of several people lies a little above."""
    rng, rare = np.random.default_rng(people), np.zeros(2)
    for _ in range(400):
        who = rng.integers(people, size=520).astype(str).astype(object)
        x = rng.standard_normal(520) + 2.0 * rng.standard_normal(52)[DAY]
        rare += np.array([0.05, 0.01]) >= largest_offset(x, {"operator": who}, DAY).chance
    assert (rare <= 400 * np.array([0.05, 0.01]) + 3.0 * np.sqrt(400 * np.array([0.05, 0.01]))).all()
    assert rare[0] >= 5


def test_who_measured_on_other_days_is_compared_with_nobody():
    x = np.random.default_rng(2).standard_normal(520) + 3.0 * (DAY < 26)
    assert largest_offset(x, {"operator": np.where(DAY < 26, "Ann", "Ben").astype(object)}, DAY) is None
    assert largest_offset(x, {"operator": np.full(520, "Ann", dtype=object)}, DAY) is None
    assert largest_offset(x, {}, DAY) is None


def test_values_that_do_not_vary_have_no_offset():
    assert largest_offset(np.full(520, 4.95), {"operator": WHO}, DAY) is None
