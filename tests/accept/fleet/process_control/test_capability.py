"""Capability and performance against their definitions, published figures, and the coverage of their intervals."""

import numpy as np
import pytest
from scipy import stats

from accept.fleet.process_control.capability import LEAST, NOT_NORMAL, _p_of, capability, normality


def standard(n: int, mean: float, sigma: float, seed: int = 1) -> np.ndarray:
    """Return n values whose mean and standard deviation are exactly these."""
    x = np.random.default_rng(seed).standard_normal(n)
    return mean + sigma * (x - x.mean()) / x.std(ddof=1)


def test_performance_is_that_of_the_handbook():
    """[NIST] 6.1.6: limits 8 and 20, mean 16, sigma 2 give 1.0 and 0.6667."""
    made = capability(standard(50, 16.0, 2.0), 8.0, 20.0)
    assert (made.Pp.value, made.Ppk.value) == (pytest.approx(1.0), pytest.approx(2.0 / 3.0))


def test_capability_takes_the_spread_within_and_performance_that_of_all_values():
    """A process that steps by 10 sigma once: the moving range hardly sees it, the standard deviation does."""
    rng = np.random.default_rng(2)
    x = rng.standard_normal(400)
    x[200:] += 10.0
    made = capability(x, -20.0, 30.0)
    assert made.sigma_within == pytest.approx(np.abs(np.diff(x)).mean() / 1.128, rel=1e-3)
    assert made.sigma_overall == pytest.approx(x.std(ddof=1))
    assert made.Cpk.value > 4.0 * made.Ppk.value
    assert made.Cpk.value == pytest.approx(min(30.0 - x.mean(), x.mean() + 20.0) / (3.0 * made.sigma_within))


def test_one_limit_gives_one_side():
    made = capability(standard(20, 3.0, 1.0), None, 10.0)
    assert made.Ppk.value == pytest.approx(7.0 / 3.0)
    assert made.Pp is None
    assert made.Cp is None
    below = capability(standard(20, 3.0, 1.0), 4.0, None).Ppk
    assert below.value < 0 < below.hi - below.lo


@pytest.mark.parametrize(("n", "ppk", "lo", "hi"), [(20, 1.33, 0.88, 1.78), (45, 1.15, 0.89, 1.41)])
def test_its_interval_is_that_of_published_examples(n, ppk, lo, hi):
    """[Montgomery] chapter 8, and Quality Digest, May 2000, The last word; printed to two digits."""
    made = capability(standard(n, 0.0, 1.0), -3.0 * ppk, None).Ppk
    assert (made.value, made.lo, made.hi) == pytest.approx((ppk, lo, hi), abs=0.005)


def test_its_intervals_cover():
    """1000 samples of 30 from a process with an index of 1.2: 95 % within the 99.9 % binomial band (917 to 975 for the
    approximations, which are known to be a little short for small samples; 927 to 973 for the exact one of Pp)."""
    rng = np.random.default_rng(3)
    made = [capability(rng.standard_normal(30), -3.6, 3.6) for _ in range(1000)]
    wide = [capability(rng.standard_normal(30), -3.6, 5.0) for _ in range(1000)]
    assert 927 <= sum(c.Pp.lo <= 1.2 <= c.Pp.hi for c in made) <= 973
    for name in ("Ppk", "Cpk"):
        assert 917 <= sum(getattr(c, name).lo <= 1.2 <= getattr(c, name).hi for c in wide) <= 975
    assert 917 <= sum(c.Cp.lo <= 1.2 <= c.Cp.hi for c in made) <= 975


@pytest.mark.parametrize(("a", "p"), [(0.631, 0.10), (0.752, 0.05), (0.873, 0.025), (1.035, 0.01)])
def test_chances_of_the_normality_test_are_the_published_ones(a, p):
    """[Stephens] table 4.7, case 3, against the fits of table 4.9: to 3 % of the chance."""
    assert _p_of(a) == pytest.approx(p, rel=0.03)


def test_normal_values_are_rarely_called_otherwise_and_others_are():
    """1000 normal samples of 100: at most 13 below 0.005 (99.9 % of a binomial with mean 5)."""
    rng = np.random.default_rng(4)
    assert sum(normality(rng.standard_normal(100)) < NOT_NORMAL for _ in range(1000)) <= 13
    assert sum(normality(rng.weibull(1.2, 100)) < NOT_NORMAL for _ in range(100)) >= 95


@pytest.mark.parametrize(
    ("family", "name"), [(stats.weibull_min(1.5, scale=2.0), "Weibull"), (stats.foldnorm(0.0), "folded normal")]
)
def test_values_that_are_not_normal_have_an_index_of_their_percentiles(family, name):
    """1000 values, upper limit at a true index of 1.33: within 15 %, which is what the percentile 99.865 of a fit to
    1000 values is known to. The index that takes them for normal is a third too good."""
    middle, high = family.ppf([0.5, 0.99865])
    limit = middle + 1.33 * (high - middle)
    made = capability(family.rvs(1000, random_state=np.random.default_rng(5)), None, limit)
    assert not made.normal
    assert made.percentiles.Ppk == pytest.approx(1.33, rel=0.15)
    assert made.Ppk.value > 1.25 * made.percentiles.Ppk


def test_a_mixture_that_no_distribution_fits_has_no_index_of_percentiles():
    x = np.concatenate([standard(98, 360.0, 4.0), [181.0, 182.0]])
    made = capability(x, 304.0, None)
    assert not made.normal
    assert made.percentiles is None


@pytest.mark.parametrize(
    ("values", "lower", "upper"),
    [
        (np.ones(LEAST - 1), 0.0, 2.0),
        (np.ones(20), 0.0, 2.0),
        (np.arange(20.0), None, None),
        (np.array([np.inf] * 20), 0.0, 1.0),
    ],
)
def test_what_has_no_capability_is_refused(values, lower, upper):
    with pytest.raises(ValueError, match=r"expected|vary|limit"):
        capability(values, lower, upper)
