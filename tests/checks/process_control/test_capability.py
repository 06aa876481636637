"""Capability against its definition, and the coverage of its interval."""

import numpy as np
import pytest

from checks.process_control.capability import LEAST, capability


def test_it_is_the_nearest_limit_in_three_sigmas():
    x = np.array([1.0, 2.0, 3.0, 4.0, 5.0] * 4)
    sd = x.std(ddof=1)
    both = capability(x, 0.0, 10.0)
    assert both.cpk == pytest.approx(3.0 / (3 * sd))
    assert both.cp == pytest.approx(10.0 / (6 * sd))
    assert capability(x, None, 10.0).cpk == pytest.approx(7.0 / (3 * sd))
    assert capability(x, None, 10.0).cp is None
    assert capability(x, 4.0, None).cpk < 0 < both.lo < both.cpk < both.hi


@pytest.mark.parametrize(("n", "cpk", "lo", "hi"), [(20, 1.33, 0.88, 1.78), (45, 1.15, 0.89, 1.41)])
def test_its_interval_is_that_of_published_examples(n, cpk, lo, hi):
    """[Montgomery] chapter 8, and Quality Digest, May 2000, The last word; printed to two digits."""
    x = np.random.default_rng(1).standard_normal(n)
    x = (x - x.mean()) / x.std(ddof=1)
    found = capability(x, -3.0 * cpk, None)
    assert (found.cpk, found.lo, found.hi) == pytest.approx((cpk, lo, hi), abs=0.005)


def test_its_interval_covers():
    """1000 samples of 30 from a process with Cpk 1.2: 95 % within the 99.9 % binomial band, widened by 1 % for
    Bissell's approximation (it is known to be a little short for small samples)."""
    rng = np.random.default_rng(3)
    hits = sum((c := capability(rng.standard_normal(30), -3.6, 5.0)).lo <= 1.2 <= c.hi for _ in range(1000))
    assert 917 <= hits <= 975


@pytest.mark.parametrize(
    ("values", "lower", "upper", "words"),
    [
        (np.ones(LEAST - 1), 0.0, 2.0, "expected"),
        (np.ones(20), 0.0, 2.0, "not measured one by one"),
        (np.arange(20.0), None, None, "limit"),
        (np.array([np.inf] * 20), 0.0, 1.0, "finite"),
    ],
)
def test_what_has_no_capability_is_refused(values, lower, upper, words):
    with pytest.raises(ValueError, match=words):
        capability(values, lower, upper)
