"""Marginal and conditional uncertainty of a fitted value against closed forms of a known covariance; profiles of the
likelihood against those of a straight line and of a value that the data bound on one side only."""

import numpy as np
import pytest

from checks.errors import ModelError
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset, simulated
from checks.fitting.fit import Fit, fit
from checks.fitting.identifiability import LikelihoodProfile, identifiability
from tests.checks.fitting.function_response import FunctionResponse


def fit_of(cov: list[list[float]]) -> Fit:
    names = ("effect.a", "joint.b", "bench.c")[: len(cov)]
    free = tuple(Free(n, 0.0) for n in names)
    nothing = FunctionResponse(lambda v, f, _: f[:, None] + 0j, {})
    return Fit(nothing, names, np.zeros(len(cov)), np.array(cov), free, 0.0, 0.0, True, "", (), (), (), ())


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
    with pytest.raises(ModelError, match=r"effect\.a"):
        identifiability(fit_of([[4.0]]), "crosstalk.V_per_V")


F = np.linspace(1.0, 2.0, 60)


def measured(H: np.ndarray, sigma: float) -> Dataset:
    cov = np.tile(np.eye(1) * sigma**2, (F.size, 1, 1)).astype(complex)
    return simulated(F, H, ("y",), cov, np.random.default_rng(2))


def test_the_profile_of_a_straight_line_is_the_parabola_of_fisher() -> None:
    """a + b f, whose two values share much: half of the squared distance in marginal standard uncertainties."""
    line = FunctionResponse(lambda v, f, _: (v["a.x"] + v["b.x"] * f)[:, None] + 0j, {"a.x": 1e-3, "b.x": 1e-3})
    data = measured((2.0 + 3.0 * F)[:, None] + 0j, 0.1)
    found = fit(line, data, [Free("a.x", 1.0, scale=1.0), Free("b.x", 1.0, 2.0)])  # b with a prior
    for name in ("a.x", "b.x"):
        it = LikelihoodProfile.of(found, name)
        z = (it.values - found.at[name]) / found.sds[name]
        np.testing.assert_allclose(it.fall, 0.5 * z**2, rtol=1e-3, atol=1e-3)
        np.testing.assert_allclose(it.ci95, found.interval(name), rtol=1e-3)
    assert identifiability(found, "a.x").inflation > 3.0


def test_an_end_that_the_data_do_not_show_is_open() -> None:
    """A low-pass far above the band: any higher corner explains the data too."""
    lag = FunctionResponse(lambda v, f, _: (1.0 / (1.0 + 1j * f / v["lag.f"]))[:, None], {"lag.f": 1e-3})
    data = measured(np.ones((F.size, 1), complex), 0.3)
    found = fit(lag, data, [Free("lag.f", 30.0, lo=0.1, scale=10.0)])
    it = LikelihoodProfile.of(found, "lag.f")
    assert it.ci95[1] == np.inf
    assert 0.0 < it.ci95[0] < found.at["lag.f"]


def test_a_profile_of_a_strange_name_is_refused() -> None:
    with pytest.raises(ModelError, match=r"effect\.a"):
        LikelihoodProfile.of(fit_of([[4.0]]), "b")
