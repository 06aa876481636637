"""Marginal and conditional uncertainty of a fitted value against closed forms of a known covariance."""

import numpy as np
import pytest

from checks.fitting.coordinates import Free
from checks.fitting.fit import Fit
from checks.fitting.identifiability import identifiability


def fit_of(cov: list[list[float]]) -> Fit:
    names = ("effect.a", "joint.b", "bench.c")[: len(cov)]
    free = tuple(Free(n, 0.0) for n in names)
    return Fit(names, np.zeros(len(cov)), np.array(cov), free, 0.0, 0.0, True, "", (), (), (), ())


def test_two_values_share_what_their_correlation_says() -> None:
    it = identifiability(fit_of([[4.0, 1.2e-3], [1.2e-3, 1e-6]]), "effect.a")  # correlation 0.6, scales far apart
    assert (it.sd, it.rival, it.correlation) == (2.0, "joint.b", pytest.approx(0.6))
    assert it.sd_alone == pytest.approx(2.0 * 0.8)  # sqrt(1 - 0.6^2)
    assert it.inflation == pytest.approx(1.25)


def test_alone_is_one_over_the_root_of_the_information() -> None:
    F = np.array([[9.0, 3.0, -1.0], [3.0, 4.0, 0.5], [-1.0, 0.5, 2.0]])
    it = identifiability(fit_of(np.linalg.inv(F).tolist()), "effect.a")
    assert it.sd_alone == pytest.approx(1.0 / 3.0)
    assert it.rival == "joint.b"
    assert it.correlation < 0.0  # information of one sign is correlation of the other


def test_a_value_that_another_can_replace_is_far_wider_than_alone() -> None:
    r = 1 - 1e-8
    assert identifiability(fit_of([[1.0, r], [r, 1.0]]), "effect.a").inflation > 1e3


def test_a_single_value_is_its_own_rival_and_a_strange_name_is_refused() -> None:
    assert identifiability(fit_of([[4.0]]), "effect.a").inflation == 1.0
    with pytest.raises(KeyError, match=r"effect\.a"):
        identifiability(fit_of([[4.0]]), "crosstalk.V_per_V")
