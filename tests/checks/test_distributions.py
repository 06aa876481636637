"""Our few distributions are those of scipy.stats, to the last digit."""

import numpy as np
import pytest
from scipy import stats
from scipy.signal import get_window

from checks import distributions
from checks.signals.spectral.segments import hann

RNG = np.random.default_rng(3)
N = 3000
X = np.concatenate([RNG.chisquare(5.0, N) * 10.0 ** RNG.uniform(-3, 3, N), [0.0, 1e-300, 1e5, np.inf]])
SIGNED = X * RNG.choice([-1.0, 1.0], X.size)
P = np.concatenate([RNG.uniform(0.0, 1.0, N), [0.0, 1.0, 1e-300, 0.5]])
DOF, OTHER = RNG.uniform(0.5, 3000.0, (2, X.size))


@pytest.mark.parametrize(
    ("ours", "theirs", "given"),
    [
        (distributions.chi2.sf, stats.chi2.sf, (SIGNED, DOF)),
        (distributions.chi2.isf, stats.chi2.isf, (P, DOF)),
        (distributions.chi2.ppf, stats.chi2.ppf, (P, DOF)),
        (distributions.chi2.median, stats.chi2.median, (DOF,)),
        (distributions.chi2.logsf, stats.chi2.logsf, (X, DOF)),
        (distributions.norm.pdf, stats.norm.pdf, (SIGNED,)),
        (distributions.norm.sf, stats.norm.sf, (SIGNED,)),
        (distributions.norm.ppf, stats.norm.ppf, (P,)),
        (distributions.norm.isf, stats.norm.isf, (P,)),
        (distributions.t.sf, stats.t.sf, (SIGNED, DOF)),
        (distributions.t.ppf, stats.t.ppf, (P, DOF)),
        (distributions.f.sf, stats.f.sf, (SIGNED, DOF, OTHER)),
    ],
)
def test_as_scipy_stats(ours, theirs, given) -> None:
    np.testing.assert_array_equal(ours(*given), theirs(*given))


@pytest.mark.parametrize("n", [4, 5, 1000, 5001])
def test_the_window_is_that_of_scipy(n: int) -> None:
    np.testing.assert_array_equal(hann(n), get_window("hann", n))
