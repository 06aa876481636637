"""Learning a batch: against closed forms, against batches that were drawn, and with units that do not belong."""

import numpy as np
import pytest

from checks.arrays import Array
from checks.population.hierarchy import (
    Belonging,
    Prior,
    compare,
    count_covered,
    determined_parameters,
    information,
    learn,
    learn_without_each,
)

FLAT = 1e6


def belonging(precision: Array, pull: Array, prior: Prior) -> list[Belonging]:
    """Every unit compared with the batch of the others."""
    batches = learn_without_each(precision, pull, prior)
    return [compare(P, h, b) for P, h, b in zip(precision, pull, batches, strict=True)]


def likelihoods(truth: Array, noise: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Every unit measured directly: noise (p, p) covariance."""
    seen = truth + rng.multivariate_normal(np.zeros(truth.shape[1]), noise, len(truth))
    precision = np.broadcast_to(np.linalg.inv(noise), (len(truth), *noise.shape)).copy()
    return precision, seen @ np.linalg.inv(noise)


def normal(p: int, scatter: float = 1.0, mean_sd: float = FLAT, strength: float = 4.0, nu: float = np.inf) -> Prior:
    return Prior(np.zeros(p), np.full(p, mean_sd), np.full(p, scatter), None, strength, nu)


def test_the_prior_of_a_fit_comes_out_again() -> None:
    """A linear Gaussian fit with prior, in any coordinates, gives back the likelihood that went in."""
    rng = np.random.default_rng(1)
    A = rng.standard_normal((7, 4)) * [1.0, 1e-3, 1e6, 1.0]
    A[:, 3] = 0.0  # of which the data say nothing
    y = rng.standard_normal(7)
    half = rng.standard_normal((4, 4)) / np.array([[1.0], [1e-3], [1e6], [1.0]])
    prior_cov, mean = half @ half.T, np.array([1.0, 1e3, -2e-6, 0.3])
    cov = np.linalg.inv(A.T @ A + np.linalg.inv(prior_cov))
    theta = mean + cov @ A.T @ (y - A @ mean)
    precision, pull = information(theta[None], cov[None], mean, prior_cov)
    size = np.sqrt(np.diag(prior_cov))  # rounding: the prior is lost beside data 1e6 times as sharp
    both = np.outer(size, size)
    np.testing.assert_allclose(precision[0] * both, A.T @ A * both, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(pull[0] * size, A.T @ y * size, rtol=1e-6, atol=1e-6)


def test_a_direction_without_variance_is_known_to_rounding_only() -> None:
    """A covariance of which rounding left nothing: the precision is large, and a number."""
    prior = 1e-6 * np.eye(2)
    precision, pull = information(np.ones((1, 2)), np.diag([0.0, 0.5e-6])[None], np.zeros(2), prior)
    assert np.isfinite(precision).all()
    assert np.isfinite(pull).all()
    assert precision[0, 1, 1] == pytest.approx(1e6)


def test_with_scatter_known_the_mean_is_the_weighted_mean() -> None:
    """Strong prior of the scatter: precision of the mean is that of its prior and n / (s^2 + sigma^2); units shrink by
    s^2 / (s^2 + sigma^2)."""
    rng = np.random.default_rng(2)
    noise = 0.5**2 * np.eye(3)
    precision, pull = likelihoods(rng.standard_normal((5, 3)), noise, rng)
    got = learn(precision, pull, normal(3, scatter=1.3, mean_sd=2.0, strength=1e12))
    seen = pull * 0.5**2
    weight = 5 / (1.3**2 + 0.5**2)
    mean = weight * seen.mean(axis=0) / (weight + 1 / 2.0**2)
    np.testing.assert_allclose(got.mean, mean, rtol=1e-6)
    np.testing.assert_allclose(got.mean_cov, np.eye(3) / (weight + 1 / 2.0**2), atol=1e-6)
    share = 1.3**2 / (1.3**2 + 0.5**2)
    np.testing.assert_allclose(got.units, mean + share * (seen - mean), rtol=1e-5, atol=1e-6)


def test_without_a_prior_the_scatter_is_that_of_the_analysis_of_variance() -> None:
    """Balanced units, flat prior: REML is the sample variance (n - 1) less that of the noise."""
    rng = np.random.default_rng(3)
    precision, pull = likelihoods(2.0 * rng.standard_normal((9, 2)), 0.3**2 * np.eye(2), rng)
    got = learn(precision, pull, normal(2, strength=1e-9))
    variance = np.var(pull * 0.3**2, axis=0, ddof=1) - 0.3**2
    np.testing.assert_allclose(got.scatter**2, variance, rtol=1e-3)
    assert got.converged


def test_few_units_shrink_to_the_prior_and_many_leave_it() -> None:
    rng = np.random.default_rng(4)
    scatters = []
    for n in (2, 10, 200):
        precision, pull = likelihoods(3.0 * rng.standard_normal((n, 1)), 0.01 * np.eye(1), rng)
        scatters.append(float(learn(precision, pull, normal(1, strength=4.0)).scatter[0]))
    assert scatters[0] < scatters[1] < scatters[2] == pytest.approx(3.0, rel=0.15)
    assert scatters[0] < 2.5


def test_what_no_unit_tells_stays_as_it_was() -> None:
    """Only the sum of two parameters is measured: the mean of the sum is learned, that of the difference keeps its
    prior, and so does what is foretold of a unit."""
    one = np.array([[1.0, 1.0], [1.0, 1.0]]) / 0.01**2
    precision, pull = np.repeat(one[None], 6, 0), np.repeat((one @ [1.0, 1.0])[None], 6, 0)
    prior = normal(2, scatter=0.5, mean_sd=2.0)
    got = learn(precision, pull, prior)
    both, apart = np.array([1.0, 1.0]) / 2**0.5, np.array([1.0, -1.0]) / 2**0.5
    assert both @ got.mean_cov @ both < 0.2**2
    assert apart @ got.mean_cov @ apart == pytest.approx(2.0**2, rel=1e-3)
    np.testing.assert_allclose(got.mean, [1.0, 1.0], atol=0.02)
    _, (pair,) = determined_parameters(got, prior, correlated=0.9)
    assert pair[:2] == (0, 1)
    assert pair[2] < -0.9


def drawn(rng: np.random.Generator, n: int, p: int, mix: Array) -> tuple[Array, Array, Array, Array]:
    """A batch with bias 2, scatter 1 and data that see `mix` (m, p) of the parameters: mean, units, likelihoods."""
    mean = 2.0 * rng.standard_normal(p)
    units = mean + rng.standard_normal((n, p))
    seen = units @ mix.T + 0.2 * rng.standard_normal((n, len(mix)))
    precision = np.repeat((mix.T @ mix / 0.2**2)[None], n, 0)
    return mean, units, precision, seen @ mix / 0.2**2


def test_intervals_cover_as_often_as_they_say() -> None:
    """150 batches of six units, five data for six parameters: mean, units and one more unit within 95 % intervals, in
    94 to 99.2 % (a few units leave the scatter to the prior, which is right here, and the t allows for it), and the
    normalised square of the whole, so that the correlations are right as well: its mean within 10 % of one."""
    rng, hits, whole = np.random.default_rng(5), [], []
    for _ in range(150):
        mean, units, precision, pull = drawn(rng, 7, 6, rng.standard_normal((5, 6)))
        got = learn(precision[:6], pull[:6], normal(6, mean_sd=2.0))
        more = np.sqrt(np.diag(got.of_one_more))
        sd, unit_sd = np.sqrt(np.diag(got.mean_cov)), np.sqrt(np.diagonal(got.units_cov, axis1=1, axis2=2))
        hits.append(
            [
                np.mean(np.abs(got.mean - mean) < 1.96 * sd),
                np.mean(np.abs(got.units - units[:6]) < 1.96 * unit_sd),
                np.mean(np.abs(got.mean - units[6]) < 1.96 * more),
            ]
        )
        whole.append((got.mean - mean) @ np.linalg.solve(got.mean_cov, got.mean - mean) / 6)
    share = np.mean(hits, axis=0)
    assert np.all((share > 0.93) & (share < 0.992)), share
    assert np.mean(whole) == pytest.approx(1.0, abs=0.15)


def test_t_tails_leave_the_scatter_of_ordinary_units_alone() -> None:
    """200 units: the scatter within 10 % of the truth with tails as without."""
    rng = np.random.default_rng(6)
    precision, pull = likelihoods(rng.standard_normal((200, 1)), 0.1**2 * np.eye(1), rng)
    for nu in (4.0, np.inf):
        assert learn(precision, pull, normal(1, nu=nu)).scatter[0] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("off", [8.0, 30.0, 300.0])
def test_a_unit_with_an_effect_moves_nothing_and_is_told(off: float) -> None:
    """One parameter of one of eight units is far off: the mean moves by less than 0.4 scatters (without tails: by an
    eighth of it), the scatter of the others' other parameters not at all, and leaving it out names it and it alone."""
    rng = np.random.default_rng(7)
    truth = rng.standard_normal((8, 12))
    precision, pull = likelihoods(truth, 0.1**2 * np.eye(12), np.random.default_rng(8))
    struck = truth.copy()
    struck[3, 5] += off
    precision, changed = likelihoods(struck, 0.1**2 * np.eye(12), np.random.default_rng(8))
    before, after = (learn(precision, y, normal(12, nu=4.0)) for y in (pull, changed))
    assert abs(after.mean[5] - before.mean[5]) < 0.4
    np.testing.assert_allclose(np.delete(after.scatter, 5), np.delete(before.scatter, 5), rtol=1e-3)
    assert after.scatter[5] < 2.5
    assert after.weights[3, 5] < 0.4 * np.median(after.weights)
    found = belonging(precision, changed, normal(12, nu=4.0))
    worst = [b.p_worst for b in found]
    assert int(np.argmin(worst)) == 3
    assert worst[3] < 1e-3
    assert int(np.nanargmax(np.abs(found[3].z))) == 5
    assert sum(p < 1e-3 for p in worst) == 1


def test_units_of_one_batch_belong_to_it() -> None:
    """40 batches of eight: a unit is called strange (p < 0.001 of all its parameters or of the worst) in at most 1 % of
    320, and 93 to 99 % of parameters are where the others foretell them."""
    rng, strange, hits, n = np.random.default_rng(9), 0, 0, 0
    for _ in range(40):
        _, _, precision, pull = drawn(rng, 8, 6, rng.standard_normal((5, 6)))
        found = belonging(precision, pull, normal(6, mean_sd=2.0, nu=4.0))
        strange += sum(min(b.p_all, b.p_worst) < 1e-3 for b in found)
        inside, compared = count_covered(found)
        hits, n = hits + inside, n + compared
    assert strange <= 3
    assert 0.93 < hits / n < 0.99


@pytest.mark.parametrize(("bias", "scatter"), [(0.5, 0.4), (4.0, 1.5)])
def test_parameters_of_a_kind_tell_for_each_other(bias: float, scatter: float) -> None:
    """Ten of thirty are measured: how far the file is off and how much units scatter are learned for the other twenty
    too. Three values as stated and ten as they are make the size of the bias, but for the noise of the means (15 %);
    with 80 the scatter is known to 8 %, and the three stated ones hold it back by as much (20 %)."""
    rng = np.random.default_rng(11)
    mean = bias * rng.standard_normal(30)
    truth = mean + scatter * rng.standard_normal((8, 30))
    precision, pull = likelihoods(truth, 0.05**2 * np.eye(30), rng)
    precision[:, 10:, :] = precision[:, :, 10:] = pull[:, 10:] = 0.0
    prior = Prior(np.zeros(30), np.full(30, 2.0), np.ones(30), np.zeros(30, dtype=int), nu=4.0)
    got = learn(precision, pull, prior)
    np.testing.assert_allclose(got.scatter, scatter, rtol=0.2)
    expected = np.sqrt((3 * 2.0**2 + np.sum(mean[:10] ** 2)) / 13)
    np.testing.assert_allclose(np.sqrt(np.diag(got.mean_cov))[10:], expected, rtol=0.15)
    np.testing.assert_allclose(got.mean[:10], truth[:, :10].mean(axis=0), atol=4 * scatter / 8**0.5)


def test_a_common_shift_goes_into_the_mean() -> None:
    rng = np.random.default_rng(10)
    truth = np.array([5.0, 0.0]) + rng.standard_normal((8, 2))
    precision, pull = likelihoods(truth, 0.01 * np.eye(2), rng)
    got = learn(precision, pull, normal(2, mean_sd=3.0, nu=4.0))
    np.testing.assert_allclose(got.mean, truth.mean(axis=0), atol=0.5)
    assert np.all(got.weights.min(axis=1) > 0.3)
    assert compare(precision[0], pull[0], got).p_all > 1e-3
