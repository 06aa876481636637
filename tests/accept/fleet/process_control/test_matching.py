"""Matching against trying every choice."""

from itertools import combinations

import numpy as np
import pytest

from accept.fleet.process_control.matching import cost, ideal_replacement, match


@pytest.mark.parametrize("seed", range(4))
def test_the_best_set_is_the_best_of_all(seed):
    rng = np.random.default_rng(seed)
    x, U = rng.standard_normal((12, 3)) * [1.0, 5.0, 0.2], np.array([0.1, 1.0, 0.05])
    best = min(combinations(range(12), 6), key=lambda s: cost(x / U, s))
    found = match(x, U, 6)
    assert found.proven
    assert found.costs[0] == pytest.approx(cost(x / U, best), rel=1e-6)
    assert found.costs[0] == pytest.approx(cost(x / U, found.sets[0]), rel=1e-6)


def test_disjoint_sets_share_the_least_sum():
    rng = np.random.default_rng(9)
    x, U = rng.standard_normal((8, 2)), np.ones(2)
    sums = [
        cost(x, a) + cost(x, b)
        for a in combinations(range(8), 3)
        for b in combinations([i for i in range(8) if i not in a], 3)
    ]
    found = match(x, U, 3, sets=2)
    assert sum(found.costs) == pytest.approx(min(sums), rel=1e-6)
    assert not set(found.sets[0]) & set(found.sets[1])


def test_a_badly_known_quantity_does_not_decide():
    """Two quantities that want different sets: the one with the small uncertainty wins."""
    x = np.array([[0.0, 0.0], [0.1, 9.0], [5.0, 0.1], [9.0, 20.0]])
    assert match(x, np.array([0.01, 10.0]), 2).sets == ((0, 1),)
    assert match(x, np.array([10.0, 0.01]), 2).sets == ((0, 2),)


def test_which_member_a_better_unit_should_replace():
    x, U = np.array([[0.0], [1.0], [1.1], [1.2]]), np.array([1.0])
    at, then, lo, hi = ideal_replacement(x, U, (0, 1, 2, 3))
    assert (at, then) == (0, pytest.approx(0.2))
    assert (lo[0], hi[0]) == (1.0, 1.2)


def test_what_cannot_be_matched_is_refused():
    x = np.zeros((4, 1))
    for given, U, size, sets, words in (
        (x, [1.0], 6, 1, "too few"),
        (x, [0.0], 2, 1, "positive"),
        (x * np.nan, [1.0], 2, 1, "finite"),
        (x, [1.0], 2, 3, "too few"),
    ):
        with pytest.raises(ValueError, match=words):
            match(given, np.array(U), size, sets)
